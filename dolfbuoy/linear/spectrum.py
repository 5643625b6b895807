"""Bins of a JONSWAP sea for the linear response."""

import numpy as np

#: Band in peak frequencies, and number of bins.
BAND, BINS = (0.5, 4.0), 160


def jonswap_bins(significant_height, peak_period, gamma=3.3) -> tuple[np.ndarray, np.ndarray]:
    """Angular frequencies [rad/s] and S dw [m^2] of each; their sum is Hs^2/16, with what the band leaves out."""
    peak = 2 * np.pi / peak_period
    edges = peak * np.geomspace(*BAND, BINS + 1)
    w = (edges[1:] + edges[:-1]) / 2
    sigma = np.where(w <= peak, 0.07, 0.09)
    shape = w**-5 * np.exp(-1.25 * (peak / w) ** 4) * gamma ** np.exp(-((w / peak - 1) ** 2) / (2 * sigma**2))
    energies = shape * np.diff(edges)
    return w, energies * significant_height**2 / 16 / energies.sum()

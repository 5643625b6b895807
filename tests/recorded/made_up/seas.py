"""Components of every kind of sea, how they run, and the crest that is asked for; wide spectra of a linear answer."""

import numpy as np
from told import refused, show

from dolfbuoy import load_scene
from dolfbuoy.linear.spectrum import bins_of
from dolfbuoy.model.airy import components_of, propagation, sea_of, spectrum_of
from dolfbuoy.model.drift import Drift, transfer

STORM = {"significant_height": 2.0, "peak_period": 7.0, "components": 12, "seed": 3}
RECORD = [[float(t), float(np.sin(0.9 * t) + 0.3 * np.cos(2.1 * t))] for t in range(20)]
TABLE = [[0.05, 0.0], [0.1, 1.5], [0.15, 2.5], [0.2, 1.0], [0.3, 0.2]]
ANGLES = {"frequency": [0.1, 0.15, 0.2], "direction_deg": [-40.0, 0.0, 30.0, 80.0]}
ANGLES["density"] = [[0.0, 0.2, 0.1, 0.0], [0.1, 0.9, 0.5, 0.2], [0.0, 0.1, 0.2, 0.0]]
SEAS = {
    "regular": {"amplitude": 0.7, "period": 6.0, "direction_deg": 20.0, "phase_deg": 40.0},
    "components": {"components": [[0.5, 6.0, 10.0, 30.0], [0.2, 4.0, -50.0, 200.0]], "direction_deg": 15.0},
    "elevation": {"elevation": RECORD, "direction_deg": 35.0},
    "pierson-moskowitz": STORM | {"spectrum": "pierson-moskowitz", "amplitudes": "random"},
    "jonswap": STORM | {"spectrum": "jonswap", "gamma": 2.0, "spreading": 6.0, "band": [0.6, 2.2]},
    "low": STORM | {"spectrum": "jonswap", "band": [0.8]},
    "table": {"spectrum": TABLE, "components": 9, "direction_deg": 10.0},
    "angles": {"spectrum": ANGLES, "components": 16, "direction_deg": 20.0, "seed": 8},
    "crest": STORM | {"spectrum": "jonswap", "crest": 3.0, "crest_time": 20.0, "crest_position": [5.0, -3.0]},
    "new wave": STORM | {"spectrum": "jonswap", "crest": 3.0, "crest_time": 20.0, "crest_sea": "newwave"},
}


def scene_of(waves, speed=0.6, **more):
    """A buoy in 20 m of water and a current."""
    hull = {"hull": [[0.0, 2.4], [1.2, 2.4]], "mass": 2000.0, "center_of_mass": 0.5, "inertia": [900.0, 800.0]}
    return load_scene({"sea": {"depth": 20.0}, "buoy": hull, "current": {"speed": speed}, "waves": waves} | more)


for name, waves in SEAS.items():
    scene = scene_of(waves)
    sea, spectrum = sea_of(scene), spectrum_of(scene.waves)
    show({f"{name} {key}": values for key, values in vars(sea).items()} | {f"{name} rows": sea.as_rows()})
    show({f"{name} moments": [sea.moment(n) for n in (-1, 0, 1, 2)]})
    show({f"{name} bins {key}": values for key, values in vars(bins_of(scene.waves)).items()})
    if spectrum is not None:
        show({f"{name} spectrum": [spectrum.moment(n) for n in (-1, 0, 1)] + [spectrum.peak]})
many = np.random.default_rng(5).uniform([0.1, 3.0, -180.0, 0.0], [0.2, 12.0, 180.0, 360.0], (700, 4)).tolist()
show({f"many {key}": values for key, values in vars(bins_of(scene_of({"components": many}).waves)).items()})
for seen in (None, "water", "ground"):
    for speed, profile in (
        (0.6, {}),
        (0.8, {"profile": "power", "direction_deg": 180.0}),
        (1.5, {"direction_deg": 60.0}),
    ):
        waves = SEAS["regular"] | ({"period_seen_from": seen} if seen else {})
        found = propagation(scene_of(waves, current={"speed": speed} | profile), 6.0, 20.0)
        print(seen, speed, " ".join(f"{x:.7g}" for x in (found.wavenumber, found.in_water, found.at_ground)))
still = {"current": None, "gravity": 9.0}
fixed = propagation(scene_of(SEAS["regular"] | {"wavelength": 40.0}, **still), 6.0, 20.0)
print("wavelength", " ".join(f"{x:.7g}" for x in (fixed.wavenumber, fixed.in_water, fixed.at_ground)))
short = SEAS["regular"] | {"period_seen_from": "ground", "period": 2.0, "direction_deg": 180.0, "amplitude": 0.01}
empty = STORM | {"spectrum": "jonswap", "band": [0.001, 0.002]}
refused(lambda: propagation(scene_of(short, 5.0), 2.0, 180.0), lambda: components_of(scene_of(empty).waves))
numbers = np.random.default_rng(6)
made = [numbers.normal(size=shape) + 1j * numbers.normal(size=shape) for shape in ((4, 3), (4, 3))]
drift = Drift(whole=numbers.normal(size=3), left=made[0], right=made[1])
pairs = transfer(drift, np.cos([0.1, 0.7, 2.0]), np.sin([0.1, 0.7, 2.0]))
show({"pairs, real": pairs.real, "pairs, imaginary": pairs.imag})

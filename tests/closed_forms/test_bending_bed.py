"""Static lines with bending stiffness on a soft bed: forces, curvatures, and local effects at the touchdown.

Source: Gauss collocation of orders 16 and 20 agreeing to 2e-12, on graded intervals, with a free touchdown point.
"""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from dolfbuoy import solve_static

G = 10.0
RISERS = {
    "riser": ([(250.0, 600.0)], 180.0, 1e5, None, 20000.0, 10981.9597952, 70136.4786344, 0.0),
    "lazy wave": (
        [(90.0, 200.0), (40.0, -250.0), (50.0, 200.0)],
        120.0,
        1e3,
        80.0,
        10000.0,
        2505.05108683,
        9367.18721005,
        275.105280251,
    ),
}


#: Largest curvatures [1/m] between arc lengths, the moment where the line lifts [N m], and how deep it sinks [m].
CURVATURES = {
    "riser": {
        "largest": {(0, 250): 0.0455163873126},
        "touchdown": (132.38012104, 2646.72819992),
        "deepest": 0.0406172400824,
    },
    "lazy wave": {
        "largest": {(0, 90): 0.0759291102004, (90, 130): 0.0981419728875, (130, 180): 0.275105280251},
        "touchdown": (43.4735385958, 55.1970832839),
        "deepest": 0.0209717822435,
    },
}


def at_rest(name, per_metre, grading=1.0):
    """Record at rest, of P2-P1, on a Winkler bed; segments go on into each other without a kink.

    grading: of the uppermost segment, whose elements at the clamp must be shorter than sqrt(EI/T).
    """
    segments, reach, stiffness, angle, k, *_ = RISERS[name]
    area, diameter, pieces = 0.01, 0.1, []
    for length, weight in segments:
        buoyant = 0.05 if weight < 0 else area
        pieces.append({"length": length, "elements": int(per_metre * length), "area": buoyant})
        pieces[-1]["line_density"] = (weight + 1025 * buoyant * G) / G
    pieces[-1]["grading"] = grading
    cable = {"segments": pieces, "diameter": diameter, "bending_stiffness": stiffness}
    cable |= {"position_degree": 2, "tension_degree": 1, "top": {"kind": "fixed", "position": [reach, 0.0, 0.0]}}
    if angle is not None:
        cable["to_end"] = {"direction": [math.cos(math.radians(angle)), 0.0, math.sin(math.radians(angle))]}
    sea = {"depth": 100.0, "dry_above": False}
    return solve_static({"gravity": G, "sea": sea, "seabed": {"stiffness": k / diameter}, "cable": cable})


def errors(name, rest):
    """Of what the references have, relative: forces, moment above, largest curvatures, moment where the line lifts, how
    deep it sinks, how much lies; between nodes by cubics, as nodes are too far apart for straight lines."""
    _, _, stiffness, _, _, H, V, moment = RISERS[name]
    apart = np.append(True, np.diff(rest.s.values) > 1e-9)
    s, bent, z = rest.s.values[apart], rest.curvature.values[apart], rest.cable_position.values[apart, 2]
    at, touching = CURVATURES[name]["touchdown"]
    fine = np.linspace(0.0, at + 20.0, 20001)
    found = {"H": rest.end_tension.values[0, 0] / H, "V": rest.end_tension.values[0, 2] / V}
    if moment:
        found["top"] = rest.end_moment.item() / moment
    for (begin, end), curvature in CURVATURES[name]["largest"].items():
        found[f"{begin}-{end} m"] = bent[(s >= begin) & (s <= end)].max() / curvature
    found["lifts"] = CubicSpline(s, stiffness * bent)(at).item() / touching
    found["deepest"] = -(100 + CubicSpline(s, z)(fine).min()) / CURVATURES[name]["deepest"]
    found["lying"] = rest.length_on_bed.item() / at
    return {name: value - 1 for name, value in found.items()}


@pytest.mark.parametrize(("name", "per_metre"), [("riser", 1), ("lazy wave", 1), ("lazy wave", 2)])
def test_on_a_soft_bed(name, per_metre):
    """1 m is 1.6 bending lengths of the lazy wave at its touchdown: local effects there need half of it."""
    rest = at_rest(name, per_metre, grading=0.05)
    found = errors(name, rest)
    assert rest.end_tension.values[0, 1] == pytest.approx(0.0, abs=1e-4)
    fine = name == "riser" or per_metre == 2
    limits = {"H": 5e-5, "V": 2e-5, "lifts": 2e-3 if fine else 1e-2, "deepest": 6e-4 if fine else 2e-3}
    limits["lying"] = 3e-5 if fine else 6e-4
    for of, error in found.items():
        assert abs(error) < limits.get(of, 1e-3), (of, error)
    apart = np.append(True, np.diff(rest.s.values) > 1e-9)
    between = CubicSpline(rest.s.values[apart], RISERS[name][2] * rest.curvature.values[apart])
    assert rest.touchdown_moment.item() == pytest.approx(between(rest.length_on_bed.item()), rel=2e-3)
    assert rest.touchdown_moment.item() == pytest.approx(CURVATURES[name]["touchdown"][1], rel=2e-3 if fine else 3e-2)


def right_in_nodes_of_1m(fine):
    """Errors of the moment where the line lifts and of how deep it sinks, of parabolas on 1 m whose nodes are right."""
    apart = np.append(True, np.diff(fine.s.values) > 1e-9)
    s, (at, touching) = fine.s.values[apart], CURVATURES["lazy wave"]["touchdown"]

    def parabolas(values, places):
        nodes, first = CubicSpline(s, values[apart]), np.floor(places)
        return [
            np.polyval(np.polyfit([0.0, 0.5, 1.0], nodes(k + np.array([0.0, 0.5, 1.0])), 2), place - k)
            for k, place in zip(first, places, strict=True)
        ]

    (moment,) = parabolas(RISERS["lazy wave"][2] * fine.curvature.values, np.array([at]))
    lowest = min(parabolas(fine.cable_position.values[:, 2], np.linspace(0.0, 60.0, 6001)))
    return moment / touching - 1, -(100 + lowest) / CURVATURES["lazy wave"]["deepest"] - 1


@pytest.mark.slow
def test_lazy_wave_by_the_size_of_elements():
    """What is local to the clamp or the touchdown needs elements below the bending length there (0.32 and 0.63 m);
    forces and the curvatures of sag and hog do not.  Prints the table of dolfbuoy/studies/README.md.
    """
    sizes = (2.0, 1.0, 0.5, 0.25, 0.125)
    rows = [errors("lazy wave", at_rest("lazy wave", 1 / size)) for size in sizes]
    print("\nelements [m]", *(f"{name:>9}" for name in rows[0]))
    for size, row in zip(sizes, rows, strict=True):
        print(f"{size:12g}", *(f"{error:9.1e}" for error in row.values()))
    lifts, deepest = right_in_nodes_of_1m(at_rest("lazy wave", 8))
    print(f"1, right in its nodes: lifts {lifts:.1e}, deepest {deepest:.1e}")
    assert lifts > 1e-3
    assert deepest < -2e-3
    assert max(abs(rows[-1][name]) for name in rows[-1]) < 2e-4
    assert max(abs(rows[1][name]) for name in ("H", "V", "0-90 m", "90-130 m", "lying")) < 1e-3
    assert max(abs(row[name]) for row in rows[3:] for name in row) < 1e-3

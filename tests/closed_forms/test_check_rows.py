"""Rarer rows of `check`: extremes of a sea, fatigue of each segment, growth, partly grounded lines.

Source: the asymptotic distribution of the largest of N Rayleigh crests, moments of JONSWAP by quadrature, tables of API
and DNV by hand, T_n = 2/n int sqrt(m/T) ds of catenaries in closed form.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from alone import solve_static
from scipy.integrate import quad

from dolfbuoy import load_scene
from dolfbuoy.check import check, derived, potential_flow, waves
from dolfbuoy.check.buoys import buoys_of
from dolfbuoy.check.lines import lines_of
from dolfbuoy.check.report import Report
from dolfbuoy.scene.network import Network

G, RHO = 9.81, 1025.0


def said_of(scene, look=derived):
    """{name: (value, unit, remark)} of a scene, and its warnings."""
    report = look(load_scene(scene))
    return {name: (value, unit, remark) for name, value, unit, remark in report.numbers}, report.warnings


# -- a sea -------------------------------------------------------------------------------------------------------------

HS, TP, END = 3.0, 8.0, 1800.0
SEA = {
    "sea": {"depth": 500.0},
    "buoy": {"hull": [[0, 2], [2, 2]], "mass": 500.0},
    "waves": {"spectrum": "jonswap", "significant_height": HS, "peak_period": TP},
    "time": {"end": END, "step": 0.1},
}


def jonswap(w):
    """Density over omega, up to a factor."""
    p = 2 * math.pi / TP
    width = 0.07 if w <= p else 0.09
    return w**-5 * math.exp(-1.25 * (p / w) ** 4) * 3.3 ** math.exp(-((w - p) ** 2) / (2 * (width * p) ** 2))


def integral(power):
    p = 2 * math.pi / TP
    return sum(quad(lambda w: jonswap(w) ** power, a, b, limit=200)[0] for a, b in ((0.2 * p, p), (p, 30 * p)))


def test_the_largest_crest_of_three_hours():
    """Of N = 10800 s/Tz Rayleigh crests: q + 0.577/q deviations with a scatter of pi/sqrt(6)/q, q = sqrt(2 ln N)."""
    rows, _ = said_of(SEA)
    crests = 10800 / rows["mean period Tz = 2 pi sqrt(m0/m2)"][0]
    q = math.sqrt(2 * math.log(crests))
    value, unit, remark = rows["largest crest in 3 h"]
    deviation = rows["significant wave height Hs"][0] / 4
    assert value == pytest.approx(deviation * (q + np.euler_gamma / q), rel=5e-3)
    scatter = float(remark.split()[1])
    assert scatter == pytest.approx(100 * math.pi / math.sqrt(6) / q / (q + np.euler_gamma / q), rel=0.1)
    assert (unit, remark) == ("m", f"+- {scatter:.2g} % from seed to seed")
    steep = rows["crest of the steep wave above Airy's"][2]
    assert steep == f"of a wave of {2 * value:.3g} m and 8 s"


def test_components_and_seeds_for_it():
    """(ln N/2 - 1)/(4 %) components; seeds by the bound of maximum likelihood, of which half the width is 3 %."""
    rows, _ = said_of(SEA)
    crests = 10800 / rows["mean period Tz = 2 pi sqrt(m0/m2)"][0]
    value, _, remark = rows["components for 1 % of that crest"]
    assert value == math.ceil((math.log(crests) / 2 - 1) / 0.04)
    q = math.sqrt(2 * math.log(crests))
    seeds = max(10, 4 + (1.96 * math.sqrt(1.1087) / q / q / 0.03) ** 2)
    assert int(remark.split()[5]) == pytest.approx(seeds, rel=0.15)  # q is asymptotic


def test_the_scatter_of_a_run():
    """sqrt(2 pi int S^2 dw/m0^2/T)/2 of the height of a Gaussian sea."""
    rows, _ = said_of(SEA)
    memory = 2 * math.pi * integral(2) / integral(1) ** 2
    assert rows["scatter of Hs in one run"][:2] == (pytest.approx(50 * math.sqrt(memory / END), rel=2e-3), "%")
    rows, _ = said_of({key: value for key, value in SEA.items() if key != "time"})
    assert "scatter of Hs in one run" not in rows
    assert "largest crest in 3 h" in rows


@pytest.mark.parametrize(("share", "word"), [(1.2, "above"), (0.9, "below")])
def test_a_prescribed_crest_beside_the_usual_one(share, word):
    """In standard deviations of the largest of 3 h; steepness is judged by the higher of the two."""
    rows, _ = said_of(SEA)
    usual, _, remark = rows["largest crest in 3 h"]
    crest = share * usual
    rows, warnings = said_of(SEA | {"waves": SEA["waves"] | {"crest": crest, "crest_time": END - 1, "components": 150}})
    usual, _, remark = rows["largest crest in 3 h"]
    value, unit, text = rows["prescribed crest"]
    apart = abs(crest / usual - 1) / (float(remark.split()[1]) / 100)
    assert (value, unit) == (pytest.approx(crest), "m")
    assert text.startswith(f"at t = {END - 1:g} s, ")
    assert text.endswith(f" of that scatter {word}")
    assert float(text.split()[5]) == pytest.approx(apart, rel=0.1)
    assert not any("comes after the end" in sentence for sentence in warnings)
    steep = rows["crest of the steep wave above Airy's"][2]
    assert steep.startswith(f"of a wave of {2 * max(crest, usual):.3g} m")


def test_a_prescribed_crest_that_passes_by():
    """At the anchor of a buoy that rests 15.5 m from it in the current, in waves of 55 m; and where it rests."""
    crest = {"waves__crest": 2.0, "waves__crest_time": 40.0}
    (warning,) = (one for one in check(load_scene("storm", **crest)).warnings if "crest_position" in one)
    assert warning.startswith("waves.crest_position = [0, 0] is 15.5 m")
    assert "[15.5, 0] has it there" in warning
    there = load_scene("storm", **crest, waves__crest_position=(15.5, 0.0))
    assert not any("crest_position" in one for one in check(there).warnings)


# -- fatigue -----------------------------------------------------------------------------------------------------------

PLAIN = {"line_density": 20.0, "axial_stiffness": 1e7, "anchor": [0.0, 0.0, 0.0]}
PLAIN |= {"top": {"kind": "fixed", "position": [0.0, 0.0, 30.0]}}


def references(scene):
    """(curve, part) -> (R = 1, unit) of a scene, in their order, and who is warned of."""
    report = derived(load_scene(scene))
    rows = [(name.partition("'")[2].rstrip("'"), remark, value, unit) for name, value, unit, remark in report.numbers
            if name.startswith("R = 1")]  # fmt: skip
    return rows, [text for text in report.warnings if "ORQ" in text]


def test_references_of_every_segment_once():
    """Each curve and reference once, by the first that has it; connectors have their own; a stress is of the steel."""
    area = math.pi / 2 * 0.05**2
    steel = {"steel_area": area, "breaking_load": 2e6}
    segments = [
        {"length": 10.0, **steel},
        {"length": 10.0, **steel},
        {"length": 10.0, "breaking_load": 1e6, "steel_area": 2 * area},
    ]
    cable = PLAIN | {"segments": segments}
    rows, warned = references({"cable": cable, "fatigue": {"curve": "DNV studless", "connectors": "1e15 N^3"}})
    name = "cable.0", "cable.2"
    assert rows == [
        ("DNV studless", name[0], pytest.approx(1e6 * area), "N/MPa"),
        ("1e15 N^3", name[0], 1.0, "N"),
        ("DNV studless", name[1], pytest.approx(2e6 * area), "N/MPa"),
    ]
    assert not warned


def test_references_without_a_section_on_fatigue():
    """A curve of the line's own; no corrosion, and no word on chain about a rope."""
    line = {"length": 30.0, "breaking_load": 1e6, "steel_area": math.pi / 2 * 0.05**2}
    rows, warned = references({"cable": PLAIN | line | {"fatigue_curve": "DNV studless"}})
    assert rows == [("DNV studless", "cable", pytest.approx(1e6 * line["steel_area"], rel=1e-12), "N/MPa")]
    rope = PLAIN | {"length": 30.0, "breaking_load": 1e6, "fatigue_curve": "DNV polyester"}
    rows, warned = references({"cable": rope})
    assert (rows, warned) == ([("DNV polyester", "cable", 1e6, "N")], [])
    chain = [{"length": 15.0, "breaking_load": load, "fatigue_curve": "API studless"} for load in (1e6, 2e6)]
    rows, (sentence,) = references({"cable": PLAIN | {"segments": chain}})
    assert [value for _, _, value, _ in rows] == [1e6, 2e6]
    assert sentence.startswith("Fatigue of cable.0, cable.1: API refers")


# -- lines -------------------------------------------------------------------------------------------------------------


def test_parts_of_one_material_are_one_line():
    """With the length of all pieces and the name of the first; a cable of one material has its own name."""
    rope = {"line_density": 9.0, "diameter": 0.05, "axial_stiffness": 1e6}
    scene = load_scene({
        "sea": {"depth": 20.0},
        "cable": [
            {"name": "a", "from": [30.0, 0.0, -20.0], "to": [0, 0, 0], **rope,
             "segments": [{"length": 11.0}, {"length": 12.0}, {"length": 13.0, "line_density": 30.0}]},
            {"name": "b", "from": [-30.0, 0.0, -20.0], "to": [0, 1, 0], **rope,
             "segments": [{"length": 20.0}, {"length": 15.5}]},
        ],
    })  # fmt: skip
    network: Network = scene.network
    found = [(line.name, line.pieces, line.length, line.material.line_density) for line in lines_of(network)]
    assert found == [("a.0", [0, 1], 23.0, 9.0), ("a.2", [2], 13.0, 30.0), ("b", [3, 4], 35.5, 9.0)]
    report = derived(scene)
    w = (9.0 - RHO * math.pi * 0.05**2 / 4) * G
    numbers = {name: value for name, value, *_ in report.numbers}
    assert numbers["a.0: cable weight in water"] == pytest.approx(23 * w)
    assert numbers["b: cable weight in water"] == pytest.approx(35.5 * w)
    assert numbers["a.2: cable weight in water per metre"] == pytest.approx(w + 21 * G)


@pytest.mark.parametrize("pieces", [1, 2])
def test_what_lies_does_not_swing(pieces):
    """Periods of the suspended part: 2/n int sqrt(m/T) ds, T of the catenary; equal for two segments of one line."""
    w, H, m, added = 900.0, 40e3, 120.0, 0.8
    d = math.sqrt((m - w / G) / RHO * 4 / math.pi)
    height = 30.0
    hangs = math.sqrt((height + 2 * H / w) * height)
    span = H / w * math.asinh(hangs * w / H)
    length, lies = 100.0, 100.0 - hangs
    cable = {"line_density": m, "diameter": d, "axial_stiffness": 5e9, "added_mass": added, "slack": "tension-only"}
    part = {"length": length / pieces, "elements": 80 // pieces}
    cable |= {"anchor": [0.0, 0.0, -height], "segments": [part] * pieces}
    cable["top"] = {"kind": "fixed", "position": [lies + span, 0.0, 0.0]}
    report = check(load_scene({"sea": {"depth": height}, "seabed": {"friction": 0.0}, "cable": cable}))
    mass = m + added * RHO * math.pi * d**2 / 4
    travel = quad(lambda s: math.sqrt(mass / math.hypot(H, w * s)), 0, hangs)[0]
    for n in (1, 2):
        period = report.periods[f"cable, transverse {n} (taut, fixed ends)"]
        assert period == pytest.approx(2 * travel / n, rel=0.02)
    assert 0.02 * hangs < 0.2 * lies  # of all of the line it would be off by more


def test_growth_of_each_segment():
    """The largest factors of diameter and mass of any element of a cable, its weight of all."""
    table = [[-30.0, 1.1, 1.05], [-15.0, 1.3, 1.2], [0.0, 2.0, 1.7]]
    line = {"line_density": 15.0, "diameter": 0.05, "axial_stiffness": 1e7, "anchor": [0.0, 0.0, -30.0]}
    segments = [{"length": 14.0, "elements": 4}, {"length": 14.0, "elements": 4}]
    top = {"kind": "fixed", "position": [0.0, 0.0, -1.99]}
    scene = {"sea": {"depth": 40.0}, "cable": line | {"segments": segments, "marine_growth": table, "top": top}}
    rows, _ = said_of(scene, check)
    z = np.linspace(-30.0, -1.99, 8 * 2000 + 1)
    z = (z[1:] + z[:-1]) / 2
    columns = np.array(table).T
    thicker, heavier = (np.interp(z, columns[0], x).reshape(8, -1).mean(axis=1) for x in columns[1:])
    value, unit, remark = rows["marine growth adds in water"]
    assert remark == f"diameter times {thicker.max():.4g}, mass times {heavier.max():.4g} at most"
    area = math.pi * 0.05**2 / 4
    more = G * 3.5 * np.sum(15.0 * (heavier - 1) - RHO * area * (thicker**2 - 1))
    assert (value, unit) == (pytest.approx(more, rel=2e-3), "N")


def test_the_middle_of_the_anchors_whichever_way_lines_were_drawn():
    """Lines from buoy to anchor, or from anchor to buoy."""
    line = {"line_density": 9.0, "diameter": 0.05, "axial_stiffness": 1e6, "length": 40.0, "elements": 6}
    scene = {
        "sea": {"depth": 20.0},
        "cable": [
            line | {"name": "fore", "from": [30.0, 4.0, -20.0], "to": "buoy"},
            line | {"name": "aft", "from": "buoy", "to": [-26.0, 0.0, -20.0]},
        ],
        "buoy": {"hull": [[0, 2], [2, 2]], "mass": 1500.0},
        "current": {"speed": 0.5, "direction_deg": 90.0},
    }
    rows, _ = said_of(scene, check)
    x, y, z = solve_static(scene).buoy_position.values
    offset, unit, _ = rows["equilibrium: offset of C from the middle of its anchors"]
    assert (offset, unit) == (pytest.approx(math.hypot(x - 2.0, y - 2.0)), "m")
    assert rows["equilibrium: C above still water"][0] == pytest.approx(z)


def test_periods_of_a_line_with_growth():
    """m times the mass factor + C_A rho A times the squared diameter factor, with the remaining tension."""
    table = [[-60.0, 1.5, 1.2], [0.0, 1.5, 1.2]]
    line = {"length": 40.0, "line_density": 15.0, "diameter": 0.05, "axial_stiffness": 5e9, "added_mass": 0.8}
    line |= {"elements": 16, "marine_growth": table, "anchor": [0.0, 0.0, -50.0]}
    line["top"] = {"kind": "free", "force": [0.0, 0.0, 2e4]}
    report = check(load_scene({"sea": {"depth": 60.0}, "cable": line}))
    area = math.pi * 0.05**2 / 4
    w = G * (15.0 * 1.2 - RHO * area * 1.5**2)
    mass = 15.0 * 1.2 + 0.8 * RHO * area * 1.5**2
    travel = quad(lambda s: math.sqrt(mass / (2e4 - w * (40.0 - s))), 0, 40)[0]
    for n in (1, 2):
        assert report.periods[f"cable, transverse {n} (taut, fixed ends)"] == pytest.approx(2 * travel / n, rel=1e-3)


@pytest.mark.parametrize(("error", "inconsistent", "said"), [(0.019, 0.09, 0), (0.021, 0.09, 1), (0.019, 0.11, 1)])
def test_what_is_said_of_a_memory(monkeypatch, error, inconsistent, said):
    """An error of twice what is good enough, damping and added mass that differ by a tenth of the largest kernel."""
    scale = potential_flow.ENOUGH / 0.01
    states = SimpleNamespace(error=error * scale, order=6, inconsistent=inconsistent)
    monkeypatch.setattr(potential_flow, "states_of", lambda *_: (states, states))
    report = Report([])
    potential_flow._memory(None, SimpleNamespace(section=None), report)
    assert len(report.warnings) == 2 * said
    assert [row[:2] for row in report.numbers] == [
        ("states of the radiation memory of heave", 6.0),
        ("states of the radiation memory of a vertical plane", 6.0),
    ]
    word = f"{100 * error * scale:.2g} %" if error > 0.02 else f"{100 * inconsistent:.2g} %"
    assert all(word in sentence for sentence in report.warnings)


@pytest.mark.parametrize(("own", "said"), [(2.0, 1), (1.4, 0), (0.6, 1), (1.0, 0)])
def test_a_hull_that_is_no_cylinder(monkeypatch, own, said):
    """A draft of 1 m of the cylinder is 0.67 to 1.5 times that of the hull, or its share is told."""
    found = SimpleNamespace(cylinder=SimpleNamespace(draft=1.0, radius=1.0), draft=own)
    monkeypatch.setattr(waves, "estimate", lambda *_: found)
    buoy = {"hull": [[0.0, 3.0], [1.2, 3.0]], "mass": 3000.0, "center_of_mass": 0.6, "wave_damping": "radiation"}
    scene = load_scene({"sea": {"depth": 40.0}, "buoy": buoy})
    report = Report([])
    waves.of_shapes(scene, buoys_of(scene), report)
    words = [text for text in report.warnings if "The hull is no cylinder" in text]
    assert len(words) == said
    assert all(f"has {1 / own:.2g} of its draft" in text for text in words)

"""Design: expressions of keys and outputs, and numbers that minimise one of them within limits.

Source: optima and multipliers of a hanging line in closed form; Python's own arithmetic.
"""

import importlib
import math

import numpy as np
import pytest
import xarray as xr

import dolfbuoy
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.sensitivity import design
from dolfbuoy.sensitivity.derivatives import of_run
from dolfbuoy.sensitivity.expressions import Dual, Expression
from dolfbuoy.sensitivity.parameters import parameters_of

module = importlib.import_module("dolfbuoy.sensitivity.design")
HANGING = {  # at rest: the tension at its top is g (w L + m)
    "cable": {
        "length": 10.0,
        "line_density": 3.0,
        "axial_stiffness": 1e7,
        "elements": 3,
        "from": "weight",
        "to": [0, 0, 0],
    },
    "joint": [{"name": "weight", "mass": 30.0, "volume": 0.0}],
    "time": {"end": 0.4, "step": 0.1, "scheme": "bdf2"},
}
VARY = {"cable.line_density": (1.0, 9.0), "joint.weight.mass": (20.0, 60.0)}


@pytest.mark.parametrize(
    "text",
    ["a + b*2 - 3/a", "-(a - b)**2", "a**-1.5*b", "2e3*a - .5", "((a))/(b + 1)", "-a**2", "a - b - 1", "a/b/2", "a*-b"],
)
def test_values_and_slopes_are_those_of_python(text):
    names, at, step = ("a", "b"), np.array([1.7, 0.6]), 1e-6
    found = Expression(text, "--least").at(lambda n: Dual(at[names.index(n)], np.eye(2)[names.index(n)]), 2)

    def python(values):
        return eval(text, {}, dict(zip(names, values, strict=True)))  # texts of this test

    assert found.value == pytest.approx(python(at))
    slopes = [(python(at + step * e) - python(at - step * e)) / (2 * step) for e in np.eye(2)]
    assert found.slope == pytest.approx(slopes, rel=1e-6, abs=1e-8)


WRONG = [
    "",
    "a +",
    "(a",
    "a)",
    "a b",
    "a ** b",
    "f(a)",
    "a; b",
    "__import__('os')",
    "a.b()",
    "'a'",
    "a == b",
    "a[",
    "1e999*a",
    "(" * 40 + "a",
]


@pytest.mark.parametrize("text", [*WRONG, "a" * 2000])
def test_what_is_no_expression_is_refused(text):
    with pytest.raises(InputError, match=r"^--least .*\.$"):
        Expression(text, "--least").at(lambda n: Dual(1.0, np.zeros(1)) if n == "a" else _unknown(n), 1)


def _unknown(name):
    raise InputError(f"--least {name}: is unknown.")


def test_no_value():
    with pytest.raises(InputError, match="divides by zero"):
        Expression("1/(a - a)", "--least").at(lambda n: Dual(1.0, np.zeros(1)), 1)
    with pytest.raises(InputError, match="has no value here"):
        Expression("a**0.5", "--least").at(lambda n: Dual(-1.0, np.zeros(1)), 1)


@pytest.mark.parametrize("start", [2.0, 5.0, 8.0])
def test_lightest_line_that_pulls_enough(start):
    """g (w L + m) > 600 N with minimal w L + 2 m: minimal m and maximal w; a newton more costs 1/g."""
    found = design(
        HANGING,
        VARY,
        "cable.line_density*cable.length + 2*joint.weight.mass",
        ["tension_top.mean > 600"],
        cable__line_density=start,
    )
    w = (600 / 9.81 - 20.0) / 10
    assert found.dataset.value.values == pytest.approx([w, 20.0], rel=1e-5)
    assert found.dataset.attrs["least"] == pytest.approx(10 * w + 40, rel=1e-5)
    assert found.dataset.active.values.tolist() == [True]
    assert float(found.dataset.multiplier[0]) == pytest.approx(1 / 9.81, rel=1e-4)
    assert found.sentences == ["joint.weight.mass lies on its bound, 20."]
    again = dolfbuoy.simulate(found.scene)
    assert float(again.tension_top.mean()) >= 600 * (1 - 1e-4)


def test_a_line_that_is_nowhere_slack():
    """g (w L/6 + m), in the lowest of three elements, is kept above 400 N."""
    found = design(HANGING, {"joint.weight.mass": (20.0, 60.0)}, "joint.weight.mass", ["smallest_tension.min > 400"])
    assert float(found.dataset.value[0]) == pytest.approx(400 / 9.81 - 5.0, rel=1e-5)


STORM = {"current.speed": 1.5, "waves.amplitude": 0.9, "waves.period": 6.0}
STORM |= {"cable.elements": 36, "time.step": 0.04, "time.end": 25.0}


@pytest.mark.slow
def test_chain_and_sinker_of_a_navigation_buoy():
    """As heavy as a storm asks for: with less chain the sinker is pulled up by more, and both weigh more with more."""
    begin = {"cable.length": 32.0, "anchor.weight": 14e3}
    vary = {"cable.length": (20.0, 50.0), "anchor.weight": (3e3, 60e3)}
    hold = ["anchor_use.max < 0.8", "anchor_uplift.max < 100", "utilisation.max < 0.02"]
    least = "cable.line_density*cable.length + anchor.weight/9.81"
    found = design("navigation-buoy", vary, least, hold, **STORM, **begin)
    assert found.dataset.active.values.tolist() == [True, True, False]
    length, weight = found.dataset.value.values
    rows = []
    for more in (-1.0, 0.0, 1.0):  # runs of their own, without derivatives
        record = dolfbuoy.simulate("navigation-buoy", **STORM, **{"cable.length": length + more})
        late = record.isel(time=record.time.values >= 10.0 - 1e-9)
        needed = float(late.needed_weight.max()) / 0.8
        rows.append((float(late.anchor_uplift.max()), needed, 13.45 * (length + more) + needed / 9.81))
    (shorter, _, _), (uplift, needed, mass), (_, _, heavier) = rows
    assert (uplift, needed) == pytest.approx((100.0, weight), rel=2e-4)
    assert found.dataset.attrs["least"] == pytest.approx(mass, rel=1e-4)
    assert shorter > 150
    assert heavier > mass + 10


def test_limits_hold_in_all_load_cases():
    """The case with the larger gravity governs."""
    cases = [{}, {"gravity": 12.0}]
    found = design(
        HANGING, {"cable.line_density": (1.0, 9.0)}, "-cable.line_density", ["tension_top.mean < 700"], cases
    )
    assert float(found.dataset.value[0]) == pytest.approx((700 / 12.0 - 30.0) / 10, rel=1e-4)


def test_section_of_a_scene(call, tmp_path):
    """The scene contains what would otherwise be options."""
    section = {
        "vary": {"cable.line_density": [1.0, 9.0]},
        "least": "-cable.line_density",
        "hold": ["tension_top.mean < 700"],
        "case": ["gravity=9.81", "gravity=12;title=moon"],
    }
    dolfbuoy.load_scene(HANGING | {"design": section}).save(tmp_path / "scene.toml")
    assert call("design", tmp_path / "scene.toml", "--out", tmp_path / "out")[0] == 0
    found = xr.load_dataset(tmp_path / "out" / "design.nc")
    assert float(found.value[0]) == pytest.approx((700 / 12.0 - 30.0) / 10, rel=1e-4)
    again = design(HANGING | {"design": section}, hold=["tension_top.mean < 600"])
    assert float(again.dataset.value[0]) == pytest.approx((600 / 12.0 - 30.0) / 10, rel=1e-4)
    with pytest.raises(InputError, match="--least: must be given"):
        design(HANGING, VARY)
    with pytest.raises(InputError, match=r"design\.vary"):
        dolfbuoy.load_scene(HANGING | {"design": {"vary": {"cable.length": [1.0]}}})


def test_soft_maximum():
    """Its formula, and its derivative by central differences."""
    changes = {"time.end": 14.0, "time.step": 0.1, "time.scheme": "bdf2", "solver.step_tolerance": 1e-11}

    def soft(record):
        x = np.asarray(record.tension_top.values[record.time.values >= 10.0 - 1e-9, 0])
        return x.max() * (1 + np.log(np.mean(np.exp(60 * (x / x.max() - 1)))) / 60)

    scene = dolfbuoy.load_scene("short", **changes)
    found = module._soft(of_run(scene, parameters_of(scene, ["current.speed"])), "tension_top.soft_max", 10.0)
    assert found.value == pytest.approx(soft(dolfbuoy.simulate(scene)), rel=1e-9)
    low, high = (soft(dolfbuoy.simulate("short", **changes, **{"current.speed": 0.9 + x})) for x in (-9e-5, 9e-5))
    assert found.slope[0] == pytest.approx((high - low) / 1.8e-4, rel=1e-3)
    fitted = design(HANGING, {"cable.line_density": (1.0, 9.0)}, "-cable.line_density", ["tension_top.soft_max < 700"])
    assert float(fitted.dataset.value[0]) == pytest.approx((700 / 9.81 - 30.0) / 10, rel=1e-4)


@pytest.mark.slow
def test_what_cannot_be_kept():
    with pytest.raises(SolveError, match=r"Nothing was found that keeps tension_top\.mean > 5000"):
        design(HANGING, VARY, "cable.line_density", ["tension_top.mean > 5000"])


def chain_of(least, hold, high):
    """A design of the size of a hanging chain, from 11 mm up."""
    own = {key: value for key, value in HANGING["cable"].items() if key not in ("line_density", "axial_stiffness")}
    scene = {**HANGING, "cable": {**own, "material": "chain R3 studless 20 mm"}}
    name = "material.chain-R3-studless-20-mm"
    return design(scene, {f"{name}.size": (11.0, high)}, f"{least}{name}.line_density*cable.length", [hold])


@pytest.mark.parametrize(
    ("least", "hold", "size", "made"),
    [
        ("-", "tension_top.mean < 700", 14.416, 14.0),
        pytest.param("", "tension_top.mean > 700", 14.416, 16.0, marks=pytest.mark.slow),
    ],
)
def test_sizes_of_the_library(least, hold, size, made):
    """g (19.9e3 d^2 L + m) = 700 N at 14.4 mm, not a stock size: 14 mm keeps a tension below that, 16 mm above."""
    name = "chain-R3-studless-20-mm"
    found = chain_of(least, hold, 24.0)
    assert math.sqrt((700 / 9.81 - 30.0) / 10 / 19.9e3) * 1e3 == pytest.approx(size, abs=1e-3)
    assert found.dataset.value.values == pytest.approx([made])
    section = found.scene.network.pieces[0].section
    assert section.line_density == pytest.approx(19.9e3 * (made / 1e3) ** 2)
    assert section.breaking_load == pytest.approx(0.0223e3 * made**2 * (44 - 0.08 * made), rel=1e-9)
    assert found.scene.material[name].catalogue == f"chain R3 studless {made:g} mm"
    assert found.sentences == []


def test_a_size_beyond_the_bounds():
    """16 mm would suffice, but exceeds the bound of 15 mm."""
    found = chain_of("", "tension_top.mean > 700", 15.0)
    assert found.dataset.value.values == pytest.approx([14.416], abs=1e-3)
    assert len(found.sentences) == 1
    assert "no sizes that are made keep the limits within the bounds" in found.sentences[0]


def test_sizes_that_do_not_serve():
    scene = {**HANGING, "material": {"own": {"line_density": 3.0}}}
    with pytest.raises(InputError, match=r"--by material\.own\.size: is no number"):
        design(scene, {"material.own.size": (11.0, 24.0)}, "material.own.size")


def test_a_limit_within_its_error_bar():
    """The limit is the top tension of `driven` itself, with large steps: the error bar extends beyond it."""
    steps = {"time.end": 8.0, "time.step": 0.2, "cable.elements": 10}
    top = float(dolfbuoy.simulate("driven", cable__normal_drag=0.5, **steps).tension_top.max())
    found = design(
        "driven", {"cable.normal_drag": (0.5, 1.5)}, "cable.normal_drag", [f"tension_top.max < {1.001 * top}"], **steps
    )
    assert len(found.sentences) == 2
    assert "its error bar reaches beyond" in found.sentences[1]
    assert float(found.dataset.limit_bar[0]) > 0.001 * top


REFUSED = [
    (VARY, "cable.lenght", [], "is neither a number of this scene nor an output"),
    (VARY, "tension_top.max", ["tension_top.max"], "must have the form"),
    (VARY, "tension_top.max", ["tension_top.max < high"], "must have the form"),
    (VARY, "tension_top.max[port]", [], "is neither a number"),
    ({"cable.elements": (2, 9)}, "tension_top.max", [], "is not a physical number"),
    ({"cable.line_density": (4, 2)}, "tension_top.max", [], "--vary .*must be finite numbers that rise"),
    ({}, "tension_top.max", [], "--vary: must be given"),
    ({"cable.line_density": (1, 9)}, "joint.weight.mass", [], "nothing in it depends on what varies"),
]


@pytest.mark.parametrize(("vary", "least", "hold", "message"), REFUSED)
def test_refused(vary, least, hold, message):
    with pytest.raises(InputError, match=message):
        design(HANGING, vary, least, hold)


def test_command(call, tmp_path):
    scene = tmp_path / "scene.toml"
    dolfbuoy.load_scene(HANGING).save(scene)
    options = ["--vary", "cable.line_density=1..9", "--least", "cable.line_density", "--hold", "tension_top.mean>600"]
    code, out, _ = call(
        "design", scene, *options, "--out", tmp_path / "out", "--case", "gravity=9.81", "--case", "gravity=9.0;title=x"
    )
    assert code == 0
    w = (600 / 9.0 - 30.0) / 10
    assert float(xr.load_dataset(tmp_path / "out" / "design.nc").value[0]) == pytest.approx(w, rel=1e-4)
    for text in ("cable.line_density", f"{w:.3f}"[:4], "tension_top.mean>600", "designed.toml"):
        assert text in out
    best = dolfbuoy.load_scene(tmp_path / "out" / "designed.toml")
    assert math.isclose(best.network.pieces[0].section.line_density, w, rel_tol=1e-4)

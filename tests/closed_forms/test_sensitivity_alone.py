"""Parts of fits, designs and uncertainty studies, each alone: starting points, failed runs, closing messages.

Source: the same numbers by hand; made-up runs and search results.
"""

import importlib
import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import xarray as xr
from mpi4py import MPI

from dolfbuoy import load_scene
from dolfbuoy.accuracy.outputs import Output
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.sensitivity.calibration import LOST, Measured, _described, _Model, begin_of, inverse_of_squares
from dolfbuoy.sensitivity.expressions import Dual
from dolfbuoy.sensitivity.parameters import parameters_of
from dolfbuoy.sensitivity.uncertainty import Uncertain, _first, _of, _sampled, _terms, uncertainty
from dolfbuoy.sensitivity.uncertainty import _described as scattered

calibration, design, derivatives = (
    importlib.import_module(f"dolfbuoy.sensitivity.{name}") for name in ("calibration", "design", "derivatives")
)
INF = math.inf


# -- parameters -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "key", "distance", "near", "surely"),
    [
        ("short", "buoy.mass", 1e-4, 3e-6, False),
        ("short", "cable.length", 1e-4, 3e-6, False),
        ("short", "cable.axial_stiffness", 1e-3, 0.0, False),
        ("short", "buoy.hull.1.1", 1e-4, 0.0, False),
        ("short", "waves.amplitude", 1e-4, 3e-6, True),
        ("short", "waves.period", 1e-4, 1e-6, True),
        ("driven", "cable.top.amplitude.2", 1e-4, 3e-6, True),
        ("driven", "cable.top.amplitude", 1e-4, 3e-6, True),
        ("driven", "cable.top.period", 1e-4, 1e-6, True),
        ("chain-on-bed", "cable.length", 1e-6, 0.0, False),
        ("chain-on-bed", "cable.line_density", 1e-4, 1e-4, True),
        ("chain-on-bed", "cable.top.amplitude.2", 1e-6, 1e-5, True),
        ("chain-on-bed", "cable.top.amplitude", 1e-6, 1e-5, True),
        ("chain-on-bed", "cable.top.period", 1e-4, 1e-5, True),
        ("driven-slack", "cable.line_density", 1e-4, 1e-4, True),
        ("driven-slack", "cable.length", 1e-6, 0.0, False),
    ],
)
def test_distances_of_neighbours(name, key, distance, near, surely):
    """Of lengths nearer where a line may land or come taut; of what moves ends and waves, to one side."""
    (found,) = parameters_of(load_scene(name), [key])
    assert (found.distance, found.near, found.surely) == (distance, near, surely)


def test_scales_of_numbers():
    """The size of each; 1 of what is 0, and of a vector as a whole."""
    keys = ["cable.top.position.0", "cable.top.position.1", "cable.top.amplitude", "gravity"]
    top = {"kind": "prescribed", "position": [-4.0, 0.0, 20.0], "amplitude": [0.0, 0.0, 0.5], "period": 5.0}
    found = parameters_of(load_scene("driven", **{"cable.top": top}), keys)
    assert [(p.scale, math.isnan(p.value)) for p in found] == [(4.0, False), (1.0, False), (1.0, True), (9.81, False)]


CHAINED = {"length": 50.0, "material": "chain R3 studless 40 mm", "elements": 10}
CHAINED |= {"top": {"kind": "fixed", "position": [40.0, 0.0, -2.0]}}


def test_sizes_beside_those_that_are_made():
    """One step down from the smallest there is none, nor up from the largest."""
    (size,) = parameters_of(
        load_scene({"sea": {"depth": 20.0}, "cable": CHAINED}), ["material.chain-R3-studless-40-mm.size"]
    )
    made = [size.made(1.0, 1), size.made(1e3, -1)]
    assert -INF < made[0] < 40.0 < made[1] < INF
    assert [size.made(made[0], places) for places in (-1, 1)] == [-INF, made[0]]
    assert [size.made(made[1], places) for places in (1, 2, 3)] == [made[1], INF, INF]


# -- fits -------------------------------------------------------------------------------------------------------------


def test_where_a_search_begins():
    """At the scene's value within the bounds, else in the middle; on a bound is not within."""
    scene = load_scene("short", **{"buoy.mass": 1000.0, "cable.length": 21.0, "current.speed": 0.5})
    fit = {"buoy.mass": (900.0, 1300.0), "cable.length": (21.0, 25.0), "current.speed": (0.1, 0.5)}
    parameters, low, high, start = begin_of(scene, fit, "--fit")
    assert [p.key for p in parameters] == list(fit)
    np.testing.assert_array_equal([low, high, start], [[900, 21, 0.1], [1300, 25, 0.5], [1000, 23, 0.3]])
    for bounds in ((2.0, 2.0), (math.nan, 2.0), (1.0, INF), (-INF, 2.0)):
        with pytest.raises(InputError, match=r"^--fit buoy\.mass=.*: must be finite numbers that rise\.$"):
            begin_of(scene, {"buoy.mass": bounds}, "--fit")
    with pytest.raises(InputError, match=r"^--fit buoy\.inertia: is a vector; name its entries, buoy\.inertia\.0"):
        begin_of(scene, {"buoy.inertia": (1.0, 2.0)}, "--fit")


def test_squares_of_columns_in_any_units():
    """(J^T J)^-1; 0 where a column is."""
    J = np.array([[1.0, 0.0, 2e-9], [1.0, 0.0, -1e-9], [0.0, 0.0, 3e-9]])
    found = inverse_of_squares(J)
    (a, b, c) = 2.0, 14e-18, 1e-9
    np.testing.assert_allclose(found[np.ix_([0, 2], [0, 2])], np.array([[b, -c], [-c, a]]) / (a * b - c**2), rtol=1e-9)
    assert not found[1].any()
    assert not found[:, 1].any()


def fitted(J, x, noise=None, **given):
    """(dataset, sentences) of a made-up result of four samples."""
    parameters = [Fake(key=f"p{k}", value=float(k), unit="m") for k in range(J.shape[1])]
    series = [Measured("a", np.array([1.0, 2.0]), np.array([5.0, 6.0]), 2.0)]
    series += [Measured("b", np.array([3.0, 4.0]), np.array([7.0, 8.0]), 0.5)]
    found = Fake(jac=J, x=np.array(x), fun=np.array([1.0, -2.0, 4.0, 2.0]), cost=12.5, success=True)
    found.active_mask = np.zeros(len(x))
    vars(found).update(given)
    model = Fake(has_offset=False, parameters=parameters, measured=series, runs=7)
    return _described(model, found, None, None, noise)


def test_what_is_said_of_a_fit():
    """Bounds, numbers without effect, numbers that go together, and that it has not ended."""
    J = np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.1, 0.0], [1.0, 1.0, 0.0]])
    dataset, sentences = fitted(J, [1.0, 2.5, 3.0], active_mask=np.array([0, -1, 0]), success=False)
    r = -6 / math.sqrt(6 * 6.01)
    assert sentences == [
        "p1 lies on its bound, 2.5: the best value is beyond it.",
        f"p0 and p1 are not separable: their correlation is {r:.4f}.",
        "p2: nothing that was measured depends on it.",
        "The fit has not ended after 7 runs.",
    ]
    assert dataset.at_bound.values.tolist() == [False, True, False]
    assert dataset.correlation.values[0, 1] == pytest.approx(r)
    assert not dataset.correlation.values[2].any()
    np.testing.assert_array_equal(dataset.computed, [5 + 2.0, 6 - 4.0, 7 + 2.0, 8 + 1.0])
    assert dataset.series.values.tolist() == ["a", "a", "b", "b"]
    assert (dataset.attrs["runs"], dataset.attrs["residual"]) == (7, 2.5)
    assert fitted(J[:, :1], [1.0])[1] == []


def test_deviations_of_a_fit():
    """sqrt of the sum of squares over the free samples, or 1 where the noise is known, over the size of the column."""
    J = np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 3.0]])
    expected = np.array([1 / math.sqrt(3), 1 / 3])
    np.testing.assert_allclose(fitted(J, [1.0, 2.0])[0].deviation, math.sqrt(25 / 2) * expected, rtol=1e-12)
    np.testing.assert_allclose(fitted(J, [1.0, 2.0], noise=5.0)[0].deviation, expected, rtol=1e-12)


class Runs(_Model):
    """Of `short`, whose runs are made up: tension_top = 3 + t, with derivatives 2 and t^2."""

    def __init__(self, monkeypatch, measured, point=None, has_offset=False):
        keys = ["buoy.mass", "buoy.center_of_mass"]
        scene = load_scene("short")
        super().__init__(scene, parameters_of(scene, keys), measured, point, has_offset)
        self.seen, t = [], np.arange(5.0)

        def of_run(scene, parameters, comm):
            self.seen.append(scene.network.buoys["buoy"].mass)
            if self.seen[-1] > 1e5:
                raise SolveError("too heavy")
            return Fake(time=Fake(values=t))

        one = ("tension_top of cable", (3 + t, np.array([np.full(5, 2.0), t**2])))
        monkeypatch.setattr(calibration, "of_run", of_run)
        monkeypatch.setattr(calibration, "columns", lambda dataset: [one])


def test_residuals_of_a_run_and_their_slopes(monkeypatch):
    """Over what each is divided by, at the record's instants on the run's clock; a run is made once."""
    model = Runs(
        monkeypatch, [Measured("tension_top", np.array([1.5, 2.5]), np.array([1.0, 2.0]), 4.0)], has_offset=True
    )
    values = np.array([900.0, model.parameters[1].value, 0.5])
    np.testing.assert_allclose(model.residuals(values), [(4.0 - 1) / 4, (5.0 - 2) / 4], rtol=1e-14)
    np.testing.assert_allclose(model.jacobian(values), [[0.5, 0.25, -0.25], [0.5, 1.0, -0.25]], rtol=1e-14)
    assert (model.seen, model.runs) == ([pytest.approx(900.0)], 1)
    heavy = values + [1e6, 0.0, 0.0]
    np.testing.assert_array_equal(model.residuals(heavy), [LOST, LOST])
    np.testing.assert_array_equal(model.jacobian(heavy), np.zeros((2, 3)))
    assert (model.reason, model.runs) == ("too heavy", 2)
    with pytest.raises(InputError, match=r"^--of buoy_position_z: the run has tension_top of cable\.$"):
        Runs(monkeypatch, [Measured("buoy_position_z", np.ones(1), np.ones(1), 1.0)]).residuals(values[:2])


def test_accelerations_of_a_point_move_with_the_centre_of_mass(monkeypatch):
    """Of a buoy that turns about y: x = (z - z_C) sin(angle), whose slope by z_C is -sin(angle)."""
    model = Runs(monkeypatch, [], point=(0.0, 0.0, 5.0))
    t = np.linspace(0.0, 1.0, 6)
    angle, still = t**2, np.zeros((6, 1, 3))
    turned = np.column_stack([np.cos(angle / 2), 0 * t, np.sin(angle / 2), 0 * t])[:, None]
    axes = ("time", "buoy", "xyz"), ("time", "buoy", "quaternion")
    found = {"buoy_position": (axes[0], still), "buoy_orientation": (axes[1], turned)}
    found |= {f"d_{key}": (("parameter", *dims), np.stack([0 * x] * 2)) for key, (dims, x) in found.items()}
    record = xr.Dataset(found, {"time": t, "buoy": ["buoy"]})
    (x, slopes) = model._accelerations(model.base, model.parameters, record)["acceleration_x"]
    inner = np.diff(np.sin(angle), 2) / 0.2**2
    height = 5.0 - model.base.network.buoys["buoy"].center_of_mass
    np.testing.assert_allclose(x[1:-1], height * inner, rtol=1e-9)
    np.testing.assert_allclose(slopes[:, 1:-1], [0 * inner, -inner], atol=1e-7)


# -- designs ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "bound", "sign", "output"),
    [
        ("tension_top.max < 900", 900.0, 1.0, ("tension_top.max", "")),
        ("tension_top.min[port] >= 5", 5.0, -1.0, ("tension_top.min", "port")),
        ("2*tension_top.max <= 9e2", 900.0, 1.0, None),
        ("length > -3", -3.0, -1.0, None),
        ("cable.length + tension_top.max < 1", 1.0, 1.0, None),
    ],
)
def test_limits_are_read(text, bound, sign, output):
    found = design._limit(f"  {text} ")
    assert (found.text, found.bound, found.sign, found.output) == (text, bound, sign, output)


def searched(values, slopes=None, least=0.5, reason=""):
    """A search with the limits below, whose values and slopes are these wherever it is."""
    limits = [design._limit(text) for text in ("a.max < 100", "b.max > 50", "c.max < 0")]
    slopes = np.zeros((3, 3)) if slopes is None else slopes
    found = Dual(least, np.array([4.0, 0.0, 9.0])), [Dual(v, s) for v, s in zip(values, slopes, strict=True)]
    parameters = [Fake(key=key, unit="m") for key in "xyz"]
    return Fake(limits=limits, at=lambda x: found, parameters=parameters, least=Fake(text="x"), runs=3, reason=reason)


def test_room_that_limits_leave():
    """As a part of each; of a limit that is 0 as it is, in units too small to matter."""
    found = design._Search.room(searched([90.0, 60.0, 0.0]), None)
    np.testing.assert_allclose(found, [0.1, 0.2, 0.0], rtol=1e-14)
    assert design._Search.room(searched([110.0, 40.0, 1.0]), None)[2] < -1e299


def test_what_is_said_of_a_design():
    """Limits that are reached and their multipliers, numbers on either bound, and nothing of what lies between."""
    low, high = np.zeros(3), np.full(3, 10.0)
    search = searched([99.95, 60.0, -5.0], np.array([[-2.0, 5.0, 7.0], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0]]))
    dataset, sentences = design._described(search, np.array([5.0, 5e-6, 10.0]), np.ones(3), low, high)
    assert sentences == ["y lies on its bound, 5e-06.", "z lies on its bound, 10."]
    assert dataset.active.values.tolist() == [True, False, False]
    np.testing.assert_allclose(dataset.multiplier, [2.0, 0.0, 0.0], atol=1e-12)  # 4 - 2 x 2 = 0
    assert (dataset.attrs["least"], dataset.attrs["runs"], dataset.attrs["least_of"]) == (0.5, 3, "x")
    inside, said = design._described(search, np.array([5.0, 2e-5, 10.0 - 2e-5]), np.ones(3), low, high)
    assert said == []
    assert inside.limit_bound.values.tolist() == [100.0, 50.0, 0.0]
    for active in (99.9001, 100.0099):
        assert design._described(searched([active, 60.0, -5.0]), np.ones(3), np.ones(3), low, high)[0].active.values[0]
    assert not design._described(searched([99.89, 60.0, -5.0]), np.ones(3), np.ones(3), low, high)[
        0
    ].active.values.any()


@pytest.mark.parametrize(
    ("values", "more", "said"),
    [
        ([100.02, 60.0, -1.0], {}, "a.max < 100: the nearest has 100.02"),
        ([101.0, 48.0, -1.0], {}, "b.max > 50: the nearest has 48"),
        ([99.0, 60.0, -1.0], {"least": INF, "reason": "it sank"}, "a.max < 100: the nearest has 99"),
    ],
)
def test_a_limit_that_is_not_kept_is_named(values, more, said):
    """The one that is missed most; a hundredth of a per cent is let pass."""
    with pytest.raises(SolveError, match=f"^Nothing was found that keeps {said}"):
        design._described(searched(values, **more), np.ones(3), np.ones(3), np.zeros(3), np.full(3, 10.0))
    design._described(searched([100.009, 49.996, -1.0]), np.ones(3), np.ones(3), np.zeros(3), np.full(3, 10.0))


def test_the_worst_load_case_counts():
    """Of what is least the largest, of each limit the nearest, and of a case that fails the last that did not."""
    cases = iter([(9.0, [1.0, 7.0, 0.0]), (5.0, [2.0, 6.0, -1.0])])
    search = searched([0.0, 0.0, 0.0])
    search.cases, search._known, search.scene_at, search._last = [{}, {}], {}, lambda values: load_scene("short"), None
    made = lambda value: Dual(value, np.full(2, value))  # noqa: E731

    def of_case(scene, values):
        least, limits = next(cases)
        return made(least), [made(one) for one in limits]

    search._of_case = of_case
    least, limits = design._Search._computed(search, np.zeros(2))
    assert (least.value, [one.value for one in limits]) == (9.0, [2.0, 6.0, 0.0])
    assert search._last == (least, limits)

    def fails(scene, values):
        raise SolveError("it sank")

    search._of_case, search._lost = fails, lambda values: "lost"
    assert (design._Search._computed(search, np.zeros(2)), search.reason) == ("lost", "it sank")


@pytest.mark.parametrize(("std", "mean", "rests"), [(0.0, 0.0, True), (1e-2, -100.0, True), (1.01e-2, 100.0, False)])
def test_a_series_that_hardly_varies_rests(std, mean, rests):
    """Of the part that is asked for; by a ten-thousandth of its mean."""
    names, parts = ["a.std", "a.mean", "a.std", "b.std"], ["one", "one", "two", "one"]
    data = {"output": names, "output_of": parts, "bar_value": [std, mean, 50.0, 50.0]}
    record = xr.Dataset({name: ("output", values) for name, values in data.items()})
    assert design._rests(record, "a.max", "one") is rests
    assert not design._rests(record, "a.max", "two")


# -- scatter ----------------------------------------------------------------------------------------------------------

TOP = Output("tension_top", "max", "cable")


@pytest.mark.parametrize(("kind", "x"), [("normal", 0.3 * 1.5), ("lognormal", 4.0 * math.expm1(0.5 * 1.5 - 0.125) / 2)])
def test_changes_of_an_uncertain_number(kind, x):
    """In its scale, 2, at 1.5 standard deviations; a vector is varied by a factor about 1."""
    sigma = 0.6 if kind == "normal" else 4.0 * math.sqrt(math.expm1(0.25))
    one = Uncertain(Fake(value=4.0, scale=2.0), kind, sigma)
    np.testing.assert_allclose(one.x(np.array([1.5, 0.0]))[0], x, rtol=1e-12)
    vector = Uncertain(Fake(value=math.nan, scale=1.0), "lognormal", math.sqrt(math.expm1(0.25)))
    np.testing.assert_allclose(vector.x(np.array([1.5])), [math.expm1(0.5 * 1.5 - 0.125)], rtol=1e-12)
    uniform = Uncertain(Fake(value=4.0, scale=2.0), "uniform", 0.6)
    np.testing.assert_allclose(
        uniform.x(np.array([-40.0, 0.0, 40.0])), 0.3 * math.sqrt(3) * np.array([-1, 0, 1]), atol=1e-15
    )


def test_scatter_from_derivatives():
    """sqrt of the sum of (slope sigma)^2, 5 % beyond 1.6449 of it; R^2 of runs that a line does not know."""
    numbers = [
        Uncertain(Fake(value=1.0, scale=2.0), "normal", 0.3),
        Uncertain(Fake(value=1.0, scale=1.0), "normal", 0.4),
    ]
    slopes = xr.Dataset(
        {"d_output": (("parameter", "output"), [[9.0, 10.0], [9.0, 10.0]]), "output_value": ("output", [1.0, 7.0])},
        {"output": ["tension_top.max"] * 2, "output_of": ("output", ["other", "cable"])},
    )
    xi = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    y = 7 + np.array([3.0, 4.0, -3.0, -4.0]) + np.array([1.0, 0.0, 0.0, 0.0])
    row, share = _first(numbers, slopes, TOP, xi, y)
    assert row == pytest.approx((7.0, 5.0, 7 - 8.2245, 7 + 8.2245, 1 - 1 / (16 + 16 + 9 + 16)), rel=1e-12)
    np.testing.assert_allclose(share, [9 / 25, 16 / 25], rtol=1e-12)


def test_scatter_of_samples():
    """Shares are squares of correlations."""
    xi = np.array([[-1.0, 1.0], [1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    row, share = _sampled(xi, 5 + 3 * xi[:, 0] + 4 * xi[:, 1])
    assert row[:4] == pytest.approx((5.0, math.sqrt(100 / 3), *np.percentile([-2, 4, 6, 12], [5, 95])), rel=1e-12)
    assert math.isnan(row[4])
    np.testing.assert_allclose(share, [9 / 25, 16 / 25], rtol=1e-12)
    assert _terms(2) == [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]


def test_a_tenth_of_the_runs_may_fail():
    """Their outputs are no numbers; usual ones are looked at, or those that were asked for."""
    outputs = [["tension_top", "max", "cable", 5.0], ["buoy_position", "mean", "z", 1.0]]
    good, other, bad = {"outputs": outputs}, {"outputs": [[*outputs[0][:3], 14.0]]}, {"failed": "it sank"}
    found = _of([*[good] * 8, other, bad], None)
    assert list(found) == [TOP]
    np.testing.assert_array_equal(found[TOP], [5.0] * 8 + [14.0, np.nan])
    assert list(_of([good], ["buoy_position.mean"])) == [Output("buoy_position", "mean", "z")]
    with pytest.raises(SolveError, match=r"^2 of 19 runs failed: it sank$"):
        _of([good] * 17 + [bad] * 2, None)
    with pytest.raises(InputError, match=r"^--of: this scene has none of lean\.max\.$"):
        _of([good], ["lean.max"])
    numbers = [Fake(parameter=Fake(key="buoy.mass"))]
    dataset = scattered(load_scene("short"), numbers, found, np.linspace(-1.0, 1.0, 10)[:, None] ** 3, "samples", None)
    assert (dataset.attrs["failed"], dataset.attrs["runs"], float(dataset["mean"][0])) == (1, 10, 6.0)


@pytest.mark.parametrize(("method", "least"), [("first", 2), ("chaos", 8), ("samples", 4)])
def test_least_numbers_of_runs(method, least):
    """Of an expansion in two numbers two more than it has terms."""
    scene = load_scene("short", uncertain={"buoy.mass": "5%", "cable.length": "1%"})
    with pytest.raises(InputError, match=f"^--runs {least - 1}: must be at least {least} here"):
        uncertainty(scene, method, least - 1)


# -- derivatives ------------------------------------------------------------------------------------------------------


def test_notes_are_the_same_in_parts(monkeypatch):
    """However many instants are noted before quantities are made of them; each step is told."""
    changes = {"time.end": 0.5, "time.step": 0.1, "cable.elements": 4, "time.tolerance": None}
    scene, told, asked = load_scene("driven", **changes), [], []
    monkeypatch.setattr(derivatives.interruption, "check", lambda: asked.append(0))
    parameters = parameters_of(scene, ["cable.line_density"])
    whole = derivatives.of_run(scene, parameters, MPI.COMM_SELF, lambda run: told.append(round(run.t, 9)))
    monkeypatch.setattr(derivatives, "ROWS", 2)
    assert derivatives.of_run(scene, parameters, MPI.COMM_SELF).equals(whole)
    np.testing.assert_allclose(told, [0.1, 0.2, 0.3, 0.4, 0.5])
    assert len(asked) == 10  # whether somebody wants it to end

"""Derivatives of runs and equilibria with respect to numbers of their scenes.

Source: central differences of whole runs with the same steps; closed forms at rest; digits of a separate program;
dimensional analysis.
"""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from dynamics_helpers import MOORED, merged
from mpi_helpers import needs_mpirun, start_scenes

import dolfbuoy
from dolfbuoy.accuracy.outputs import numbers_of, series_after
from dolfbuoy.errors import InputError
from dolfbuoy.motion.simulation import Simulation
from dolfbuoy.motion.tangent import Tangents
from dolfbuoy.results.quantities import QUANTITIES
from dolfbuoy.results.series import Series
from dolfbuoy.sensitivity.derivatives import _outputs, of_equilibrium, of_run
from dolfbuoy.sensitivity.parameters import parameters_of

TIME = {"end": 0.8, "step": 0.02, "scheme": "bdf2"}
SHORT = merged(MOORED, cable__elements=5, waves__ramp=0.2, time=TIME, solver={"step_tolerance": 1e-11})
TOP = {"kind": "prescribed", "position": [22.0, 3.0, -2.0], "amplitude": [0.8, 0.5, 1.5], "period": 3.0, "ramp": 0.3}
ON_BED = {
    "sea": {"depth": 20.0},
    "cable": merged(MOORED["cable"], length=40.0, elements=9, top=TOP, slack="tension-only", damping=1e4),
    "seabed": {"friction": 0.6},
    "time": TIME | {"end": 0.6},
    "solver": {"step_tolerance": 1e-11},
}
HULL = {**MOORED["buoy"], "fairleads": {"side": [1.0, 0.0, 0.2]}}
LINE = {**MOORED["cable"], "axial_stiffness": 1e6, "elements": 3}
NETWORK = {
    "sea": MOORED["sea"],
    "current": MOORED["current"],
    "waves": merged(MOORED["waves"], ramp=0.2),
    "joint": [{"name": "clump", "mass": 300.0, "volume": 0.02, "drag_area": 0.1}],
    "buoy": [{**HULL, "name": "left"}, {**HULL, "name": "right"}],
    "cable": [
        {**LINE, "name": "west", "from": [-10.0, 0.0, -20.0], "to": "left", "length": 26.0},
        {**LINE, "name": "east", "from": [16.0, 3.0, -20.0], "to": "right", "length": 30.0},
        {**LINE, "name": "port", "from": "left.side", "to": "clump", "length": 24.0},
        {**LINE, "name": "starboard", "from": "clump", "to": "right", "length": 24.0},
    ],
    "time": TIME,
    "solver": {"step_tolerance": 1e-11},
}
SEA = {
    "waves": {"spectrum": "jonswap", "significant_height": 1.5, "peak_period": 5.0, "ramp": 0.2, "kinematics": "exact"}
}
CASES = {
    "backward Euler": (merged(SHORT, time__scheme="backward-euler"), "cable.normal_drag,buoy.mass,waves.amplitude"),
    "BDF2": (SHORT, "sea.depth,waves.period,buoy.hull.1.1,current.speed,cable.diameter"),
    "bending": (
        merged(SHORT, cable={"bending_stiffness": 1e5, "to_end": {"direction": [0.1, 0.0, 1.0]}}),
        "cable.bending_stiffness,cable.to_end.direction.0",
    ),
    "generalized-alpha": (merged(SHORT, time__scheme="generalized-alpha"), "cable.length,buoy.normal_drag"),
    "inextensible, degree 2": (
        merged(SHORT, cable={"axial_stiffness": float("inf"), "position_degree": 2, "tension_degree": 1}),
        "cable.line_density,buoy.center_of_mass",
    ),
    "irregular sea": (merged(SHORT, waves=None) | SEA, "waves.significant_height"),
    "thrown": (
        merged(SHORT, initial={"buoy_angular_velocity": [0.1, -0.2, 0.3], "buoy_velocity": [0.2, 0.1, 0.0]}),
        "buoy.mass,cable.length",
    ),
    "free buoy": (
        {name: SHORT[name] for name in ("sea", "buoy", "waves", "time", "solver")},
        "buoy.mass,waves.amplitude",
    ),
    "network": (NETWORK, "cable.port.length,joint.clump.mass,buoy.left.mass,cable.east.from.0"),
    "on a bed": (ON_BED, "cable.line_density,seabed.friction,cable.top.amplitude.2,cable.top.period"),
    "adaptive": (merged(SHORT, time__tolerance=1e-2), "buoy.mass,current.speed"),
}


def series(simulation):
    """The quantities compared: unknowns and end forces."""
    return np.concatenate([simulation.system.u, *(f.ravel() for f in simulation.latest_end_forces.values())])


def difference(scene, parameter, steps, eps):
    """Derivatives from central differences of two runs with these steps and restarts, (steps, numbers)."""
    below, above = (Simulation(parameter.scene_at(scene, x)) for x in (-eps, eps))
    rows = []
    for h, begins_anew in steps:
        for one in (below, above):
            if begins_anew:
                one.past.forget()
            one.step(h)
        rows.append((series(above) - series(below)) / (2 * eps))
    return np.array(rows)


def derivative(scene, parameter):
    """Steps of a run, with restarts of the history, and its derivatives."""
    run = Simulation(scene)
    tangents = Tangents(run, [parameter], Simulation)
    (pair,) = tangents.pairs
    anew, steps, rows = [], [], []
    run.followers.append(lambda: anew.append(run.past.series[0].steps_since_start == 0))
    for h, _ in run.run():
        assert not tangents.fault
        steps.append(h)
        rows.append((series(pair.near) - series(pair.other)) / pair.apart)
    return list(zip(steps, anew, strict=True)), np.array(rows)


@pytest.mark.parametrize("name", [n if n != "network" else pytest.param(n, marks=pytest.mark.slow) for n in CASES])
def test_as_central_differences(name):
    """Positions, orientations, momenta, tensions and forces, each relative to its largest derivative."""
    data, by = CASES[name]
    scene = dolfbuoy.load_scene(data)
    for parameter in parameters_of(scene, by.split(",")):
        steps, found = derivative(scene, parameter)
        expected = difference(scene, parameter, steps, 1e-3 if name == "thrown" else 1e-4)
        if name == "thrown":  # rounding of the tiny steps that make the start consistent is in the first forces
            found, expected = found[5:], expected[5:]
        size = np.abs(expected).max(axis=0)
        counts = size > 1e-6 * size.max()
        assert counts.any()
        assert (np.abs(found - expected).max(axis=0)[counts] <= 3e-3 * size[counts] + 1e-7 * size.max()).all(), (
            parameter.key
        )


@pytest.mark.parametrize("changes", [{}, {"solver.keep_jacobian": True, "solver.step_tolerance": 1e-4}])
def test_nothing_of_the_run_changes(changes):
    scene = dolfbuoy.load_scene(SHORT, **changes)
    plain, followed = dolfbuoy.simulate(scene), of_run(scene, parameters_of(scene, ["buoy.mass"]))
    assert np.array_equal(followed.tension_top, plain.tension_top)
    assert np.array_equal(followed.buoy_position, plain.buoy_position)


@pytest.mark.parametrize("name", [pytest.param("network", marks=pytest.mark.slow), "on a bed"])
def test_one_matrix_for_all(name):
    """Derivatives with respect to several numbers share one matrix, and equal those of each alone (5e-5 measured)."""
    scene = dolfbuoy.load_scene(CASES[name][0])
    parameters = parameters_of(scene, CASES[name][1].split(",")[:3])
    shared = of_run(scene, parameters)
    for k, one in enumerate(parameters):
        alone = of_run(scene, [one])
        for series in ("d_tension_top", "d_anchor_force", "d_end_tension"):
            size = np.abs(alone[series].values).max()
            assert np.abs(shared[series].values[k] - alone[series].values[0]).max() <= 2e-4 * size, (one.key, series)


@pytest.mark.parametrize("keep", [False, True])
def test_whose_matrix(keep):
    """The run lends its matrix in steps where it computed one; otherwise the neighbour computes its own."""
    scene = dolfbuoy.load_scene(SHORT, **{"solver.keep_jacobian": keep, "solver.step_tolerance": 1e-6})
    run = Simulation(scene)
    tangents = Tangents(run, parameters_of(scene, ["buoy.mass"]), Simulation)
    lender, own = run.newton.numbers, tangents.solver.numbers
    made, begin, kept = lender.jacobians_total, own.jacobians_total, 0
    for _ in run.run():
        kept += lender.jacobians_total == made
        made = lender.jacobians_total
    assert not tangents.fault
    assert own.jacobians_total - begin == kept
    assert (kept > 0) == keep


def test_derivatives_that_are_rounding():
    """Before anything moves drag has no effect, and increments are as large as its derivative."""
    scene = dolfbuoy.load_scene("driven", **{"time.end": 0.2})
    assert np.abs(of_run(scene, parameters_of(scene, ["cable.normal_drag"])).d_tension_top.values).max() < 1.0


#: scene, keys, number, from when on [s], and derivatives of the largest and the last tension at the top.
DIGITS = [
    (
        "driven",
        {"time.end": 20.0, "time.step": 0.05, "time.scheme": "bdf2", "cable.elements": 20},
        "cable.normal_drag",
        12.0,
        (3040.461, 1808.8143),
    ),
    (
        "driven",
        {"time.end": 20.0, "time.step": 0.05, "time.scheme": "bdf2", "cable.elements": 20},
        "cable.axial_stiffness",
        12.0,
        (9.965e-9, 5.5529e-9),
    ),
    (
        "short",
        {"time.end": 20.0, "time.step": 0.1, "time.scheme": "bdf2", "cable.elements": 10},
        "sea.depth",
        12.0,
        (1133.2, 275.927),
    ),
    ("three-legs", {"time.end": 20.0, "time.step": 0.1}, "material.rope.normal_drag", 10.0, (-143.2456, -294.6977)),
]


@pytest.mark.parametrize(("name", "changes", "key", "begin", "expected"), DIGITS)
def test_digits_of_a_separate_program(name, changes, key, begin, expected):
    """Common digits of central differences of whole runs with three increments."""
    changes = changes | {"solver.step_tolerance": 1e-11}
    if name == "driven":
        changes |= {"cable.position_degree": 1, "cable.tension_degree": 0}
    found = dolfbuoy.sensitivities(name, [key], ["tension_top.max"], **changes)
    late = found.time.values >= begin - 1e-9
    tension, slope = found.tension_top.values[late, 0], found.d_tension_top.values[0, late, 0]
    assert [slope[tension.argmax()], slope[-1]] == pytest.approx(expected, rel=1e-3)


#: scene, number, index of the line, derivative of the tension at the top at rest.
AT_REST = [
    ("chain-on-bed", "cable.line_density", 0, 2041.1535206584922),
    ("short", "current.speed", 0, 1922.2889),
    ("three-legs", "buoy.mass", 0, -0.1106742775),
]


@pytest.mark.parametrize(("name", "key", "line", "expected"), AT_REST)
def test_digits_at_rest(name, key, line, expected):
    found = dolfbuoy.sensitivities(name, [key], what="static")
    assert found.d_tension_top.values[0, line] == pytest.approx(expected, rel=1e-5)


@pytest.mark.slow
def test_periods():
    """The same modes in neighbouring scenes, 1 % apart; a heavier hull heaves more slowly."""
    found = dolfbuoy.sensitivities("short", ["buoy.mass"], what="modes")
    low, high = (dolfbuoy.modes("short", 10, **{"buoy.mass": m}).period.values for m in (396.0, 404.0))
    oscillates = np.isfinite(found.period.values)
    assert found.d_period.values[0][oscillates] == pytest.approx(((high - low) / 8)[oscillates], rel=0.02, abs=1e-8)


def test_response():
    """The same response in neighbouring scenes, 0.1 % apart."""
    found = dolfbuoy.sensitivities("short", ["buoy.mass"], what="response")
    low, high = (dolfbuoy.response("short", found.period.values, **{"buoy.mass": m}).rao.values for m in (399.6, 400.4))
    size = np.abs(found.d_rao.values).max()
    assert np.abs(found.d_rao.values[0] - (high - low) / 0.8).max() < 1e-3 * size


@pytest.mark.slow
def test_tornado_of_short_by_dimensions():
    """Scaling masses, densities, stiffnesses and forces scales all forces and keeps angles (Buckingham's Pi)."""
    changes = {"time.end": 14.0, "time.step": 0.1, "time.scheme": "bdf2", "cable.elements": 8}
    scene = dolfbuoy.load_scene("short", **changes)
    with_mass = [
        one.key
        for one in parameters_of(scene)
        if "kg" in one.unit or one.unit == "N" or one.key in ("buoy.inertia", "external_force.force")
    ]
    assert len(with_mass) == 9
    elasticity = dolfbuoy.sensitivities(scene, with_mass).elasticity
    for output in ("tension_top.max", "tension_top.mean", "anchor.max"):
        assert float(elasticity.sel(output=output).sum()) == pytest.approx(1.0, abs=1e-4)
    for output in ("cone_angle.max", "cone_angle.mean"):
        assert np.abs(elasticity.sel(output=output)).max() > 0.3
        assert float(elasticity.sel(output=output).sum()) == pytest.approx(0.0, abs=1e-4)


def test_outputs_are_those_of_runs():
    """Largest, smallest, mean and standard deviation, per unit and per cent, against neighbouring runs."""
    changes = {"time.end": 14.0, "time.step": 0.1, "time.scheme": "bdf2", "solver.step_tolerance": 1e-11}
    names = [f"tension_top.{n}" for n in ("max", "min", "mean", "std")]
    found = dolfbuoy.sensitivities("short", ["current.speed"], names, **changes)
    assert found.output.values.tolist() == names
    record = [dolfbuoy.simulate("short", **changes, **{"current.speed": v}) for v in (0.9 - 9e-5, 0.9 + 9e-5)]
    low, high = (numbers_of(series_after(r, 10.0)["tension_top", "cable"]) for r in record)
    expected = np.array([(high[n] - low[n]) / 1.8e-4 for n in ("max", "min", "mean", "std")])
    assert found.d_output.values[0] == pytest.approx(expected, rel=2e-4)
    assert found.elasticity.values[0] == pytest.approx(expected * 0.9 / found.output_value.values, rel=2e-4)


def test_the_smallest_tension_along_a_line():
    """As extremes of runs of neighbours have it: what is least stays least, so that only its own tension counts."""
    changes = {"time.end": 14.0, "time.step": 0.1, "time.scheme": "bdf2", "solver.step_tolerance": 1e-11}
    found = dolfbuoy.sensitivities("short", ["current.speed"], ["smallest_tension.min"], **changes)
    assert found.output.values.tolist() == ["smallest_tension.min"]
    low, here, high = (
        dolfbuoy.simulate("short", **changes, **{"current.speed": v}).cable_tension_minimum_after_ramp.values.min()
        for v in (0.9 - 9e-5, 0.9, 0.9 + 9e-5)
    )
    late = found.isel(time=found.time.values >= 10 - 1e-9, cable=0)
    row = int(late.smallest_tension.values.argmin())
    assert late.smallest_tension.values[row] == pytest.approx(here, rel=1e-9)
    assert late.d_smallest_tension.values[0, row] == pytest.approx((high - low) / 1.8e-4, rel=2e-4)
    of_series = series_after(found[["smallest_tension"]], 10.0)["smallest_tension", "cable"]
    assert found.output_value.item() == numbers_of(of_series)["min"] == pytest.approx(here, rel=1e-2)
    assert found.d_output.item() == pytest.approx((high - low) / 1.8e-4, rel=5e-2)


def test_numbers_that_have_no_bars():
    """The level exceeded by a force for 1 s, and the lean at rest, against neighbouring runs."""
    changes = {"time.end": 14.0, "time.step": 0.1, "time.scheme": "bdf2", "solver.step_tolerance": 1e-11}
    names = ["tension_top.lasting", "lean_at_start.max"]
    found = dolfbuoy.sensitivities("short", ["current.speed"], names, **changes)
    assert found.output.values.tolist() == names
    low, here, high = (
        [record.tension_top.values, record.lean_at_start.item(), record.time.values]
        for v in (0.9 - 9e-5, 0.9, 0.9 + 9e-5)
        for record in [dolfbuoy.simulate("short", **changes, **{"current.speed": v})]
    )
    levels = [Series("", t[t > 9.99], x[t > 9.99, 0]).lasting_maximum for x, _, t in (low, here, high)]
    assert found.output_value.values == pytest.approx([levels[1], here[1]], rel=1e-7)
    assert found.d_lean_at_start.values[0, 0] == pytest.approx(found.d_output.values[0, 1], rel=1e-8)
    expected = [levels[2] - levels[0], high[1] - low[1]]
    assert found.d_output.values[0] == pytest.approx(np.array(expected) / 1.8e-4, rel=2e-3)


def test_what_is_only_rounding_has_no_elasticity():
    """The tension of a slack line is zero to rounding: a per cent of it is meaningless."""
    time, half = np.linspace(0.0, 1.0, 11), np.array([0.5])
    runs = [{"smallest_tension": 900 * np.abs(time - 0.5)[:, None] + tiny} for tiny in (3e-14, 1e-14, 5e-14)]
    attributes = QUANTITIES["smallest_tension"].attributes()
    data = {"smallest_tension": (("time", "cable"), runs[0]["smallest_tension"], attributes)}
    base = xr.Dataset(data, {"time": time, "cable": ["line"], "parameter": ["cable.length"]})
    scene = dolfbuoy.load_scene("driven", cable__top__ramp=0.0, time__end=1.0)
    found = _outputs(scene, [SimpleNamespace(value=20.0)], base, [runs[1:]], half)
    values = dict(zip(found.output.values, found.elasticity.values[0], strict=True))
    assert np.isnan(values["smallest_tension.min"])
    assert abs(values["smallest_tension.max"]) < 1e-12


def test_the_smallest_tension_of_each_line_at_rest():
    parameters = parameters_of(scene := dolfbuoy.load_scene("three-legs"), ["buoy.mass"])
    found, record = of_equilibrium(scene, parameters), dolfbuoy.solve_static("three-legs")
    tensions, cables = record.cable_tension.values.ravel(), record.cable_of_cell.values
    expected = [tensions[cables == k].min() for k in range(3)]
    assert found.smallest_tension.values == pytest.approx(expected, rel=1e-9)


REFUSED = [
    (["cable.elements"], "is not a physical number"),
    (["time.step"], r"belongs to \[time\]"),
    (["waves.seed"], "is not a physical number"),
    (["cable.lenght"], "is no number of this scene; near it are cable.length, "),
    (["buoy.hull.9.1"], "has no such entry"),
    (["buoy.hull.1"], "name one of its entries"),
    (["buoy.rotational_added_mass"], "its neighbours are no scenes"),
]


@pytest.mark.parametrize(("by", "message"), REFUSED)
def test_refused(by, message):
    with pytest.raises(InputError, match=message):
        dolfbuoy.sensitivities(SHORT, by)


def test_refused_of_a_line_that_parts():
    with pytest.raises(InputError, match="across the instant in which a line parts"):
        dolfbuoy.sensitivities(merged(SHORT, cable__fails_at={"time": 0.2}), ["buoy.mass"])


RANKS = """
import json, sys
import dolfbuoy

for name, (scene, by) in json.load(open(sys.argv[1])).items():
    dolfbuoy.sensitivities(scene, by, out=name)
"""


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_two_ranks(tmp_path):
    """The same derivatives as on one rank, to 1e-5 of the largest of each series."""
    scenes = {"network": (NETWORK, ["joint.clump.mass"]), "bed": (ON_BED, ["cable.line_density"])}
    done = start_scenes(2, scenes, tmp_path, RANKS)
    assert done.returncode == 0, (done.returncode, done.stdout[-1000:], done.stderr[-2000:])
    for name, (scene, by) in scenes.items():
        alone, together = dolfbuoy.sensitivities(scene, by), xr.open_dataset(tmp_path / name / "sensitivity.nc")
        for series in ("d_tension_top", "d_end_tension", "d_tension_anchor"):
            size = np.abs(alone[series].values).max()
            assert np.abs(alone[series].values - together[series].values).max() <= 1e-5 * size, (name, series)


def test_command(call, tmp_path):
    """Table, record and figure."""
    where = ["--out", tmp_path, "--set", "time.end=12", "--set", "time.step=0.1"]
    code, out, _ = call("sensitivity", "short", "--by", "buoy.mass,current.speed", *where)
    assert code == 0
    for text in ("current.speed", "buoy.mass", "400 kg", "tension_top.max", "cone_angle.max"):
        assert text in out
    found = xr.load_dataset(tmp_path / "sensitivity.nc")
    assert found.parameter.values.tolist() == ["buoy.mass", "current.speed"]
    assert f"{found.elasticity.sel(output='tension_top.max').values[0]:+.4f}" in out
    assert (tmp_path / "figures" / "tornado.png").stat().st_size > 10_000
    for options in (["--static"], ["--modes"], ["--response"]):
        assert call("sensitivity", "short", "--by", "buoy.mass", "--no-plot", "--out", tmp_path, *options)[0] == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--all", "--by", "buoy.mass"], "--all: does not go with --by."),
        (["--static", "--modes"], "--static: does not go with --modes."),
        (["--by", "buoy.mass,"], "--by buoy.mass,: there is an empty name"),
        (
            ["--by", "buoy.mass", "--of", "tension_top.peak"],
            "--of tension_top.peak: must be an output of this scene, SERIES.NUMBER as tension_top.max; near it are",
        ),
        (
            ["--by", "buoy.mass", "--set", "time.end=0.2", "--of", "utilisation.max"],
            "--of utilisation.max: is of what this scene does not have, as utilisation without a breaking load.",
        ),
        (["--by", "buoy.mass", "--of", "smallest.min"], "--of smallest.min: must be an output"),
        (["--static", "--of", "tension_top.max"], "--of: goes with the outputs of a run."),
    ],
)
def test_command_refuses(call, options, message, tmp_path):
    code, _, err = call("sensitivity", "short", "--out", tmp_path, *options)
    assert code == 2
    assert message in " ".join(err.split())


def test_hanging_line_in_closed_form():
    """Tension w z + W of a line with a weight at its end; its length grows by (W L + w L^2/2)/EA."""
    length, w, load, ea = 10.0, 5.0, 200.0, 2e4
    line = {"length": length, "line_density": w / 9.81, "axial_stiffness": ea, "elements": 8, "strain_form": "energy"}
    scene = dolfbuoy.load_scene(
        {
            "cable": [{**line, "name": "line", "from": "weight", "to": [0.0, 0.0, 0.0]}],
            "joint": [{"name": "weight", "mass": load / 9.81, "volume": 0.0}],
        }
    )
    found = of_equilibrium(
        scene, parameters_of(scene, ["joint.weight.mass", "cable.line_density", "cable.axial_stiffness"])
    )
    slope = found.d_tension_top.values[:, 0]
    assert slope[:2] == pytest.approx([9.81, 9.81 * length], rel=1e-7)
    assert abs(slope[2]) < 1e-9
    drop = found.d_joint_position.sel(xyz="z").values[:, 0]
    grown = (load * length + w * length**2 / 2) / ea
    assert drop == pytest.approx([-9.81 * length / ea, -9.81 * length**2 / 2 / ea, grown / ea], rel=1e-6)

"""The same trajectory on two and three ranks as on one, to 1e-8 of the size of each quantity.

Source: the same run on one rank.
"""

import numpy as np
import pytest
from dynamics_helpers import DRAGGED, MOORED, merged
from helpers import REFERENCE
from mpi_helpers import needs_mpirun, start_scenes

import dolfbuoy
from dolfbuoy.results.record import read
from dolfbuoy.scene.buoy import HAS_THEM

pytestmark = [pytest.mark.mpi, needs_mpirun]


MOVING = merged(MOORED, waves__ramp=0.2, waves__direction_deg=30.0, time={"end": 0.3, "step": 0.01})
DRIVEN = {
    "kind": "prescribed",
    "position": [29.0, 3.0, -2.0],
    "amplitude": [0.8, 0.5, 1.5],
    "period": 3.0,
    "phase_deg": [20.0, -40.0, 0.0],
    "ramp": 0.3,
}
SCENES = {
    "moored buoy": MOVING,
    "moored buoy on an inextensible cable of degree 2": merged(
        MOVING,
        cable__axial_stiffness=None,
        cable__position_degree=2,
        cable__tension_degree=1,
        cable__elements=5,
        time__output_every=0.05,
    ),
    "moored buoy whose factors the ranks share": merged(
        MOVING, solver={"petsc": {"pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}}
    ),
    "buoy that makes waves": merged(
        MOVING,
        **dict.fromkeys((f"buoy__{name}" for name in HAS_THEM), None),
        buoy__potential_flow=str(REFERENCE / "truncated_cylinder.nc"),
    ),
    "driven top": {
        "sea": MOORED["sea"],
        "cable": merged(
            MOORED["cable"],
            elements=7,
            top={
                "kind": "prescribed",
                "position": [12.0, 0.5, -3.5],
                "amplitude": [0.1, 0.2, 1.5],
                "period": 5.0,
                "ramp": 1.0,
            },
        ),
        "time": {"end": 0.3, "step": 0.01},
    },
    "free end": {
        "cable": {"length": 3.0, "line_density": 2.0, "elements": 4, "top": {"kind": "free", "force": [1.0, 2.0, 0.0]}},
        "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [1.8, 0.0, -2.4]]},
        "time": {"end": 0.3, "step": 0.01},
    },
    "slack cable that falls and comes taut": {
        "cable": {
            "length": 3.0,
            "line_density": 2.0,
            "axial_stiffness": 1e5,
            "elements": 5,
            "slack": "tension-only",
            "damping": 50.0,
            "top": {"kind": "free"},
        },
        "initial": {"kind": "polyline", "points": [[0.0, 0.0, 0.0], [1.5, 0.0, -2.0]]},
        "time": {"end": 0.4, "step": 0.01},
    },
    "line on a sloping bed": {
        "sea": {"depth": 20.0},
        "cable": merged(
            MOORED["cable"],
            length=40.0,
            elements=9,
            slack="tension-only",
            position_degree=2,
            tension_degree=1,
            top=DRIVEN,
        ),
        "seabed": {"friction": 0.6, "slope": [0.05, -0.1], "start": "pulled"},
        "time": {"end": 0.4, "step": 0.01},
    },
    "chain of straight elements on a bed": {
        "sea": {"depth": 20.0},
        "cable": merged(MOORED["cable"], length=40.0, elements=13, top=DRIVEN),
        "seabed": {"friction": 0.6},
        "time": {"end": 0.4, "step": 0.01, "scheme": "bdf2"},
    },
    "sinker that is dragged": DRAGGED,
    "buoy without cable": {
        "sea": MOORED["sea"],
        "buoy": MOORED["buoy"],
        "waves": MOVING["waves"],
        "initial": {"buoy_angular_velocity": [0.1, -0.2, 0.3]},
        "time": {"end": 0.3, "step": 0.01},
    },
}


@pytest.fixture(scope="module", params=[2, pytest.param(3, marks=pytest.mark.slow)])
def parallel(request, tmp_path_factory):
    """(number of ranks, folder with one record per scene)."""
    folder = tmp_path_factory.mktemp("mpi")
    done = start_scenes(request.param, SCENES, folder)
    assert done.returncode == 0, done.stderr[-3000:]
    return request.param, folder


@pytest.fixture(scope="module")
def serial():
    """The records of a single process."""
    return {name: dolfbuoy.simulate(scene) for name, scene in SCENES.items()}


@pytest.mark.parametrize("name", SCENES)
def test_same_as_serial(serial, parallel, name):
    (ranks, folder), expected = parallel, serial[name]
    run = read(folder / name / "results.nc")
    assert run.attrs["ranks"] == ranks
    assert set(run.variables) == set(expected.variables)
    assert len(run.time) > 10
    effort = run.newton_iterations.values - expected.newton_iterations.values
    # rounding decides whether an increment at the tolerance is the last, and with it in which step a new matrix is due
    assert abs(effort.sum()) <= max(4, 0.05 * expected.newton_iterations.values.sum())
    assert abs(effort.mean()) <= 0.5
    for variable in set(run.data_vars) - {"newton_iterations"}:
        value, reference = run[variable].values, expected[variable].values
        assert value.shape == reference.shape, variable
        assert np.array_equal(np.isnan(value), np.isnan(reference)), variable  # the touchdown of what is lifted
        value, reference = np.nan_to_num(value), np.nan_to_num(reference)
        size = np.abs(reference).max()
        if variable.startswith("cable_tension"):  # the least of a slack element is rounding
            size = max(size, np.abs(expected.cable_tension.values).max())
        if variable in ("cone_angle", "roll", "pitch", "yaw"):  # of a rotation that is known to 1e-8
            size = max(size, 1.0)
        assert np.abs(value - reference).max() <= 1e-8 * size, variable


@pytest.mark.parametrize("name", SCENES)
def test_serial_run_moves(serial, name):
    """The comparison is not between scenes at rest."""
    run = serial[name]
    place = run.buoy_position if "buoy_position" in run else run.cable_position
    assert np.abs(place - place[0]).max() > 1e-4


def test_more_ranks_than_elements(tmp_path):
    """It runs, or refuses with a message; it does not crash."""
    scene = merged(SCENES["free end"], cable__elements=1)
    done = start_scenes(2, {"rod": scene}, tmp_path)
    assert done.returncode == 0 or "dolfbuoy.errors.InputError" in done.stderr, done.stderr[-3000:]

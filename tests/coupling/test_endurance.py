"""Long runs: no drift, no growth, and an energy balance that closes at the order of the scheme.

Source: sums over elements in numpy, the energy balance.
"""

import math

import numpy as np
import pytest
import typer
import xarray as xr
from dynamics_helpers import MOORED, gauss, lagrange, length, merged, rates, running, string_matrices
from verification import endurance

from dolfbuoy.errors import InputError
from dolfbuoy.motion.energy import Meter
from dolfbuoy.studies.physics import energy

TOP = {"kind": "prescribed", "position": [12.0, 0.5, -3.5], "amplitude": [0.1, 0.2, 1.0], "period": 5.0, "ramp": 2.0}
CABLE = {
    "sea": MOORED["sea"],
    "cable": merged(MOORED["cable"], elements=6, top=TOP),
    "time": {"end": 0.5, "step": 0.02},
}
INEXTENSIBLE = merged(
    CABLE, cable__axial_stiffness=None, cable__position_degree=2, cable__tension_degree=1, cable__elements=4
)
DAMPED = merged(CABLE, cable__axial_stiffness=2e4, cable__damping=1e4)
BUOY = merged(MOORED, cable__elements=6, waves__ramp=3.0)


# -- energy ------------------------------------------------------------------------------------------------------------


def test_energies_and_powers_of_a_cable():
    """Every number of the balance against sums over elements in plain numpy."""
    dt, c, rho, g = 0.02, CABLE["cable"], 1025.0, 9.81
    with running(CABLE) as simulation:
        meter, cable, u = Meter(simulation), simulation.problem.lines, simulation.system.u
        nodes = cable.node_dofs[np.argsort(cable.node_s)]
        positions = [u[nodes].copy()]
        for _ in range(60):
            simulation.step(dt)
            positions.append(u[nodes].copy())
        found, T = meter.read(), u[cable.T_dofs[np.argsort(cable.cell_ends[:, 0])]][:, 0]
        (end_tension,) = simulation.end_tension
    r, v = positions[-1], (positions[-1] - positions[-2]) / dt
    a = (positions[-1] - 2 * positions[-2] + positions[-3]) / dt**2
    breaks, area = np.linspace(0, c["length"], 7), np.pi * c["diameter"] ** 2 / 4
    M, h = string_matrices(1, breaks, np.ones_like)[0], np.diff(breaks)
    assert found["kinetic"] == pytest.approx(0.5 * c["line_density"] * np.sum(v * (M @ v)), rel=1e-10)
    assert found["elastic"] == pytest.approx(0.5 * h @ T**2 / c["axial_stiffness"], rel=1e-10)
    weight = (c["line_density"] - rho * area) * g
    assert found["gravity"] == pytest.approx(weight * M.sum(axis=0) @ r[:, 2], rel=1e-10)
    assert found["top"] == pytest.approx(end_tension @ v[-1], rel=1e-10)
    xi, weights = gauss(8)
    N = lagrange(1, xi)[0]
    drag = inertia = 0.0
    for k in range(6):
        t = (r[k + 1] - r[k]) / np.linalg.norm(r[k + 1] - r[k])
        speed, acceleration = N @ v[k : k + 2], N @ a[k : k + 2]
        v_t, stretch = speed @ t, 1 + T[k] / c["axial_stiffness"]
        v_n, a_n = speed - np.outer(v_t, t), acceleration - np.outer(acceleration @ t, t)
        cubes = c["normal_drag"] * length(v_n)[:, 0] ** 3 + c["tangential_drag"] * abs(v_t) ** 3
        drag -= stretch * h[k] * weights @ (0.5 * rho * c["diameter"] * cubes)
        inertia -= stretch * h[k] * weights @ (rho * area * c["added_mass"] * np.sum(a_n * speed, axis=1))
    assert found["drag"] == pytest.approx(drag, rel=1e-3)  # |v|^3 under the form's own quadrature
    assert found["inertia"] == pytest.approx(inertia, rel=1e-5)
    assert found["stream"] == found["buoyancy"] == found["outer"] == 0
    # the equation of motion tested with the velocity
    tau, stretch = np.diff(r, axis=0) / h[:, None], 1 + T / c["axial_stiffness"]
    pull = np.sum(T / stretch * np.sum(tau * np.diff(v, axis=0), axis=1))
    change = c["line_density"] * np.sum(v * (M @ a)) + pull + weight * M.sum(axis=0) @ v[:, 2]
    assert found["top"] + found["drag"] + found["inertia"] == pytest.approx(change, rel=1e-6)


#: scheme: least and largest order of the defect
ORDERS = {"backward-euler": (0.8, 1.3), "bdf2": (1.7, 3.5), "generalized-alpha": (1.8, 2.3)}


@pytest.mark.parametrize("scheme", ORDERS)
@pytest.mark.parametrize(
    "scene", [CABLE, INEXTENSIBLE, DAMPED, BUOY], ids=["elastic", "inextensible", "damped", "buoy"]
)
def test_defect_of_the_balance_has_the_order_of_the_scheme(scene, scheme):
    slow = (scene is BUOY and scheme == "bdf2") or (scene is DAMPED and scheme == "backward-euler")
    steps = [0.04, 0.02, 0.01] if slow else [0.04, 0.02]  # where the order shows late
    found = [energy.evaluate({"scene": scene, "t_end": 5.0, "step": h, "scheme": scheme}) for h in steps]
    last = found[-1]
    assert last["drag"] < 0
    assert abs(last["kinetic"]) > 1e-3 * abs(last["drag"])
    if scene is DAMPED:
        assert last["damping"] < 0.5 * last["drag"]  # its account matters
    defects = [abs(row["defect"]) for row in found]
    least, largest = ORDERS[scheme]
    assert least < rates(defects)[-1] < largest, found
    assert last["relative"] < (0.1 if scheme == "backward-euler" else 2e-3)


def test_backward_euler_takes_energy_away():
    """It damps; energy is never created."""
    row = energy.evaluate({"scene": CABLE, "t_end": 5.0, "step": 0.04, "scheme": "backward-euler"})
    assert row["defect"] < 0


def test_the_balance_wants_a_start_from_rest():
    free = {"buoy": MOORED["buoy"], "sea": MOORED["sea"], "initial": {"buoy_velocity": [1.0, 0.0, 0.0]}}
    with pytest.raises(InputError, match="from rest"):
        energy.evaluate({"scene": free, "t_end": 1.0, "step": 0.1, "scheme": "bdf2"})


# -- windows -----------------------------------------------------------------------------------------------------------

t = np.arange(0, 100.01, 0.1)


def record(growth=0.0, drift=0.0, **attributes):
    """A made-up buoy oscillating with a period of 5 s."""
    swing = np.sin(2 * np.pi * t / 5)
    position = np.stack([3 * swing + drift * t, 2 * swing, swing], axis=1)
    unit = np.tile([1.0, 0, 0, 0], (len(t), 1))
    data = {
        "tension_top": ("time", 8e3 + 3e3 * swing * np.exp(growth * t)),
        "tension_anchor": ("time", 6e3 + 3e3 * swing),
        "cone_angle": ("time", 10 + 5 * swing),
        "buoy_position": (("time", "xyz"), position),
        "buoy_orientation": (("time", "quaternion"), unit),
        "newton_iterations": ("time", np.full(len(t), 3)),
    }
    attrs = {"failed_steps": 0, "linear_solver_fallbacks": 0} | attributes
    return xr.Dataset(data, coords={"time": t}, attrs=attrs)


def failures(run, **changes):
    for name, value in changes.items():
        run[name] = value
    found = endurance.judge(run, endurance.windows(run, 20.0), 1, 1e-3)
    return [what for what, value, allowed in found if not value <= allowed]


def test_windows_hold_whole_periods():
    rows = endurance.windows(record(), 20.0)
    assert [row["until"] for row in rows] == [20, 40, 60, 80, 100]
    for row in rows:
        assert row["top_max"] == pytest.approx(11e3, rel=1e-3)
        assert row["x_mean"] == pytest.approx(0, abs=1e-12)


def test_what_is_noticed():
    assert failures(record()) == []
    assert {"top_max, largest change", "top_max, trend"} <= set(failures(record(growth=1e-3)))
    assert set(failures(record(drift=1e-3))) == {"x_mean, largest change", "x_mean, trend"}
    assert failures(record(failed_steps=1)) == ["failed steps"]
    broken = record()
    broken.cone_angle[5] = np.nan
    assert failures(broken) == ["values that are not finite"]
    stretched = record()
    stretched.buoy_orientation[500] *= 1 + 1e-9
    assert failures(stretched) == ["||q| - 1|"]


def test_short_for_a_while(tmp_path, capsys):
    """The transient has decayed after a minute and a half; a second call reads the results of the first."""
    options = {"duration": 150.0, "window": 15.0, "skip": 6, "out": tmp_path}
    endurance.main("short", tolerance=1e-3, **options)
    assert "FAILED" not in capsys.readouterr().out
    written = (tmp_path / "run" / "results.nc").stat().st_mtime_ns
    with pytest.raises(typer.Exit) as end:
        endurance.main("short", tolerance=1e-15, **options)
    assert end.value.exit_code == 1
    assert "FAILED" in capsys.readouterr().out
    assert (tmp_path / "run" / "results.nc").stat().st_mtime_ns == written


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"duration": 20.0, "window": 15.0}, "--duration 20: fewer than 3 windows of 15 s"),
        ({"window": 0.0}, "--window 0: must be a positive"),
        ({"window": -10.0}, "--window -10: must be a positive"),
        ({"window": math.nan}, "--window nan: must be a positive"),
        ({"tolerance": math.nan}, "--tolerance nan: must be a positive"),
        ({"scene": "nowhere"}, "'nowhere': is neither a file nor a shipped scene"),
    ],
)
def test_what_it_cannot_judge(options, said, tmp_path):
    with pytest.raises(InputError, match=said):
        endurance.main(**{"scene": "short"} | options, out=tmp_path)

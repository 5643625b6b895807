"""Offset curves of a buoy on a catenary and on a taut line, and warnings about bad states.

Source: Irvine's catenary with the hydrostatics of a cylinder, programmed here; MoorPy 1.3 (PyPI).
"""

import math
import re
from types import SimpleNamespace as Fake

import alone
import numpy as np
import pytest
import xarray as xr
from helpers import under_end_force
from mpi4py import MPI
from scipy.optimize import brentq

import dolfbuoy
from dolfbuoy import InputError, SolveError, load_scene
from dolfbuoy.results.linear_figures import offset_curves
from dolfbuoy.results.offset_record import sentences
from dolfbuoy.statics import offsets

RHO, G, DEPTH, D, MASS, Z_C = 1025.0, 9.81, 40.0, 2.0, 2500.0, 0.6
AREA = math.pi * D**2 / 4
SIZES, DIRECTIONS = [0.0, 500.0, 2000.0, 6000.0], [0.0, 90.0, 200.0]


def moored(w, length, EA, diameter=0.04):
    """A cylinder that is held at C: it stays upright, and the line's pull acts on its draft only."""
    cable = {"length": length, "line_density": w / G + RHO * math.pi * diameter**2 / 4, "diameter": diameter}
    cable |= {"axial_stiffness": EA, "elements": 16, "position_degree": 3, "tension_degree": 2}
    buoy = {"hull": [[0.0, D], [4.0, D]], "mass": MASS, "center_of_mass": Z_C, "mooring_height": Z_C}
    return {"sea": {"depth": DEPTH, "density": RHO}, "cable": cable, "buoy": buoy}


def exact(w, length, EA, H):
    """(horizontal distance of C from the anchor, top tension) under a horizontal force H."""

    def shape(V):
        return under_end_force([0, 0, -DEPTH], [H, 0, V], length, w, EA)

    def gap(V):
        draft = (MASS + V / G) / (RHO * AREA)
        return shape(V).position(np.array([length]))[0, 2] - (Z_C - draft)

    V = brentq(gap, w * length * 0.2, RHO * G * AREA * 4 - MASS * G)
    return shape(V).position(np.array([length]))[0, 0], math.hypot(H, V)


@pytest.mark.parametrize(("w", "length", "EA"), [(80.0, 43.0, 5e5), (0.5, 39.0, 4e4)], ids=["catenary", "taut"])
def test_closed_form(w, length, EA):
    """From every side alike, continuation included."""
    sizes = SIZES[1:]
    found = alone.offsets(moored(w, length, EA), sizes, DIRECTIONS, comm=MPI.COMM_SELF)
    radius = np.hypot(*(found.buoy_position.sel(xyz=name).values for name in "xy"))
    for j, H in enumerate(sizes):
        distance, tension = exact(w, length, EA, H)
        np.testing.assert_allclose(radius[:, j], distance, rtol=2e-4)
        np.testing.assert_allclose(found.tension_top.values[:, j], tension, rtol=2e-4)
    assert found.found.values.all()
    assert not found.slack.values.any()
    if length < DEPTH:  # at rest right above the anchor
        np.testing.assert_allclose(found.offset_along, found.offset, rtol=1e-6)
        np.testing.assert_allclose(found.offset, radius, rtol=1e-3)
    assert sentences(found) == []


def test_moorpy():
    """A fairlead that MoorPy holds where C comes to rest is pulled as here."""
    moorpy = pytest.importorskip("moorpy", reason="MoorPy is not installed (extra test)")
    w, length, EA = 80.0, 43.0, 5e5
    found = alone.offsets(moored(w, length, EA), SIZES[1:], [30.0], comm=MPI.COMM_SELF)
    for j in range(len(SIZES) - 1):
        system = moorpy.System(depth=DEPTH, rho=RHO, g=G)
        diameter = 0.04
        kind = {"name": "line", "d_vol": diameter, "m": w / G + RHO * math.pi * diameter**2 / 4, "EA": EA, "w": w}
        system.lineTypes["line"] = kind
        system.addPoint(1, [0, 0, -DEPTH])
        system.addPoint(1, found.mooring_point.values[0, j].tolist())
        system.addLine(length, "line", pointA=1, pointB=2)
        system.initialize()
        pull = -system.pointList[1].getForces(lines_only=True)
        np.testing.assert_allclose(found.end_tension.values[0, j], pull, rtol=2e-3, atol=2.0)


def test_slack_and_under_and_none():
    """A light line goes slack where the load goes; a strong current draws the buoy under; all is said and drawn."""
    light = moored(0.0, 43.0, 1e6)
    light["current"] = {"speed": 0.5}
    light["cable"]["normal_drag"] = light["buoy"]["normal_drag"] = 1.0
    drowned = dolfbuoy.offsets(light, [0.5, 3.0, 6.0], [0.0], "current", comm=MPI.COMM_SELF)
    assert drowned.under.values[0].tolist() == [False, True, True] or drowned.under.values[0, -1]
    said = sentences(drowned)
    assert any("drawn under" in sentence and "Towards 0 degrees" in sentence for sentence in said), said
    figure = offset_curves(drowned, [(0.0, 0.0)])
    assert len(figure.axes) == 3
    assert any(text.get_text() == "buoy under water" for text in figure.legends[0].get_texts())


def test_several_buoys():
    """A force on one of two, and on both: equilibria of scenes with those forces in them; circles around the places."""
    scene = load_scene("two-buoys").to_dict()
    del scene["waves"]
    for chosen in (None, ["right"]):
        found = alone.offsets(scene, [0.0, 4000.0], [0.0, 90.0, 180.0], buoys=chosen, comm=MPI.COMM_SELF)
        pulled = scene | {"buoy": [dict(buoy) for buoy in scene["buoy"]]}
        for buoy in pulled["buoy"]:
            if chosen is None or buoy["name"] in chosen:
                buoy["external_force"] = {"force": [0.0, 4000.0, 0.0]}
        exact = alone.solve_static(pulled, comm=MPI.COMM_SELF)
        one = found.sel(direction=90.0, force=4000.0)
        np.testing.assert_allclose(one.buoy_position, exact.buoy_position, atol=1e-6)
        np.testing.assert_allclose(one.tension_top, exact.tension_top, rtol=1e-6)
        places = found.buoy_position.sel(force=4000.0).values[..., :2]
        reach = np.linalg.norm(places - found.watch_centre.sel(force=4000.0).values, axis=-1)
        np.testing.assert_allclose(reach.max(axis=0), found.watch_radius.sel(force=4000.0), rtol=1e-9)
    calm = alone.solve_static({key: v for key, v in scene.items() if key != "current"}, comm=MPI.COMM_SELF)
    own = np.linalg.norm((found.buoy_position.sel(force=0.0) - calm.buoy_position).values[..., :2], axis=-1)
    np.testing.assert_allclose(found.offset.sel(force=0.0), own, atol=1e-6)  # what the current does
    assert found.offset.dims == ("direction", "force", "buoy")


def test_refusals():
    with pytest.raises(InputError, match="those of moored buoys"):
        alone.offsets("driven", [1.0], [0.0])
    with pytest.raises(InputError, match="those of moored buoys"):
        alone.offsets("free-buoy", [1.0], [0.0])


def test_offsets_from_where_nothing_pulls(call, tmp_path):
    """A force of the scene's own carries the buoy to one side: offsets along the load, and what is printed of them."""
    scene, own = moored(0.5, 39.0, 4e4), 1500.0
    scene["external_force"] = {"force": [own, 0.0, 0.0]}
    path = tmp_path / "scene.toml"
    path.write_text(load_scene(scene).to_toml())
    calm = alone.solve_static({k: v for k, v in scene.items() if k != "external_force"}, comm=MPI.COMM_SELF)
    code, out, _ = call("offsets", path, "--force", "500,1000", "--directions", "0,180", "--out", tmp_path / "o")
    assert code == 0
    with xr.open_dataset(tmp_path / "o" / "offsets.nc") as found:
        x = found.buoy_position.values[..., 0, 0] - float(calm.buoy_position[0])
        np.testing.assert_allclose(found.offset_along.values[..., 0], x * [[1], [-1]], atol=1e-9)
        assert x[1, 0] > 0.01  # still where its own force carries it
    rows = {row[0]: row for line in out.splitlines() if len(row := re.findall(r"-?[\d.]+", line)) == 4}
    assert rows["0"][1:3] == ["1000", f"{x[0, 1]:.5g}"]
    assert rows["180"][1:3] == ["1000", f"{-x[1, 1]:.5g}"]


@pytest.mark.parametrize(
    ("begin", "table", "rubs", "done"),
    [
        (1.0, None, False, ["marched"]),
        (1.0, "growth", False, ["sought", "gone"]),
        (1.0, None, True, ["sought", "gone"]),
        (None, None, False, ["sought", "gone"]),
    ],
)
def test_a_rest_is_followed_where_it_is_all_that_there_is_to_find(begin, table, rubs, done, monkeypatch):
    """Else it is sought anew, and the problem of before given back if there is one."""
    told = []
    problem = Fake(
        lines=Fake(growth=table), scene=Fake(seabed="bed" if rubs else None), destroy=lambda: told.append("gone")
    )
    monkeypatch.setattr(offsets, "has_friction", lambda scene, dynamic: rubs)
    monkeypatch.setattr(offsets, "_march", lambda *given: told.append("marched"))
    monkeypatch.setattr(offsets, "solve_equilibrium", lambda scene, comm: told.append("sought") or "fresh")
    found = offsets._follow(problem, lambda size: size, begin, 2.0, None)
    assert (found, told) == ((problem if done == ["marched"] else "fresh", ""), done)

    def fails(*_):
        raise SolveError("no rest")

    monkeypatch.setattr(offsets, "solve_equilibrium", fails)
    monkeypatch.setattr(offsets, "_march", fails)
    assert offsets._follow(problem, lambda size: size, begin, 2.0, None) == (problem, "no rest")


def test_rests_go_from_size_to_size_in_each_direction(monkeypatch):
    """From what was reached last; anew after one that was not found, whose reason stands in the place of a problem."""
    asked, gone = [], []
    problem = Fake(destroy=lambda: gone.append("destroyed"))

    def follow(before, scene_of, start, end, comm):
        scene = scene_of(end)
        force = scene.network.buoys["buoy"].external_force.force
        asked.append((before is problem, start, end, scene.waves, [round(x, 9) for x in force]))
        return problem, "no rest" if end == 2.0 else ""

    monkeypatch.setattr(offsets, "_follow", follow)
    scene = load_scene("short", external_force=None)
    found = list(offsets.rests(scene, "force", [1.0, 2.0, 3.0, 4.0], [0.0, 90.0], MPI.COMM_SELF, ["buoy"]))
    steps = [(None, 1.0), (1.0, 2.0), (None, 3.0), (3.0, 4.0)]
    pulls = [lambda x: [x, 0.0, 0.0], lambda x: [0.0, x, 0.0]]
    assert asked == [(k + i > 0, a, b, None, pulls[k](b)) for k in (0, 1) for i, (a, b) in enumerate(steps)]
    rest = offsets.Rest
    expected = [
        rest(0.0, size, None if size == 2.0 else problem, "no rest" if size == 2.0 else "") for _, size in steps
    ]
    assert found == [*expected, *(one._replace(direction=90.0) for one in expected)]
    assert gone == ["destroyed"]
    with pytest.raises(InputError, match=r"^buoy other: must be one of buoy\.$"):
        next(offsets.rests(scene, "force", [1.0], [0.0], MPI.COMM_SELF, ["buoy", "other"]))

"""Materials of the library; spectra, currents, motions and depths of files that scenes name."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import tomli_w
import xarray as xr
from told import MOORED, SHIP, refused, show

from dolfbuoy import load_scene
from dolfbuoy.linear.spectrum import bins_of
from dolfbuoy.model.airy import components_of
from dolfbuoy.scene.library import material, resized, size_of, sizes_made


def scene_file(scene):
    """A scene file beside the files that it names."""
    path = Path("scene.toml")
    path.write_text(tomli_w.dumps(scene))
    return path


def materials():
    """Materials of the library by their names, and those that there are not."""
    names = ["chain R3 studless 19 mm", "chain Q3 studlink 32 mm less 2 mm", "chain Q1 studless 40 mm"]
    names += ["chain Q2 studlink 60 mm", "chain R3S studless 76 mm", "chain R4 studless 76 mm"]
    names += ["chain R4S studlink 90 mm", "chain R5 studless 100 mm", "polyester 60 mm at 20 %", "nylon 24 mm at 10 %"]
    names += [
        f"{kind} 40 mm" for kind in ("wire", "wire IWRC", "polyester", "nylon", "HMPE", "aramid", "polypropylene")
    ]
    for name in names:
        print(f"{name}: {material(name)}, {size_of(name):g} of {sizes_made(name)}, {resized(name, 33.3)}")
    print(f"{material('hemp 20 mm')}")
    wrong = ["chain R9 studless 19 mm", "chain R3 studless 1e9 mm", "chain R3 studless 20 mm less 20 mm", "wire 0 mm"]
    wrong += ["wire 20 mm at 10 %", "polyester 20 mm at 0 %", "polyester 20 mm at 99 %", "chain", "nylon 3 cm"]
    refused(*(lambda name=name: material(name) for name in wrong), lambda: size_of("hemp 20 mm"))


def tables():
    """Spectra, currents, motions and depths of netCDF and text files that scenes name."""
    frequency, direction = np.array([0.3, 0.05, 0.1, 0.15, 0.2]), np.arange(0.0, 360.0, 30.0)
    density = np.exp(-(((frequency[:, None] - 0.12) / 0.05) ** 2)) * (1 + np.cos(np.radians(direction - 70.0)))
    efth = xr.DataArray(density, {"freq": frequency, "dir": direction}, name="efth")
    efth.to_netcdf("sea.nc")
    (efth * 180 / np.pi).rename("efth").assign_attrs(units="m2 s rad-1").T.to_netcdf("radian.nc")
    t, z = np.array([2.0, 3.0, 5.0]), np.array([0.0, 10.0, 30.0])
    u = np.add.outer(0.1 * t, 0.01 * z)
    stream = xr.Dataset({"uo": (("time", "depth"), u), "vo": (("depth", "time"), -0.5 * u.T)}, {"time": t, "depth": z})
    stream["time"].attrs["units"] = "hours since then"
    stream.to_netcdf("stream.nc")
    rows = {name: ("time", k * 0.01 * t**2) for k, name in enumerate(("x", "y", "z", "roll", "pitch", "yaw"))}
    motion = xr.Dataset(rows, {"time": t - 2.0})
    motion["pitch"].attrs["units"] = "radian"
    motion.to_netcdf("motion.nc")
    x, y = [-60.0, 0.0, 70.0], [60.0, -60.0]
    depth = np.array([[20.0, 20.5, 21.0], [21.0, 22.0, 20.0]])
    xr.Dataset({"elevation": (("y", "x"), -depth)}, {"x": x, "y": y}).to_netcdf("bed.nc")
    Path("moordyn.txt").write_text("--- bathymetry ---\nnGridX 3\nnGridY 2\n-60 0 70\n-60 21 22 20\n60 20 20.5 21\n")
    points = "\n".join(f"{a} {b} {-depth[j, i]}" for i, a in enumerate(x) for j, b in enumerate(y))
    Path("map.txt").write_text(f"3 2\n-60 0 70\n-60 60\n{points}\n")
    base = {"sea": {"depth": 20.0}, "cable": MOORED["cable"] | {"top": {"kind": "free", "force": [0.0, 0.0, 9e3]}}}
    for name in ("sea.nc", "radian.nc"):
        waves = {"spectrum": name, "components": 24, "direction_deg": 10.0}
        scene = load_scene(scene_file(base | {"waves": waves}))
        sea = components_of(scene.waves)
        show({f"{name} {key}": value for key, value in vars(sea).items()})
        show({f"{name} bins {key}": value for key, value in vars(bins_of(scene.waves)).items()})
    scene = load_scene(scene_file(base | {"current": {"grid": "stream.nc"}}))
    show({"stream": scene.current.grid})
    ship = SHIP["vessel"][0] | {"motion": "motion.nc"}
    show({"motion": load_scene(scene_file(SHIP | {"vessel": [ship]})).vessel[0].motion})
    for name in ("bed.nc", "moordyn.txt", "map.txt"):
        found = load_scene(scene_file(base | {"seabed": {"stiffness": 1e4, "depths": name}})).seabed.depths
        show({f"{name} {key}": getattr(found, key) for key in ("x", "y", "depth")})
        show({f"{name} heights": [found.height(a, b) for a, b in pairwise([-70.0, -10.0, 3.0, 61.0])]})


materials()
tables()

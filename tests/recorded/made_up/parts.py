"""Studies with few cases, the doctor, every way in which a command ends, and tables from numbers made up."""

import contextlib
import math
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import xarray as xr

from dolfbuoy.commands import doctor, statistics
from dolfbuoy.commands import main as cli
from dolfbuoy.commands.shared import Interrupted
from dolfbuoy.errors import InputError, NotAccurate, SolveError, missing
from dolfbuoy.scene import load_scene
from dolfbuoy.studies import sea
from dolfbuoy.studies.accuracy import inf_sup
from dolfbuoy.studies.physics import hull, response_runs
from dolfbuoy.studies.study import run


def stable_pairs():
    """All of the study of pairs on few meshes."""
    print(inf_sup.PAIRS, inf_sup.SIZES, len(inf_sup.cases()))
    few = inf_sup.cases(tuple(inf_sup.STATES), [(1, 0), (1, 1), (2, 2)], (4, 8))
    with patch.object(inf_sup, "cases", lambda: few):
        run(inf_sup.study, Path("pairs"))
    for row in (case | inf_sup.evaluate(case) for case in few[:6]):
        print(" ".join(f"{x:.5g}" if isinstance(x, float) else str(x) for x in row.values()))


def of_a_machine():
    """What the doctor finds, and where something is wrong."""
    print(*(found[:2] for found in doctor.examine()), doctor.examine()[1][2])
    wrong = SimpleNamespace(tension_top=0.81, newton_iterations=3)
    for how in (
        patch("shutil.which", lambda name: None),
        patch.object(subprocess, "run", lambda *_, **__: SimpleNamespace(stdout="1\n1\n", stderr="no slots\nat all\n")),
        patch("dolfbuoy.api.solve_static", lambda scene, comm: wrong),
    ):
        with how:
            print(*doctor.examine()[1:])
    with patch.object(doctor, "OF_THE_SYSTEM", ["petsc4py", "nowhere"]):
        try:
            doctor.installed()
        except InputError as error:
            print(str(error).replace(sys.executable, "PYTHON"))


def endings():
    """Exit code and last words for whatever a command raises."""
    broken = OSError(13, "not allowed", "some/file")
    odd = UnicodeEncodeError("ascii", "a\u00fcb", 1, 2, "not there")
    gone = ModuleNotFoundError("No module named 'petsc4py'", name="petsc4py")
    raised = [InputError("Wrong"), NotAccurate("Not so."), SolveError("Newton."), gone, Interrupted("Stopped."), broken]
    for error in [*raised, odd, KeyboardInterrupt(), SystemExit(3), ImportError("libpetsc.so: gone.", name="petsc4py")]:

        def app(standalone_mode, error=error):
            raise error

        with patch.object(cli, "app", app), contextlib.redirect_stderr(sys.stdout):
            try:
                cli.main()
            except SystemExit as end:
                print(type(error).__name__, end.code)
    print(missing(ImportError("no such thing", name="elsewhere")))


def of_the_sea():
    """How many components and seeds a sea needs, and runs that check a response."""
    storm = load_scene("storm")
    print(sea.of_components(storm, 0.02), sea.of_components(storm, 0.1), sea.of_statistics(storm))
    print(sea.of_statistics(storm, 100.0))
    for name, changes in (("short", {"buoy.mass": 1e5}), ("short", {}), ("short", {"buoy.center_of_mass": 2.5})):
        print(name, hull._unheld(load_scene(name, **changes)))

    def history(ran, direction):
        t = np.arange(0, ran.end, ran.period / 50)
        w = 2 * math.pi / ran.period
        return (
            t,
            {"heave": 0.01 * np.cos(w * t - 0.3) + 0.1 * np.exp(-t / 9), "pitch": 0.02 * np.sin(w * t)},
            [3.0, 1.0, -2.0],
        )

    def begun(scene, waves, end, period):
        print(waves.amplitude, waves.ramp, end, period)
        return SimpleNamespace(end=end, period=period)

    with patch.multiple(response_runs, _run=begun, _history=history, wavenumber=lambda run: 0.3):
        for name, value in response_runs.measured(load_scene("short"), 4.0, 30.0, 0.05).items():
            if name != "seconds":
                print(name, f"{value:.5g}")


def of_statistics():
    """Certainty, extremes and the design wave of made-up runs."""
    runs = {"memory": [3.0, 4.0] * 4, "mean": [5e3, 5.2e3] * 4}
    data = {f"tension_top_{name}": ("run", np.array(x)) for name, x in runs.items()}
    data |= {"duration": ("run", [600.0, 500.0] * 4), "seconds": ("run", [30.0, 40.0] * 4)}
    data |= {"tension_top_gumbel_scale": 300.0, "tension_top_gumbel_location": 9e3}
    data["tension_top_most_probable"] = "interval", np.array([1.2e4, 1.1e4, 1.4e4])
    data |= {f"circle_{name}": ("buoy", [x]) for name, x in (("x", 1.0), ("y", -2.0), ("radius", 7.5))}
    mine = xr.Dataset(data | {"watch_circle_radius": ("buoy", [9.0])}, {"buoy": ["one"]}, {"hours": 3.0})
    mine["tension_top_mean"].attrs["units"] = "N"
    series = [("tension_top of port", "tension_top", mine)]
    print(statistics._certainty(series))
    print(list(statistics._circles(mine)))
    labels = {"series": ["tension_top", "offset"], "part": ("series", ["port", ""]), "unit": ("series", ["N", "m"])}
    numbers = {"largest": [1.3e4, 9.0], "most_probable": [1.2e4, 8.5], "above": [0.123, 0.4567]}
    design = xr.Dataset({name: ("series", x) for name, x in numbers.items()}, labels)
    statistics._show_design(design, Path("design.nc"))


stable_pairs()
of_a_machine()
endings()
of_the_sea()
of_statistics()

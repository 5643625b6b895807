"""`dolfbuoy run`: a scene in time, from its start or from where it was stopped, and what is shown of it."""

import shlex
import time as clock
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from ..errors import InputError, NoResult, NotAccurate
from ..parallel import interruption
from ..parallel.ranks import rank
from . import shared as cli

if TYPE_CHECKING:
    import xarray as xr

    from ..motion.simulation import Simulation
    from ..scene import Scene


def run(
    scene: Annotated[str | None, typer.Argument(metavar="SCENE", help="Name of a shipped scene, or path.")] = None,
    folder: cli.OutOption = None,
    t_end: Annotated[float | None, typer.Option("--t-end", help="End of the run \\[s].")] = None,
    assign: cli.SetOption = None,
    plot: Annotated[bool, typer.Option("--plot/--no-plot", help="Draw figures.")] = True,
    paraview: cli.ParaviewOption = False,
    svg: cli.SvgOption = False,
    instants: cli.InstantsOption = 50,
    page: Annotated[
        bool | None, typer.Option("--page/--no-page", help="Write page.html \\[default: unless --no-plot].")
    ] = None,
    accuracy: Annotated[
        str | None, typer.Option("--accuracy", help="Find settings with which outputs are so accurate, as 1%.")
    ] = None,
    of: Annotated[
        str | None, typer.Option("--of", help="These outputs, with commas, as tension_top.max,cone_angle.std.")
    ] = None,
    bars: Annotated[
        bool, typer.Option("--bars", help="Estimate error bars, mostly from a second, coarser run: half as much again.")
    ] = False,
    resume: Annotated[
        Path | None, typer.Option("--resume", metavar="DIR", help="Go on with a run that was stopped, or lengthen it.")
    ] = None,
    overwrite: cli.OverwriteOption = False,
) -> None:
    """Run a scene in time.  Example: dolfbuoy run short --t-end 20 --set waves.amplitude=1"""
    from ..model.feasible import check_feasible
    from ..scene.settings import check_time

    if (scene is None) == (resume is None):
        raise InputError("SCENE: must be given, or --resume DIR, and not both.")
    end: dict[str, Any] = {} if t_end is None else {"time.end": t_end}
    requested: dict[str, Any] = {"accuracy.estimate": "both"} if bars or accuracy is not None else {}
    if accuracy is not None:
        from ..results.compare import parse_accuracy

        requested["accuracy.target"] = parse_accuracy(accuracy)
    if of is not None:
        if accuracy is None:
            raise InputError(f"--of {of}: goes with --accuracy, of whose outputs it is.")
        requested["accuracy.of"] = of.split(",")
    shows: dict[str, Callable[[Path], None]] = (
        {"figures": partial(draw, paraview=paraview, instants=instants, svg=svg)} if plot else {}
    )
    shows |= {"page.html": partial(cli.page_of, "results.nc")} if (plot if page is None else page) else {}
    if resume is not None:
        if folder is not None or assign or requested or overwrite:
            raise InputError(
                f"--resume {resume}: goes on with a run as it is: with it go --t-end, and no --out, --set, "
                "--accuracy, --bars or --overwrite."
            )
        loaded = _to_be_resumed(resume, end)
        if loaded is not None:
            _compute(loaded, resume, shows, {"resume": resume} | end)
        return
    scene = scene or ""  # it is given, as there is no run to go on with
    loaded, folder = cli.load(scene, assign, **end, **requested), cli.folder_of(scene, folder)
    check_feasible(loaded)
    check_time(loaded)
    if accuracy is not None:
        from ..accuracy.target import check_names

        check_names(loaded)
    if _is_there(folder, loaded, overwrite):
        _show_again(loaded, folder, shows)
    else:
        _compute(loaded, folder, shows, {"scene": loaded, "out": folder, "overwrite": overwrite})


def _to_be_resumed(folder: Path, end: dict[str, Any]) -> "Scene | None":
    """The scene of a stopped run; None, and a sentence, when it is complete."""
    from ..api import simulate
    from ..elsewhere import MPI
    from ..results.checkpoint import load as load_checkpoint
    from ..results.record import verify

    point = load_checkpoint(folder, MPI.COMM_WORLD.size, *end.values())
    verify(folder / "results.nc")  # before anything is shown
    if not point.complete:
        return point.scene
    simulate(resume=folder, **end)  # notes that it is
    cli.say(f"The run in {folder} is already complete: t = {point.t:g} s; --t-end lengthens it.")
    return None


def _is_there(folder: Path, scene: "Scene", overwrite: bool) -> bool:
    """True if the finished run of the scene is in the folder."""
    from .. import api  # noqa: F401  # what a run needs is there, before a folder is made
    from ..elsewhere import MPI
    from ..results.folder import claimed, holds

    with claimed(folder, MPI.COMM_WORLD):
        return holds(folder, "run", scene, overwrite, MPI.COMM_WORLD)


def _show_again(scene: "Scene", folder: Path, shows: dict[str, Callable[[Path], None]]) -> None:
    from ..results.cautions import refused
    from ..results.record import read

    if rank() != 0:
        return
    cli.say(f"The run in {folder} is complete already; --overwrite computes it again.")
    record = read(folder / "results.nc")
    _print_summary(record, scene, folder)
    for name, show in shows.items():
        if not (folder / name).exists():
            show(folder)
    if (error := refused(record, scene)) is not None:
        raise error


def _compute(scene: "Scene", folder: Path, shows: dict[str, Callable[[Path], None]], source: dict[str, Any]) -> None:
    """Simulate, and print and show what came of it."""
    from ..api import simulate
    from ..check import derived
    from ..elsewhere import MPI
    from ..results.after_ramp import scene_of
    from ..results.summary import sharing_note

    cli.say_warnings(derived(scene).warnings)
    if rank() == 0 and (note := sharing_note(scene, MPI.COMM_WORLD.size)):
        cli.err.print(note, soft_wrap=True, highlight=False)
    record: Any
    bar, unsound = _Bar(scene), None
    try:
        with bar, warnings.catch_warnings(action="ignore", category=UserWarning):  # the summary has it
            record = simulate(progress=bar.update, **source)
    except (NoResult, NotAccurate) as error:
        record, unsound = error.record, error
    except BaseException:
        if interruption.received():
            raise cli.Interrupted(_left(scene, folder)) from None
        raise
    if rank() != 0:
        return
    _print_summary(record, scene_of(record), folder)  # settings may be others than those that were given
    for show in shows.values():
        show(folder)
    if unsound is not None:
        raise unsound


def _left(scene: "Scene", folder: Path) -> str:
    """A sentence on what is left of a run that was interrupted."""
    from ..results.folder import can_resume

    if not can_resume(folder, scene):
        return "Interrupted before the first step; there is nothing to go on with yet."
    again = f"dolfbuoy run --resume {shlex.quote(str(folder))}"
    return f"Interrupted; what was computed until now is in {folder}, and {again} goes on."


def draw(folder: Path, paraview: bool, instants: int, svg: bool) -> None:
    """Figures and, if they are wanted, ParaView files of a run; a sentence on figures that it is too short for."""
    from ..results.figures import draw_all
    from ..results.paraview import export

    figures = draw_all(folder, cli.say, svg)
    exported = export(folder, instants) if paraview else []
    places = f"{folder / 'figures'} and {folder / 'paraview'}" if exported else f"{folder / 'figures'}"
    cli.say(f"{len(figures) + len(exported)} files in {places}")


class _Bar:
    """Progress of a run on rank 0: simulated time, speed against real time, Newton iterations per step."""

    def __init__(self, scene: "Scene"):
        self.end = scene.time.end if scene.time else 0.0
        self.steps = self.iterations = 0
        self._next = 0.0  # when to show again
        self.progress = Progress(
            TextColumn("t = {task.completed:.2f} of {task.total:g} s"),
            BarColumn(bar_width=20),
            TextColumn("{task.fields[speed]:.1f} x real time, {task.fields[newton]:.2f} Newton/step"),
            TimeRemainingColumn(compact=True),
            console=cli.err,
            disable=rank() != 0,
        )

    def __enter__(self) -> "_Bar":
        self.progress.__enter__()
        self.task = self.progress.add_task("", total=self.end, speed=0.0, newton=0.0)
        return self

    def update(self, simulation: "Simulation", iterations: int) -> None:
        self.steps += 1
        self.iterations += iterations
        now = clock.monotonic()
        if now < self._next and simulation.t < (1 - 1e-9) * self.end:
            return
        self._next = now + 0.05  # a step takes less than what shows it
        elapsed = self.progress.tasks[0].elapsed or 0.0
        speed = simulation.t / elapsed if elapsed > 0 else 0.0
        newton = self.iterations / self.steps
        self.progress.update(self.task, completed=simulation.t, speed=speed, newton=newton)

    def __exit__(self, *exception: Any) -> None:
        self.progress.__exit__(*exception)


def _print_summary(record: "xr.Dataset", scene: "Scene", folder: Path) -> None:
    from ..results import summary as results

    title = f"\n{scene.title or 'Run'}, {folder / 'results.nc'}"
    cli.print_table(title, ("quantity", "value", "unit"), results.summary(record, scene))
    cli.print_criteria(record, scene)
    cli.say_warnings(results.warnings(record, scene))

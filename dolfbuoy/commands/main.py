"""Command line: parse, call, print."""

import os
import sys
import traceback
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from .. import __version__
from ..errors import InputError, SolveError, printable
from ..parallel import interruption, ranks
from ..results.tables import out, table
from . import language
from .study import app as study_app

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="Simulation of a tethered buoy with FEniCSx.\n\nExample: dolfbuoy run short",
)
app.add_typer(study_app, name="study")
err = Console(stderr=True)

SceneArgument = Annotated[str, typer.Argument(metavar="SCENE", help="Name of a shipped scene, or path of a TOML file.")]
SetOption = Annotated[list[str] | None, typer.Option("--set", metavar="SECTION.KEY=VALUE", help="Change the scene.")]
OutOption = Annotated[Path | None, typer.Option("--out", help="Folder of the results [default: results/NAME].")]
QuantityOption = Annotated[
    str, typer.Option("--quantity", help="tension_top, tension_anchor, buoy_position or cone_angle.")
]


def _load(scene, assignments, **overrides):
    from ..scene import load_scene, parse_assignment

    overrides |= dict(parse_assignment(text) for text in assignments or [])
    return load_scene(scene, **overrides)


def _folder(scene, folder):
    return folder if folder is not None else Path("results") / Path(scene).stem


def _rank():
    from mpi4py import MPI

    return MPI.COMM_WORLD.rank


def _table(title, *columns):
    return table(title, columns, right=("value", "after the run"))


def _say_version(wanted):
    if wanted:
        out.print(f"dolfbuoy {__version__}", highlight=False)
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_say_version, is_eager=True, help="Say the version and exit.")
    ] = False,
):
    """What goes before a command."""


@app.command("list")
def list_scenes():
    """Shipped scenes.  Example: dolfbuoy list"""
    from ..scene import load_scene, shipped_scenes

    shown = _table("Shipped scenes", "name", "title")
    for name in shipped_scenes():
        shown.add_row(name, load_scene(name).title)
    out.print(shown)


@app.command()
def check(scene: SceneArgument, assign: SetOption = None):
    """Effects, derived numbers and warnings of a scene.  Example: dolfbuoy check short --set waves.amplitude=2"""
    from ..check import check as examine
    from ..results.summary import remaining_amplitude

    loaded = _load(scene, assign)
    report = examine(loaded)
    out.print(f"[bold]{escape(loaded.title or printable(scene))}[/bold]\neffects: {', '.join(report.effects)}\n")
    shown = _table("Derived numbers", "quantity", "value", "unit", "remark")
    for name, value, unit, remark in report.numbers:
        shown.add_row(name, f"{value:.5g}", unit, remark)
    out.print(shown)
    if report.periods:
        columns = ["period", "value", "unit"] + (["after the run"] if loaded.time else [])
        shown = _table("\nPeriods, and the amplitude that the scheme and its step leave of a free motion", *columns)
        for name, period in report.periods.items():
            rest = [f"{100 * remaining_amplitude(period, loaded):.1f} %"] if loaded.time else []
            shown.add_row(name, f"{period:.5g}", "s", *rest)
        out.print(shown)
    for warning in report.warnings:
        out.print(f"[yellow]Warning:[/yellow] {warning}", soft_wrap=True)


@app.command()
def static(scene: SceneArgument, folder: OutOption = None, assign: SetOption = None):
    """Equilibrium without waves, written to static.nc.  Example: dolfbuoy static short --out calm"""
    from ..api import solve_static
    from ..results.summary import static_warnings

    folder, loaded = _folder(scene, folder), _load(scene, assign)
    record = solve_static(loaded, out=folder)
    if _rank() == 0:
        shown = _table(f"Equilibrium, {folder / 'static.nc'}", "quantity", "value", "unit")
        for variable in record.data_vars.values():
            if variable.ndim == 0 or variable.dims == ("xyz",):
                value = " ".join(f"{v:.6g}" for v in variable.values.ravel())
                shown.add_row(variable.attrs["long_name"], value, variable.attrs["units"])
        out.print(shown)
        for warning in static_warnings(record, loaded):
            out.print(f"[yellow]Warning:[/yellow] {warning}", soft_wrap=True)


@app.command()
def run(
    scene: Annotated[str | None, typer.Argument(metavar="SCENE", help="Name of a shipped scene, or path.")] = None,
    folder: OutOption = None,
    t_end: Annotated[float | None, typer.Option("--t-end", help="End of the run [s].")] = None,
    assign: SetOption = None,
    plot: Annotated[bool, typer.Option("--plot/--no-plot", help="Draw the figures.")] = True,
    accuracy: Annotated[str | None, typer.Option("--accuracy", help="Find the settings first; see advise.")] = None,
    quantity: QuantityOption = "tension_top",
    resume: Annotated[
        Path | None, typer.Option("--resume", metavar="DIR", help="Go on with a run that was stopped, or lengthen it.")
    ] = None,
):
    """Run a scene in time.  Example: dolfbuoy run short --t-end 20 --set waves.amplitude=1"""
    from ..api import simulate
    from ..model.feasible import check_feasible

    if (scene is None) == (resume is None):
        raise InputError("run needs either a SCENE or --resume DIR.")
    end = {} if t_end is None else {"time.end": t_end}
    if resume is not None:
        if folder is not None or assign or accuracy is not None:
            raise InputError("--resume goes on with a run as it is: it allows --t-end, no --out, --set or --accuracy.")
        point = _checkpoint(resume, t_end)
        if point is None:
            return
        loaded, folder, source = point.scene, resume, {"resume": resume, **end}
    else:
        loaded = _load(scene, assign, **end)
        check_feasible(loaded)
        if accuracy is not None:
            loaded = _advised(loaded, quantity, accuracy)
        folder = _folder(scene, folder)
        source = {"scene": loaded, "out": folder}
    _say_if_one_rank_is_faster(loaded)
    bar = _Bar(loaded)
    try:
        with bar:
            record = simulate(progress=bar.update, **source)
    except BaseException:
        if interruption.received():
            raise Interrupted(folder) from None
        raise
    if _rank() != 0:
        return
    _print_summary(record, loaded, folder)
    if plot:
        _draw(folder)


def _checkpoint(folder, t_end):
    """Where a stopped run goes on; None, said so, when it is complete."""
    from mpi4py import MPI

    from ..results.checkpoint import load

    point = load(folder, MPI.COMM_WORLD.size, t_end)
    if point.complete and _rank() == 0:
        out.print(f"The run in {folder} is already complete: t = {point.t:g} s; --t-end lengthens it.", soft_wrap=True)
    return None if point.complete else point


def _say_if_one_rank_is_faster(scene):
    from mpi4py import MPI

    from ..results.summary import sharing_note

    note = sharing_note(scene, MPI.COMM_WORLD.size)
    if note and _rank() == 0:
        err.print(note, soft_wrap=True, highlight=False)


@app.command()
def advise(
    scene: SceneArgument,
    quantity: QuantityOption = "tension_top",
    accuracy: Annotated[str, typer.Option("--accuracy", help="For example 1% or 0.01.")] = "1%",
    write: Annotated[Path | None, typer.Option("--write", metavar="FILE", help="Save the advised scene.")] = None,
    folder: OutOption = None,
    assign: SetOption = None,
):
    """Cheapest settings that meet an accuracy, by a pilot.  Example: dolfbuoy advise short --accuracy 1%"""
    folder = folder if folder is not None else Path("results") / f"advise-{Path(scene).stem}"
    _advised(_load(scene, assign), quantity, accuracy, folder, write)


def _advised(scene, quantity, accuracy, folder=None, write=None):
    """The scene with settings of this accuracy; says what was chosen."""
    from ..results.compare import parse_accuracy
    from ..studies.accuracy import advise as study

    def say(text):
        out.print(text, soft_wrap=True, highlight=False, markup=False)

    found = study.advise_all(scene, quantity, parse_accuracy(accuracy), say)
    if _rank() != 0:
        return found
    study.report(found, folder, write)
    return found.scene


@app.command()
def report(
    folder: Annotated[Path, typer.Option("--out", help="Folder of the report.")] = Path("results/report"),
    quick: Annotated[bool, typer.Option("--quick", help="A trial of some minutes; not to be quoted.")] = False,
):
    """What accuracy costs: figures, tables, recommendations.  Example: dolfbuoy report --out results/report"""
    from ..studies.accuracy.report import run as write_report

    write_report(folder, quick)


@app.command()
def plot(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run.")]):
    """Figures (PNG, SVG) and ParaView files of a run.  Example: dolfbuoy plot results/short"""
    if not (folder / "results.nc").is_file():
        raise InputError(f"{folder} is not the folder of a run: it has no results.nc.")
    _draw(folder)


@app.command()
def sweep(
    scene: SceneArgument,
    vary: Annotated[
        list[str] | None, typer.Option("--vary", metavar="KEY=VALUES", help="a,b,c or start:stop:step.")
    ] = None,
    table: Annotated[Path | None, typer.Option("--table", help="CSV file, a row per case, keys in its header.")] = None,
    folder: OutOption = None,
):
    """Many variants of a scene.  Example: mpirun -n 2 dolfbuoy sweep short --vary waves.amplitude=0.5:1.5:0.5"""
    from ..studies.sweep import sweep as run_all

    folder = folder if folder is not None else Path("results") / f"sweep-{Path(scene).stem}"
    try:
        dataset = run_all(scene, vary or [], table, folder)
    except BaseException:
        if interruption.received():
            raise Interrupted(folder, "the same command") from None
        raise
    if dataset is None:
        return
    keys = [key.replace(".", "_") for key in dataset.attrs["varied"].split(", ")]
    shown = [n for n in ("tension_top_maximum", "tension_anchor_maximum", "cone_angle_maximum") if n in dataset]
    titles = [f"{n.replace('_', ' ').replace('maximum', 'max')} ({dataset[n].attrs['units']})" for n in shown]
    names = [key.replace("_", " ") for key in keys]  # words may be wrapped
    result = _table(f"{len(dataset.case)} cases, {folder / 'sweep.nc'}", *names, *titles, "status")
    for i in range(dataset.sizes["case"]):
        row = dataset.isel(case=i)
        result.add_row(*(str(row[k].item()) for k in keys), *(f"{row[n].item():.5g}" for n in shown), row.status.item())
    out.print(result)
    if not (dataset.status == "done").any():
        raise typer.Exit(1)


@app.command()
def doctor():
    """Versions, and whether forms compile, SNES solves and MPI starts.  Example: dolfbuoy doctor"""
    from ..solver import compat
    from .doctor import examine

    shown = _table("Versions", "package", "version")
    for name, version in compat.versions().items():
        shown.add_row(name, version)
    out.print(shown)
    out.print(f"compiled forms are kept in {compat.jit_cache()}\n", soft_wrap=True)
    results = examine()
    for name, passed, found in results:
        out.print(f"{'[green]ok[/green]    ' if passed else '[red]FAILED[/red]'} {name}: {found}", soft_wrap=True)
    if not all(passed for _, passed, _ in results):
        raise typer.Exit(1)


language.add_to(app)


def _draw(folder):
    from ..results.figures import draw_all
    from ..results.paraview import export

    files = [*draw_all(folder), *export(folder)]
    out.print(f"{len(files)} files in {folder / 'figures'} and {folder / 'paraview'}")


class _Bar:
    """Progress of a run on rank 0: simulated time, speed against real time, Newton iterations per step."""

    def __init__(self, scene):
        self.end = scene.time.end if scene.time else 0.0
        self.visible = _rank() == 0
        self.steps = self.iterations = 0
        self.progress = Progress(
            TextColumn("t = {task.completed:.2f} of {task.total:g} s"),
            BarColumn(bar_width=20),
            TextColumn("{task.fields[speed]:.1f} x real time, {task.fields[newton]:.2f} Newton/step"),
            TimeRemainingColumn(compact=True),
            console=err,
            disable=not self.visible,
        )

    def __enter__(self):
        self.progress.__enter__()
        self.task = self.progress.add_task("", total=self.end, speed=0.0, newton=0.0)
        return self

    def update(self, simulation, iterations):
        self.steps += 1
        self.iterations += iterations
        elapsed = self.progress.tasks[0].elapsed or 0.0
        speed = simulation.t / elapsed if elapsed > 0 else 0.0
        newton = self.iterations / self.steps
        self.progress.update(self.task, completed=simulation.t, speed=speed, newton=newton)

    def __exit__(self, *exception):
        return self.progress.__exit__(*exception)


def _print_summary(record, scene, folder):
    from ..results.summary import summary, warnings

    shown = _table(f"\n{scene.title or 'Run'}, {folder / 'results.nc'}", "quantity", "value", "unit")
    for name, value, unit in summary(record, scene):
        shown.add_row(name, value, unit)
    out.print(shown)
    for warning in warnings(record, scene):
        out.print(f"[yellow]Warning:[/yellow] {warning}", soft_wrap=True)


class Interrupted(Exception):
    """Ctrl-C or SIGTERM in the middle of a run; holds the folder of the results and the command that goes on."""

    def __init__(self, folder, advice=None):
        self.folder, self.advice = folder, advice or f"dolfbuoy run --resume {folder}"


def main():
    """Entry point: every way to end, and its exit code."""
    ranks.only_first_speaks()
    interruption.listen()
    try:
        app(standalone_mode=True)
    except InputError as error:
        _fail(f"Error: {error}", 2)
    except SolveError as error:
        _fail(f"The solve failed. {error}", 1)
    except BrokenPipeError:  # somebody's `| head` has read enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except Interrupted as stop:
        _fail(f"Interrupted; what was computed until now is in {stop.folder}, and {stop.advice} goes on.", 130)
    except OSError as error:
        place = f" {printable(str(error.filename))}" if error.filename else ""
        _fail(f"Error: cannot read or write{place}: {error.strerror or error}.", 1)
    except Exception:
        if interruption.received():
            _fail("Interrupted.", 130)
        if not ranks.several():
            raise
        _fail(f"{traceback.format_exc()}Error on rank {_rank()}; this is a fault of the program.", 1)


def _fail(message, code):
    ranks.end(lambda: err.print(message, soft_wrap=True, highlight=False, markup=False), code)


if __name__ == "__main__":
    main()

"""Command line: parse, call, print."""

import logging
import os
import sys
import traceback
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from .. import __version__
from ..errors import InputError, NotAccurate, SolveError, missing, printable
from ..parallel import interruption, ranks
from ..parallel.ranks import rank
from ..results.tables import out, unit_of
from ..writing import refuse_present, replacing
from . import shared as cli
from .app import app
from .run import draw, run
from .shared import err


def _print_version(requested: bool) -> None:
    if requested:
        out.print(f"dolfbuoy {__version__}", highlight=False)
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Options that go before a command."""


@app.command("list")
def list_scenes() -> None:
    """Shipped scenes.  Example: dolfbuoy list"""
    import tomllib

    from ..scene import shipped_scenes

    titles = [(name, tomllib.loads(path.read_text())["title"]) for name, path in shipped_scenes().items()]
    cli.print_table("Shipped scenes", ("name", "title"), titles)


@app.command()
def check(scene: cli.SceneArgument, assign: cli.SetOption = None) -> None:
    """Effects, derived numbers and warnings of a scene.  Example: dolfbuoy check short --set waves.amplitude=2"""
    loaded = cli.load(scene, assign)  # before the imports: a fault of the scene is shown without dolfinx too
    from ..check import check as examine
    from ..results.summary import remaining_amplitude

    report = examine(loaded)
    out.print(f"[bold]{escape(loaded.title or printable(scene))}[/bold]\neffects: {', '.join(report.effects)}\n")
    rows = []
    for name, value, unit, remark in report.numbers:
        unit, factor = unit_of(value, unit)
        rows.append([name, f"{factor * value:.5g}", unit, remark])
    cli.print_table("Derived numbers", ("quantity", "value", "unit", "remark"), rows)
    if report.periods:
        columns = ["period", "value", "unit"] + (["after the run"] if loaded.time else [])
        rows = [[name, f"{period:.5g}", "s"] for name, period in report.periods.items()]
        for row, period in zip(rows, report.periods.values(), strict=True):
            row += [f"{100 * remaining_amplitude(period, loaded):.1f} %"] if loaded.time else []
        cli.print_table(
            "\nPeriods, and the amplitude that the scheme and its step leave of a free motion", columns, rows
        )
    cli.say_warnings(report.warnings)


@app.command()
def static(
    scene: cli.SceneArgument,
    folder: cli.OutOption = None,
    assign: cli.SetOption = None,
    overwrite: cli.OverwriteOption = False,
) -> None:
    """Equilibrium without waves, written to static.nc.  Example: dolfbuoy static short --out calm"""
    from ..api import solve_static
    from ..results.summary import static_rows, static_warnings

    folder, loaded = cli.folder_of(scene, folder), cli.load(scene, assign)
    record = solve_static(loaded, out=folder, overwrite=overwrite)
    if rank() == 0:
        title = f"Equilibrium, {folder / 'static.nc'}"
        cli.print_table(title, ("quantity", "value", "unit"), static_rows(record, loaded))
        cli.print_criteria(record, loaded)
        cli.say_warnings(static_warnings(record, loaded))


app.command()(run)


@app.command()
def advise(
    scene: cli.SceneArgument,
    quantity: Annotated[
        str | None,
        typer.Option(
            "--quantity", help="Of the rms of tension_top \\[default], tension_anchor, buoy_position or cone_angle."
        ),
    ] = None,
    accuracy: Annotated[str, typer.Option("--accuracy", help="For example 1% or 0.01.")] = "1%",
    of: Annotated[
        str | None, typer.Option("--of", help="Of these outputs instead, with commas, as tension_top.max,anchor.max.")
    ] = None,
    write: Annotated[Path | None, typer.Option("--write", metavar="FILE", help="Save the advised scene.")] = None,
    folder: Annotated[Path | None, cli.out_option("results/advise-NAME")] = None,
    assign: cli.SetOption = None,
    overwrite: cli.OverwriteOption = False,
) -> None:
    """Cheapest settings that meet an accuracy, by a pilot.  Example: dolfbuoy advise short --accuracy 1%"""
    from .. import api  # noqa: F401  # what a run needs is there, before a folder is made
    from ..elsewhere import MPI
    from ..model.feasible import check_feasible
    from ..results.compare import parse_accuracy
    from ..results.folder import claimed
    from ..studies.accuracy import advise as study
    from ..studies.accuracy import cheapest

    loaded, wanted = cli.load(scene, assign), parse_accuracy(accuracy)
    check_feasible(loaded)
    outputs = of.split(",") if of is not None else []
    if outputs and quantity is not None:
        raise InputError(f"--of {of}: does not go with --quantity, in whose place it is.")
    if outputs:
        cheapest.requested(loaded, outputs, wanted)
    folder = cli.folder_of(scene, folder, "advise")
    if write is not None and not write.is_dir():
        refuse_present([write], overwrite)
    if write is not None and (write.is_dir() or not os.access(write.parent, os.W_OK)):
        raise InputError(f"--write {write}: must be a file, not a folder, where one can be written.")
    with claimed(folder, MPI.COMM_WORLD):
        found = study.advise_all(loaded, quantity or "tension_top", wanted, cli.say, of=outputs)
        if isinstance(found, study.Advice):
            study.report(found, folder)
        elif isinstance(found, cheapest.Verified):
            cheapest.report(found, folder)
        else:
            return  # the advice is on rank 0
        if write is not None:
            with replacing(write) as part:
                found.scene.save(part)


@app.command()
def report(
    folder: Annotated[Path | None, typer.Argument(metavar="DIR", help="Folder of a run or a sweep.")] = None,
    out: Annotated[Path | None, typer.Option("--out", hidden=True)] = None,
) -> None:
    """Report of a run or a sweep, to sign: inputs, criteria, figures.  Example: dolfbuoy report results/short"""
    if folder is None or out is not None:
        raise InputError(
            "DIR: must be the folder of a run or a sweep; the price of accuracy is dolfbuoy study accuracy."
        )
    if rank() != 0:
        return
    from ..page.report import report_of
    from ..results.folder import enlist
    from ..writing import write_text

    kind, text = report_of(folder)
    file = folder / "report.html"
    enlist(folder, [file], kind)
    write_text(file, text)
    cli.say(f"report to print and to sign: {file}")


@app.command()
def plot(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run.")],
    paraview: cli.ParaviewOption = False,
    svg: cli.SvgOption = False,
    instants: cli.InstantsOption = 50,
) -> None:
    """Figures of a run, and files for ParaView.  Example: dolfbuoy plot results/short"""
    from ..results.checkpoint import read_scene
    from ..results.folder import is_edited

    if not os.path.isfile(folder / "results.nc"):  # false too for a name that is too long
        raise InputError(f"{folder} is not the folder of a run: it has no results.nc.")
    if (folder / "scene.toml").is_file() and is_edited(folder, read_scene(folder)):
        cli.say_warnings(
            [f"{folder / 'scene.toml'} is no longer the scene of the run: figures and record may disagree."]
        )
    draw(folder, paraview, instants, svg)


@app.command()
def page(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run, of modes, a sweep or a study.")],
) -> None:
    """One HTML file to look at and to send, of a run, modes, sweep or study.  Example: dolfbuoy page results/short"""
    cli.page_of(None, folder)


@app.command()
def doctor() -> None:
    """Versions, and whether forms compile, SNES solves and MPI starts.  Example: dolfbuoy doctor"""
    from .doctor import examine, installed

    compat = installed()
    cli.print_table("Versions", ("package", "version"), compat.versions().items())
    cli.say(f"compiled forms are kept in {compat.jit_cache()}\n")
    results = examine()
    for name, passed, found in results:
        out.print(f"{'[green]ok[/green]    ' if passed else '[red]FAILED[/red]'} {name}: {found}", soft_wrap=True)
    if not all(passed for _, passed, _ in results):
        raise typer.Exit(1)


def main() -> None:
    """Entry point: every way to end, and its exit code."""
    interruption.listen()
    try:
        ranks.only_first_speaks()
        if sys.stderr.isatty():  # somebody looks on: say what takes long
            log = logging.getLogger("dolfbuoy")
            log.addHandler(logging.StreamHandler())
            log.setLevel(25)  # solver.jit.NOTICE, without its import
            log.propagate = False
        app(standalone_mode=True)
    except InputError as error:
        _fail(f"Error: {error}", 2)
    except NotAccurate as error:
        _fail(str(error), 4)
    except SolveError as error:
        _fail(f"The solve failed. {error}", 1)
    except ImportError as error:
        if missing(error) is None:
            raise
        _fail(f"Error: {missing(error)}", 2)
    except BrokenPipeError:  # somebody's `| head` has read enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except cli.Interrupted as stop:
        _fail(str(stop), 130)
    except SystemExit:
        if interruption.received():  # typer, interrupted while it reads the command line, prints nothing
            _fail("Interrupted.", 130)
        raise
    except KeyboardInterrupt:
        _fail("Interrupted.", 130)
    except OSError as error:
        place = f" {printable(str(error.filename))}" if error.filename else ""
        _fail(f"Error: cannot read or write{place}: {error.strerror or error}.", 1)
    except UnicodeEncodeError as error:  # netCDF takes names of files only so
        name = error.object[error.start : error.end]
        _fail(f"Error: {printable(name)!r} in a name is no {error.encoding}: rename it, or set LC_ALL=C.UTF-8.", 2)
    except Exception:
        if interruption.received():
            _fail("Interrupted.", 130)
        if not ranks.several():
            raise
        _fail(f"{traceback.format_exc()}Error on rank {rank()}; this is a fault of the program.", 1)


def _fail(message: str, code: int) -> None:
    message += "" if message.endswith(".") else "."
    try:
        sys.stdout.flush()
    except OSError:  # what cannot be written would make another exit code of Python's own attempt at the end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    ranks.end(lambda: err.print(message, soft_wrap=True, highlight=False, markup=False), code)


if __name__ == "__main__":
    main()

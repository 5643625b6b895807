"""`dolfbuoy study ...`: what is measured of a scene, or of the elements, over many independent cases."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from .app import Checked, app
from .shared import SceneArgument, out_option

studies = typer.Typer(
    cls=Checked, no_args_is_help=True, help="Studies.  Example: mpirun -n 2 dolfbuoy study convergence"
)
app.add_typer(studies, name="study")

Out = Annotated[Path | None, out_option("results/study-NAME")]
Text = str | None


def _end_of_runs(periods: int) -> Any:
    """The option --t-end, by default so many periods after the ramp."""
    return typer.Option("--t-end", help=f"End of the runs \\[default: ramp + {periods} periods].")


def _run(name: str, study: Callable[..., Any], out: Path | None, **options: Any) -> None:
    """Run a study in its folder; exit code 1 if it does not pass."""
    from ..studies.study import run_command

    if not run_command(name, study, out, **options):
        raise typer.Exit(1)


@studies.command("inf-sup")
def inf_sup(out: Out = None) -> None:
    """Inf-sup constant of the linearised cable: which pairs are stable.  Example: dolfbuoy study inf-sup"""
    from ..studies.accuracy import inf_sup as module

    _run("inf-sup", module.study, out)


@studies.command()
def convergence(
    out: Out = None,
    figure: Annotated[str, typer.Option(help="2, 3, 4 or all.")] = "all",
    cells: Annotated[str, typer.Option(help="Numbers of elements.")] = "2,4,8,16,32,64",
) -> None:
    """Figs. 2 to 4: errors and orders of the static cable.  Example: dolfbuoy study convergence --figure 3"""
    from ..studies.accuracy import convergence as module

    wanted = {"figures": module.parse_figures(figure), "cells": module.parse_cells(cells)}
    _run("convergence", module.study, out, **wanted)


@studies.command()
def bending(out: Out = None) -> None:
    """Orders of lines that bend: places, forces, frequencies.  Example: dolfbuoy study bending"""
    from ..studies.accuracy import bent as module

    _run("bending", module.study, out)


@studies.command("hard-cases")
def hard_cases(
    only: Annotated[str | None, typer.Option(metavar="NAME", help="Names that begin so.")] = None,
    slow: Annotated[bool, typer.Option("--slow", help="The expensive ones too.")] = False,
    out: Out = None,
) -> None:
    """Hard scenes, and what the program makes of each; exit code 1 if one fails.  Example: dolfbuoy study hard-cases"""
    from ..studies import hard_cases as module

    _run("hard-cases", module.study, out, only=only, slow=slow)


@studies.command("work-precision")
def work_precision(
    scene: SceneArgument,
    t_end: Annotated[float | None, _end_of_runs(4)] = None,
    pairs: Annotated[Text, typer.Option(help="\\[default: 1-0,2-1,3-2]")] = None,
    cells: Annotated[Text, typer.Option(help="\\[default: 1/4, 1/2 and all of the scene's]")] = None,
    schemes: Annotated[Text, typer.Option(help="\\[default: all three]")] = None,
    steps: Annotated[Text, typer.Option(help="\\[default: period / 500, 250, 100, 50]")] = None,
    tolerances: Annotated[str, typer.Option(help="Of adaptive steps, or none.")] = "1e-3,1e-4,1e-5",
    newton: Annotated[str, typer.Option(help="Newton's tolerances.")] = "1e-9,1e-5",
    repeats: Annotated[int, typer.Option(min=1, max=100, help="The median of their times counts.")] = 3,
    out: Out = None,
) -> None:
    """Error against time: pairs, cells, schemes, steps, Newton's tolerance.  Example: dolfbuoy study work-precision short --repeats 1"""  # noqa: E501
    from ..studies.accuracy import work_precision as module

    wanted = module.request(scene, t_end, pairs, cells, schemes, steps, tolerances, newton, repeats)
    _run("work-precision", module.study, out, **wanted)


@studies.command()
def effects(
    scene: SceneArgument,
    t_end: Annotated[float | None, _end_of_runs(2)] = None,
    threshold: Annotated[str, typer.Option(help="Change below which an effect is in vain.")] = "1%",
    out: Out = None,
) -> None:
    """Change and cost of each effect of a scene.  Example: dolfbuoy study effects short --t-end 15"""
    from ..studies.physics import effects as module

    _run("effects", module.study, out, **module.request(scene, t_end, threshold))


@studies.command()
def energy(
    scene: Annotated[str | None, typer.Argument(metavar="SCENE", help="Default: driven and short.")] = None,
    t_end: Annotated[float | None, typer.Option("--t-end", help="End of the runs \\[s].")] = None,
    steps: Annotated[str | None, typer.Option(help="\\[default: 0.04,0.02,0.01]")] = None,
    out: Out = None,
) -> None:
    """Work in = dissipated + stored, up to the scheme's order.  Example: dolfbuoy study energy driven --t-end 15"""
    from ..scene.settings import parse_numbers
    from ..studies.physics import energy as module

    _run("energy", module.study, out, scene=scene, t_end=t_end, steps=parse_numbers("--steps", steps))


@studies.command()
def hull(
    scene: SceneArgument,
    runs: Annotated[
        str, typer.Option(help="Periods \\[s] at which runs in time check the response; or none.")
    ] = "4,6,9,14",
    direction: Annotated[
        float | None, typer.Option(help="Towards which the waves run, from x \\[deg; default: as in the scene].")
    ] = None,
    capytaine: Annotated[
        Path | None, typer.Option(metavar="FILE", help="netCDF file of Capytaine, of the free buoy about C.")
    ] = None,
    out: Out = None,
) -> None:
    """A hull afloat and in small waves: hydrostatics, natural periods, response.  Example: dolfbuoy study hull short"""
    from ..studies.physics import hull as module

    _run("hull", module.study, out, **module.request(scene, runs, direction, capytaine))


@studies.command()
def accuracy(
    out: Out = None,
    quick: Annotated[bool, typer.Option("--quick", help="A trial of some minutes; not to be quoted.")] = False,
) -> None:
    """The price of accuracy: figures, tables, recommendations.  Example: dolfbuoy study accuracy --out results/a"""
    from ..elsewhere import MPI
    from ..results.folder import claimed
    from ..studies.accuracy.report import run

    folder = out or Path("results/study-accuracy")
    with claimed(folder, MPI.COMM_WORLD):
        run(folder, quick)

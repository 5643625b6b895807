"""`dolfbuoy study ...`: one command per study."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True, help="Studies.  Example: mpirun -n 2 dolfbuoy study convergence")

OutOption = Annotated[Path | None, typer.Option("--out", help="Folder of the results [default: results/study-NAME].")]


def folder_of(name: str, folder: Path | None) -> Path:
    """Folder of a study's results."""
    return folder if folder is not None else Path("results") / f"study-{name}"


@app.command("inf-sup")
def inf_sup(folder: OutOption = None):
    """Inf-sup constant of the linearised cable: which pairs are stable.  Example: dolfbuoy study inf-sup"""
    from ..studies import inf_sup as study

    study.run(folder_of("inf-sup", folder))


@app.command("explicit-limit")
def explicit_limit(
    scene: Annotated[str | None, typer.Argument(metavar="[SCENE]", help="Default: the cables of the paper.")] = None,
    folder: OutOption = None,
):
    """Step an explicit method would need, Eq. (24), beside the implicit one.  Example: dolfbuoy study explicit-limit"""
    from ..studies import explicit_limit as study

    study.run(folder_of("explicit-limit", folder), scene)


@app.command()
def convergence(
    folder: OutOption = None,
    figure: Annotated[str, typer.Option("--figure", help="2, 3, 4 or all.")] = "all",
    cells: Annotated[str, typer.Option("--cells", help="Numbers of elements.")] = "2,4,8,16,32,64",
):
    """Figs. 2 to 4: errors and orders of the static cable.  Example: dolfbuoy study convergence --figure 3"""
    from ..studies import convergence as study

    study.run(folder_of("convergence", folder), study.parse_figures(figure), study.parse_cells(cells))


@app.command()
def rising(
    folder: OutOption = None,
    pair: Annotated[str | None, typer.Option("--pair", metavar="MU,NU", help="A pair besides the paper's.")] = None,
    cells: Annotated[int | None, typer.Option("--cells", help="Number of elements of that pair.")] = None,
):
    """Fig. 5: a folded cable whose end rises.  Example: dolfbuoy study rising --pair 2,0 --cells 20"""
    from ..studies import rising as study

    study.run(folder_of("rising", folder), study.parse_pair(pair, cells))


@app.command()
def slack(
    t_end: Annotated[float, typer.Option("--t-end", min=15.0, help="End of the runs with snap loads [s].")] = 30.0,
    folder: OutOption = None,
):
    """Compressed or slack: a folded cable and snap loads under both laws.  Example: dolfbuoy study slack"""
    from ..studies import slack as study

    study.run(folder_of("slack", folder), t_end)


@app.command("hard-cases")
def hard_cases(
    only: Annotated[str | None, typer.Option("--only", metavar="NAME", help="Names that begin so.")] = None,
    slow: Annotated[bool, typer.Option("--slow", help="The expensive ones too.")] = False,
    folder: OutOption = None,
):
    """Hard scenes, and what the program makes of each; exit code 1 if one fails.  Example: dolfbuoy study hard-cases"""
    from ..studies import hard_cases as study

    if not study.run(folder_of("hard-cases", folder), only, slow):
        raise typer.Exit(1)


@app.command()
def regularisation(
    scene: Annotated[str, typer.Argument(metavar="[SCENE]", help="Shipped name, or path of a TOML file.")] = "short",
    t_end: Annotated[float, typer.Option("--t-end", min=0.0, help="End of the runs [s].")] = 15.0,
    folder: OutOption = None,
):
    """What rounding off |v| and the wet section changes.  Example: dolfbuoy study regularisation short"""
    from ..studies import regularisation as study

    study.run(folder_of("regularisation", folder), study.load(scene, t_end))


@app.command("work-precision")
def work_precision(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Name of a shipped scene, or path of a TOML file.")],
    t_end: Annotated[float | None, typer.Option("--t-end", help="End of the runs [default: ramp + 4 periods].")] = None,
    pairs: Annotated[str | None, typer.Option("--pairs", help="[default: 1-0,2-1,3-2]")] = None,
    cells: Annotated[str | None, typer.Option("--cells", help="[default: 1/4, 1/2 and all of the scene's]")] = None,
    schemes: Annotated[str | None, typer.Option("--schemes", help="[default: all three]")] = None,
    steps: Annotated[str | None, typer.Option("--steps", help="[default: period / 500, 250, 100, 50]")] = None,
    tolerances: Annotated[str, typer.Option("--tolerances", help="Of adaptive steps, or none.")] = "1e-3,1e-4,1e-5",
    repeats: Annotated[int, typer.Option("--repeats", min=1, help="The median of their times counts.")] = 3,
    folder: OutOption = None,
):
    """Error against time: pairs, cells, schemes, steps.  Example: dolfbuoy study work-precision short --repeats 1"""
    from ..studies import work_precision as study

    study.run(
        folder_of("work-precision", folder),
        study.load(scene, t_end),
        study.parse_pairs(pairs),
        study.parse_numbers("--cells", cells, int),
        study.parse_schemes(schemes),
        study.parse_numbers("--steps", steps),
        study.parse_numbers("--tolerances", tolerances),
        repeats,
    )


@app.command()
def effects(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Name of a shipped scene, or path of a TOML file.")],
    t_end: Annotated[float | None, typer.Option("--t-end", help="End of the runs [default: ramp + 2 periods].")] = None,
    threshold: Annotated[str, typer.Option("--threshold", help="Change below which an effect is in vain.")] = "1%",
    folder: OutOption = None,
):
    """What each effect of a scene changes and costs.  Example: dolfbuoy study effects short --t-end 15"""
    from ..studies import effects as study

    study.run(folder_of("effects", folder), *study.load(scene, t_end, threshold))


@app.command()
def energy(
    scene: Annotated[str | None, typer.Argument(metavar="[SCENE]", help="Default: driven and short.")] = None,
    t_end: Annotated[float | None, typer.Option("--t-end", help="End of the runs [s].")] = None,
    steps: Annotated[str | None, typer.Option("--steps", help="[default: 0.04,0.02,0.01]")] = None,
    folder: OutOption = None,
):
    """Work in = dissipated + stored, up to the scheme's order.  Example: dolfbuoy study energy driven --t-end 15"""
    from ..studies import energy as study
    from ..studies.work_precision import parse_numbers

    study.run(folder_of("energy", folder), scene, t_end, parse_numbers("--steps", steps))


@app.command()
def endurance(
    scene: Annotated[str, typer.Argument(metavar="[SCENE]", help="Of a moored buoy in waves.")] = "short",
    duration: Annotated[float, typer.Option("--duration", help="Length of the run [s].")] = 10000.0,
    step: Annotated[float, typer.Option("--step", help="Time step [s].")] = 0.1,
    scheme: Annotated[str, typer.Option("--scheme", help="Of second order, or the step must be small.")] = "bdf2",
    window: Annotated[float, typer.Option("--window", help="Whole periods [s].")] = 1000.0,
    skip: Annotated[int, typer.Option("--skip", min=0, help="Windows in which the start dies out.")] = 1,
    tolerance: Annotated[
        float, typer.Option("--tolerance", help="Allowed change between windows, of the range.")
    ] = 1e-6,
    folder: OutOption = None,
):
    """A long run without drift or growth.  Example: dolfbuoy study endurance short --duration 300 --window 50"""
    from ..studies import endurance as study

    loaded = study.load(scene, duration, step, scheme)
    if not study.run(folder_of("endurance", folder), loaded, window, skip, tolerance):
        raise typer.Exit(1)


@app.command("step-cost")
def step_cost(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Name of a shipped scene, or path of a TOML file.")],
    steps: Annotated[int, typer.Option("--steps", min=10, help="Steps to measure.")] = 1000,
    folder: OutOption = None,
):
    """Where the time of a Newton iteration goes, beside its floor.  Example: dolfbuoy study step-cost short"""
    from ..studies import step_cost as study

    study.run(folder_of("step-cost", folder), scene, steps)

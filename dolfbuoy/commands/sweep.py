"""`dolfbuoy sweep`: many variants of a scene, at once or in parts that a cluster runs, and how far they are."""

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from ..errors import InputError
from ..parallel import interruption, ranks
from ..parallel.ranks import rank
from ..results.tables import rounded, unit_of
from . import shared as cli
from .app import app

if TYPE_CHECKING:
    import xarray as xr

VaryOption = Annotated[list[str] | None, typer.Option("--vary", metavar="KEY=VALUES", help="a,b,c or start:stop:step.")]
TableOption = Annotated[Path | None, typer.Option("--table", help="CSV file, a row per case, keys in its header.")]
PartOption = Annotated[
    str | None, typer.Option("--part", metavar="I/N", help="Every N-th case from the I-th on, next to other parts.")
]
StatusOption = Annotated[bool, typer.Option("--status", help="Show how far it is, and run nothing.")]
CollectOption = Annotated[bool, typer.Option("--collect", help="Make sweep.nc of what is there, and run nothing.")]
RetryOption = Annotated[Literal["failed"] | None, typer.Option("--retry", help="Run cases that failed once more.")]
SeedsOption = Annotated[
    int | None, typer.Option("--seeds", help="Each case so many times, with seeds of the waves of its own.")
]
LatinOption = Annotated[
    int | None, typer.Option("--latin", help="So many cases that fill --vary KEY=LOW:HIGH: a Latin hypercube.")
]
KeepOption = Annotated[
    bool, typer.Option("--keep", help="Keep the record and the page of each case, in records below --out.")
]
LimitOption = Annotated[
    float | None,
    typer.Option("--time-limit", min=0.0, help="Leave the running case with a checkpoint after so many seconds."),
]


@app.command()
def sweep(
    scene: cli.SceneArgument,
    assign: cli.SetOption = None,
    vary: VaryOption = None,
    table: TableOption = None,
    seeds: SeedsOption = None,
    latin: LatinOption = None,
    folder: Annotated[Path | None, cli.out_option("results/sweep-NAME")] = None,
    part: PartOption = None,
    status: StatusOption = False,
    collect: CollectOption = False,
    retry: RetryOption = None,
    limit: LimitOption = None,
    keep: KeepOption = False,
) -> None:
    """Many variants of a scene.  Example: mpirun -n 2 dolfbuoy sweep short --vary waves.amplitude=0.5:1.5:0.5"""
    if status and collect:
        raise InputError("--status: shows how far the sweep is, --collect writes what is there: give one of them.")
    if collect and part is not None:
        raise InputError("--collect: is about all parts: leave out --part.")
    loaded = cli.load(scene, assign)
    from ..studies import sweep as study

    folder = cli.folder_of(scene, folder, "sweep")
    chosen = None if part is None else study.Part.parse(part)
    wanted = (loaded, vary or [], table)
    source = shlex.join([str(scene), *(word for text in assign or [] for word in ("--set", text))])
    planned = study.plan(*wanted, seeds, latin, source)
    if status:
        _show_status(study.status(planned, folder, chosen), folder, chosen)
        return
    if collect:
        _end(study.collected(planned, folder) if rank() == 0 else None, folder)
        return
    how: dict[str, Any] = {"say": cli.say_warnings, "retry": retry is not None, "limit": limit, "keep": keep}
    try:
        if chosen is None:
            dataset = study.sweep(*wanted, folder, seeds=seeds, latin=latin, source=source, **how)
        else:
            study.run_part(planned, folder, chosen, **how)
    except interruption.TimeUp:
        raise cli.Interrupted(f"Stopped at the time limit; {_what_is_left(folder)}") from None
    except BaseException:
        if interruption.received():
            raise cli.Interrupted(f"Interrupted; {_what_is_left(folder)}") from None
        raise
    if chosen is None:
        _end(dataset, folder)
    elif rank() == 0:
        _show_status(study.status(planned, folder, chosen), folder, chosen)


def _what_is_left(folder: Path) -> str:
    left = any((folder / "cases").rglob("*.jsonl"))
    return f"{f'finished cases are in {folder}, and ' if left else ''}the same command goes on."


def _end(dataset: "xr.Dataset | None", folder: Path) -> None:
    """Show the cases; exit code 1 if none is done."""
    from ..elsewhere import MPI
    from ..results.cautions import OFTEN

    if dataset is not None:
        _show(dataset, folder)
        share = dataset.cut_steps.values
        if often := int((share > OFTEN).sum()):
            worst = int(share.argmax())
            cases = f"In {often} case{'s' if often > 1 else ''} many steps failed and were retried with smaller ones"
            most = f"most in number {worst + 1}, {100 * share[worst]:.3g} %"
            cli.say_warnings([f"{cases}, {most}: see whether its numbers stay with a smaller time.step."])
    done = dataset is not None and bool((dataset.status == "done").any())
    if not ranks.bcast(MPI.COMM_WORLD, done):
        raise typer.Exit(1)


def _show(dataset: "xr.Dataset", folder: Path) -> None:
    """Print its cases and the largest of their main quantities, of a power the mean."""
    from ..results.quantities import declared, shown_in
    from ..results.sample import LASTS
    from ..results.series import LASTING, each_series

    keys = [key.replace(".", "_") for key in dataset.attrs["varied"].split(", ")]
    found = each_series(dataset, "maximum", shown_in("sweep"))
    shown = []
    for label, name, one in found:
        quantity = declared(name)
        short = {"maximum": "max", "minimum": "min"}.get(quantity.counts, quantity.counts) if quantity.over else ""
        shown.append((f"{label} {short}".strip(), one[f"{name}_{quantity.counts}"]))
    lasting = each_series(dataset, LASTS, [name for name in shown_in("sweep") if name.startswith("tension")])
    shown += [(f"{label} for {LASTING:g} s", one[f"{name}_{LASTS}"]) for label, name, one in lasting]
    if "shortest_life" in dataset:
        shown.append(("shortest life", dataset.shortest_life))
    if "criterion_left" in dataset:
        shown.append(("left of criteria", dataset.criterion_left))
    units = [unit_of(values.values, values.attrs["units"]) for _, values in shown]
    titles = [f"{n.replace('_', ' ')} [{unit}]" for (n, _), (unit, _) in zip(shown, units, strict=True)]
    names = [key.replace("_", " ") for key in keys]  # words may be wrapped
    rows = []
    for i in range(min(dataset.sizes["case"], MOST_ROWS)):
        row = dataset.isel(case=i)
        values = [rounded(factor * of[i].item(), 5) for (_, of), (_, factor) in zip(shown, units, strict=True)]
        rows.append([*(str(row[k].item()) for k in keys), *values, row.status.item()])
    cli.print_table(f"{len(dataset.case)} cases, {folder / 'sweep.nc'}", [*names, *titles, "status"], rows)
    if dataset.sizes["case"] > MOST_ROWS:
        cli.say(f"... and {dataset.sizes['case'] - MOST_ROWS} more")
    cli.print_kept_criteria(dataset)


#: Cases that are printed.
MOST_ROWS = 1000


def _show_status(found: dict[str, Any], folder: Path, part: Any) -> None:
    """Print numbers of cases, what failed, and how long the rest takes."""
    left = found["missing"] * found["seconds"] / 3600
    begun = f"{found['begun']} of the sweep have begun; " if found["begun"] else ""
    rest = f"about {rounded(left)} h of one core" if found["done"] and found["missing"] else ""
    remarks = {"cases": "", "done": f"{rounded(found['seconds'], 3)} s each" if found["done"] else ""}
    remarks |= {"failed": "run again with --retry failed" if found["failed"] else "", "missing": f"{begun}{rest}"}
    rows = [("all" if name == "cases" else name, str(found[name]), remark) for name, remark in remarks.items()]
    cli.print_table(f"{folder}{f', {part}' if part else ''}", ("cases", "number", "remark"), rows)
    if found["reasons"]:
        reasons = sorted(found["reasons"].items(), key=lambda item: -item[1])
        headings = ("number", "status of them")
        cli.print_table("\nWhy cases failed", headings, [(str(number), reason) for reason, number in reasons])
    cli.say_warnings(found["damaged"])
    if found["foreign"]:
        cli.say_warnings([f"{found['foreign']} results are of another version of dolfbuoy, and do not count."])

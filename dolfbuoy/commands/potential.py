"""`dolfbuoy potential`: coefficients of potential flow for the hull of a scene."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from ..parallel.ranks import rank
from ..writing import refuse_present
from .app import app
from .shared import OverwriteOption, SceneArgument, SetOption, load, say, say_warnings

if TYPE_CHECKING:
    from ..formats.capytaine import Floating
    from ..scene import Scene

#: Tilt at rest from which on upright coefficients are doubtful [deg].
TILTED = 5.0


@app.command()
def potential(
    scene: SceneArgument,
    target: Annotated[Path | None, typer.Option("--out", help="File \\[default: SCENE's name, .nc].")] = None,
    buoy: Annotated[str | None, typer.Option("--buoy", help="Name of the buoy, of several.")] = None,
    around: Annotated[
        int,
        typer.Option(
            "--around", min=8, max=80, help="Panels around the axis of the coarse mesh; more where they are too few."
        ),
    ] = 32,
    assign: SetOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Radiation and diffraction of a hull at its draft at rest, by Capytaine.  Example: dolfbuoy potential disc-buoy"""
    from ..formats.capytaine import compute_usable, write

    if rank() != 0:
        return
    target = target if target is not None else Path(f"{Path(scene).stem}.nc")
    refuse_present([target], overwrite)
    data = compute_usable(_floating(load(scene, assign), buoy), around, say)
    write(data, target)
    say(f"{target}: in the scene, [buoy] potential_flow = '{target.name}'")


def _floating(scene: "Scene", name: str | None) -> "Floating":
    """The hull of a buoy as it floats at rest."""
    import numpy as np

    from ..api import solve_static
    from ..formats.capytaine import Floating
    from ..model.rigid import mass_properties, shape_of

    buoys = list(scene.network.buoys)
    if scene.sea is None or not scene.gravity or not buoys:
        raise InputError("Potential flow is that of a buoy in water: it needs [buoy], [sea] and gravity.")
    if (name is None and len(buoys) > 1) or (name is not None and name not in buoys):
        raise InputError(f"--buoy {name or ''}: must be one of {', '.join(buoys)}.")
    number = buoys.index(name) if name is not None else 0
    section, rest = scene.network.buoys[buoys[number]], solve_static(scene)
    height = mass_properties(section).height
    tilt = float(np.ravel(rest.cone_angle.values)[number])
    if tilt > TILTED:
        say_warnings([f"At rest the buoy leans by {tilt:.3g} deg; its coefficients are those of the upright hull."])
    draft = height - float(rest.buoy_position.values.reshape(-1, 3)[number, 2])
    return Floating(shape_of(section), draft, scene.sea.depth, scene.sea.density, scene.gravity)

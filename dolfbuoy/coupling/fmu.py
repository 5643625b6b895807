"""A scene as an FMU for co-simulation (FMI 3.0), which calls the dolfbuoy that made it."""

import platform
import re
import uuid
import zipfile
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple
from xml.etree import ElementTree

from ..errors import InputError
from ..scene import Scene
from ..version import __version__
from ..writing import replacing
from .library import FOLDER, build
from .paths import Pose
from .served import WINCH
from .session import Session

#: Units as exponents of the SI base units.
UNITS = {
    "s": {"s": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "rad/s": {"s": -1, "rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
}
PLACE = [("x", "m"), ("y", "m"), ("z", "m")]
TURN = [("q0", None), ("q1", None), ("q2", None), ("q3", None)]
SPEED = [("vx", "m/s"), ("vy", "m/s"), ("vz", "m/s"), ("wx", "rad/s"), ("wy", "rad/s"), ("wz", "rad/s")]
FORCE = [("fx", "N"), ("fy", "N"), ("fz", "N")]
MOMENT = [("mx", "N.m"), ("my", "N.m"), ("mz", "N.m")]


class Variable(NamedTuple):
    """A variable of the FMU; start: initial value of an input."""

    name: str
    unit: str | None
    causality: str
    description: str
    start: float | None = None


class Layout(NamedTuple):
    """Names and sizes of the FMU's variables, in the order of fmu.c."""

    driven: list[str]
    starts: list[float]
    sizes: tuple[int, int]
    free: list[str]
    cables: list[str]
    variables: list[Variable]


def layout_of(session: Session) -> Layout:
    """Layout of a session at its start."""
    network, driven = session.scene.network, list(session.paths)
    free = [name for name in network.buoys if name not in driven]
    inputs, outputs, starts = [], [], []
    for name, path in session.paths.items():
        body, here = isinstance(path, Pose), [float(x) for x in path.end[1]]
        starts += here
        if name.endswith(WINCH):
            inputs.append(Variable(f"{name}.length", "m", "input", "unstretched length", here[0]))
            outputs.append(Variable(f"{name}.tension", "N", "output", "mean tension of what is wound"))
            continue
        places = zip([*PLACE, *(TURN if body else [])], here, strict=True)
        inputs += [Variable(f"{name}.{x}", unit, "input", "place", start) for (x, unit), start in places]
        forces = [*FORCE, *(MOMENT if body else [])]
        outputs += [Variable(f"{name}.{f}", unit, "output", "pull of the lines there") for f, unit in forces]
    found = [*inputs, *outputs]
    for name in free:
        loads, motion = [*FORCE, *MOMENT], [*PLACE, *TURN, *SPEED]
        found += [Variable(f"{name}.load_{f}", unit, "input", "load at C", 0.0) for f, unit in loads]
        found += [Variable(f"{name}.{x}", unit, "output", "motion of C") for x, unit in motion]
    for end in ("top", "anchor"):
        found += [Variable(f"{name}.tension_{end}", "N", "output", f"tension at the {end}") for name in network.cables]
    sizes = len(inputs), len(outputs)
    return Layout(driven, starts, sizes, free, list(network.cables), found)


def export(scene: "Scene", target: Path, driven: Iterable[str] = ()) -> Layout:
    """Write an FMU; its file name without .fmu is the name of the model.

    driven: as for a Session.  Raises InputError for parts that cannot be driven, SolveError if the scene has no
    equilibrium, and OSError.
    """
    with Session(scene, driven=driven) as session:
        if session.comm.size > 1:
            raise InputError("An FMU is made on one rank.")
        layout = layout_of(session)
    name, token = re.sub(r"\W", "_", target.stem), f"{{{uuid.uuid4()}}}"
    name = name if name[0].isalpha() else f"scene_{name}"
    with TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "layout.h").write_text(_header(layout, token))
        library = build(folder / f"{name}.so", [FOLDER / "fmu.c"], [f"-I{folder}"])
        with replacing(target) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as file:
            file.writestr("modelDescription.xml", description(scene, layout, name, token))
            file.write(library, f"binaries/{platform.machine()}-linux/{library.name}")
            file.writestr("resources/scene.toml", scene.to_toml())
    return layout


def _header(layout: Layout, token: str) -> str:
    """Text of layout.h."""

    def strings(name: str, values: list[str]) -> str:
        shown = "".join(f'"{_escaped(value)}", ' for value in values)
        return f"static const char *const {name}[] = {{{shown}0}};"

    counts = {"OF_X": layout.sizes[0], "OF_F": layout.sizes[1], "DRIVEN_COUNT": len(layout.driven)}
    counts |= {"BUOYS": len(layout.free), "CABLES": len(layout.cables)}
    starts = "".join(f"{x!r}, " for x in layout.starts)
    lines = [f'#define TOKEN "{token}"', *(f"#define {name} {count}" for name, count in counts.items())]
    lines += [strings("DRIVEN", layout.driven), strings("FREE_BUOYS", layout.free)]
    return "\n".join([*lines, f"static const double STARTS[] = {{{starts}0}};", ""])


def _escaped(text: str) -> str:
    """A text as the bytes of a C string."""
    return "".join(f"\\{byte:03o}" for byte in text.encode())


def description(scene: "Scene", layout: Layout, name: str, token: str) -> bytes:
    """Text of modelDescription.xml."""
    facts = {"fmiVersion": "3.0", "modelName": scene.title or name, "instantiationToken": token}
    facts |= {"generationTool": f"dolfbuoy {__version__}", "variableNamingConvention": "flat"}
    root = ElementTree.Element("fmiModelDescription", facts)
    abilities = ("canGetAndSetFMUState", "canSerializeFMUState", "canHandleVariableCommunicationStepSize")
    ElementTree.SubElement(root, "CoSimulation", {"modelIdentifier": name} | dict.fromkeys(abilities, "true"))
    units = ElementTree.SubElement(root, "UnitDefinitions")
    for unit, exponents in UNITS.items():
        of_base = {base: str(power) for base, power in exponents.items()}
        ElementTree.SubElement(ElementTree.SubElement(units, "Unit", name=unit), "BaseUnit", of_base)
    time = scene.time
    if time is not None:
        ElementTree.SubElement(
            root, "DefaultExperiment", startTime="0", stopTime=str(time.end), stepSize=str(time.step)
        )
    numbers, structure = (ElementTree.SubElement(root, part) for part in ("ModelVariables", "ModelStructure"))
    known = {"valueReference": "0", "causality": "independent", "variability": "continuous", "unit": "s"}
    ElementTree.SubElement(numbers, "Float64", {"name": "time"} | known)
    known = {"valueReference": "1", "causality": "parameter", "variability": "tunable"}
    known |= {"start": "1", "min": "0", "max": "2"}
    text = (
        "inputs are places at the end of a step (0), or at its beginning: on a line (1) or parabola (2) from there on"
    )
    ElementTree.SubElement(numbers, "Int32", {"name": "extrapolation", "description": text} | known)
    outputs = []
    for number, variable in enumerate(layout.variables, 2):
        known = {"name": variable.name, "valueReference": str(number), "description": variable.description}
        known |= {"causality": variable.causality, "variability": "continuous"}
        known |= {} if variable.unit is None else {"unit": variable.unit}
        known |= {} if variable.start is None else {"start": repr(variable.start)}
        ElementTree.SubElement(numbers, "Float64", known)
        outputs += [str(number)] if variable.causality == "output" else []
    for kind in ("Output", "InitialUnknown"):
        for output in outputs:
            ElementTree.SubElement(structure, kind, valueReference=output)
    ElementTree.indent(root)
    found: bytes = ElementTree.tostring(root, "UTF-8", xml_declaration=True)
    return found

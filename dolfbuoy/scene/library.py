"""Materials by their catalogue names, and those of a user's own file.

    chain GRADE studless|studlink SIZE mm [less CORROSION mm]
    wire SIZE mm, wire IWRC SIZE mm, polypropylene SIZE mm
    polyester|nylon|HMPE SIZE mm [at LOAD %], aramid SIZE mm

SIZE is the nominal diameter d: the bar of a chain, the rope.  A scene that names one gets a [material.NAME] with its
numbers, and no longer depends on this module; keys given in a cable or segment take precedence.

- Chain.  Breaking load c d^2 (44 - 0.08 d) kN, d in mm: IACS UR W22 and DNVGL-OS-E302 (offshore, R3 to R5), IACS UR W18
  (ships, grades 1 to 3).  Mass, stiffness and the diameter of its volume: Orcina, OrcaFlex help, "Chain".  Drag on d:
  DNV-OS-E301.  `less` takes a corrosion allowance off d for the breaking load and the steel's area; mass, volume and
  stiffness are those of the new chain.
- Wire (spiral strand in a sheath), polyester, nylon and HMPE.  Mass, breaking load, stiffness and density: MoorPy,
  MoorProps_default (Hall et al., NREL); drag on d: DNV-OS-E301, added mass: Bureau Veritas NR 493.  The stiffness is
  the static one; `at LOAD %` takes the dynamic one, of a rope that waves load about a mean of so much of its breaking
  load, EA = (alpha + beta LOAD/100) MBL.
- Six-strand wire with a wire core (IWRC) and polypropylene (eight strands).  Mass, breaking load and stiffness: Orcina,
  OrcaFlex help, "Rope/wire"; they displace their steel or fibre.  IWRC breaks within 1 % of EN 12385-4, grade 1770.
- Aramid: an estimate for parallel yarns in a sheath.  Fibre, 0.33 d^2, sheath and the water in it as in Parafil ropes
  of polyester (Linear Composites, Technical Note PF1, 20 to 60 mm); it breaks at 1926 N/mm^2 of fibre (C. J. Burgoyne);
  density 1440 kg/m^3 and modulus, 78 N/tex, of Kevlar 49 (Tension Technology, yarn properties).
- Internal damping c/EA, along the line.  Chosen, not measured: none along a chain or a wire was found.  Of what
  is chosen where results were compared with measurements, 1.9 ms is the chain of Hall and Goupee 2015 (753.6 MN, 1e8
  Pa s, 133.76 mm), and 0.2 ms a chain of a model (2 N s, 10 kN: Bergdahl et al. 2015, after Lindahl).  With 5 ms the
  largest load at the anchor of a chain that comes taut in a storm is the same to 5 % with two and four times the
  elements in one sea; in another, 40 elements give 7 % more than 80 (tests/published/test_storm.py);
  with 3 ms loads are a tenth larger.  Fibre loses more: 10 ms is a
  loss factor of 0.06 at 1 Hz.  In a period of waves all of these are negligible compared with the drag.
"""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import InputError
from .floats import with_float
from .mesh_file import Named, inside

#: c [kN/mm^2].
GRADES = {"Q1": 9.81e-3, "Q2": 13.73e-3, "Q3": 19.61e-3}
GRADES |= {"R3": 0.0223, "R3S": 0.0249, "R4": 0.0274, "R4S": 0.0304, "R5": 0.0320}
#: Mass and stiffness over d^2 [kg/m^3, Pa], diameter of the volume over d, drag across and along.
LINKS = {"studless": (19.9e3, 0.854e11, 1.80, 2.4, 1.15), "studlink": (21.9e3, 1.01e11, 1.89, 2.6, 1.4)}


class Rope(NamedTuple):
    """Properties of a rope over powers of its diameter d, and over its breaking load."""

    mass: float  # over d^2 [kg/m^3]
    breaking: float  # over d^2 [Pa]
    stiffness: float  # EA over the breaking load
    volume: float  # over d^2
    drag: float = 1.6  # across
    added: float = 1.1
    cubic: float = 0.0  # of the breaking load over d^3 [N/m^3]
    dynamic: tuple[float, float] | None = None  # alpha, beta
    source: str = "MoorPy MoorProps_default, DNV-OS-E301"


_ORCINA = "OrcaFlex help, DNV-OS-E301"
ROPES = {
    "wire": Rope(5293.0, 1022e6, 97.1e9 / 1022e6, math.pi / 4 * 1.18**2, drag=1.2, added=1.0),
    "wire IWRC": Rope(3989.7, 633.358e6, 40.4e9 / 633.358e6, 3989.7 / 7850.0, drag=1.8, added=1.0, source=_ORCINA),
    "polyester": Rope(679.0, 308e6, 14.0, 679.0 / 1380.0, dynamic=(11.6, 40.0)),
    "nylon": Rope(585.0, 207e6, 5.0, 585.0 / 1140.0, cubic=230e6, dynamic=(2.08, 39.0)),
    "HMPE": Rope(496.0, 580e6, 56.0, 496.0 / 975.0, cubic=651e6, dynamic=(59.0, 54.0)),
    "aramid": Rope(775.0, 0.33 * 1926e6, 78 * 1.44e9 / 1926e6, 0.635, source="estimate by Parafil PF1 and Kevlar 49"),
    "polypropylene": Rope(452.6, 105.990e6, 1.06e9 / 105.990e6, 452.6 / 910.0, source=_ORCINA),
}
#: c/EA [s].
DAMPING = {"chain": 5e-3, "wire": 5e-3, "wire IWRC": 5e-3} | dict.fromkeys(
    ("polyester", "nylon", "HMPE", "aramid", "polypropylene"), 10e-3
)
MOST_LOAD = 60.0  # per cent of the breaking load, mean
SIZES = 5.0, 250.0  # mm
#: Available sizes [mm]: bars of chains (ISO 1704, IACS UR W22), ropes (ISO 2307 and above it steps of 8).
CHAIN_SIZES = (
    *(11, 12.5, 14, 16, 17.5, 19, 20.5, *range(22, 71, 2), 73, 76, 78, 81, 84, 87, 90, 92, 95, 97, 100, 102, 105, 107),
    *(111, 114, 117, 120, 122, 124, 127, 130, 132, 137, 142, 147, 152, 157, 162, 165, 168, 171, 175, 178, 180, 185),
)
ROPE_SIZES = (5, 6, 8, 9, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30, 32, *range(36, 81, 4), *range(88, 249, 8))
MOST_BYTES = 1_000_000

_SIZE = r"(\d+(?:\.\d+)?) mm"
_CHAIN = re.compile(rf"chain (\w+) (studless|studlink) {_SIZE}(?: less {_SIZE})?")
_ROPE = re.compile(rf"({'|'.join(ROPES)}) {_SIZE}(?: at (\d+(?:\.\d+)?) %)?")
_WORDS = ("chain ", *(f"{kind} " for kind in ROPES))
FORMS = (
    "'chain R3 studless 19 mm', 'chain Q3 studlink 32 mm less 2 mm', 'wire 40 mm', 'wire IWRC 24 mm', "
    "'polyester 60 mm', 'nylon 24 mm', 'HMPE 40 mm', 'aramid 30 mm', 'polypropylene 24 mm', 'polyester 60 mm at 20 %'"
)


def material(name: str) -> dict[str, Any] | None:
    """The keys of [material.NAME] for a library name, with `source`; None if it is not a library name.

    Raises InputError for an unavailable size or grade.
    """
    if not name.startswith(_WORDS):
        return None
    found = _CHAIN.fullmatch(name) or _ROPE.fullmatch(name)
    if found is None:
        raise InputError(f"material = {name!r}: must be written like {FORMS}.")
    is_chain = found.re is _CHAIN
    size, *more = (float(text) for text in found.groups()[2 if is_chain else 1 :] if text)
    if not SIZES[0] <= size <= SIZES[1] or (is_chain and any(less >= size for less in more)):
        raise InputError(
            f"material = {name!r}: must have a size of {SIZES[0]:g} to {SIZES[1]:g} mm, and less corrosion."
        )
    return _chain(name, found[1], found[2], size, *more) if is_chain else _rope(name, found[1], size * 1e-3, *more)


def size_of(name: str) -> float:
    """Size in the name of a library material [mm].  Raises InputError for another name."""
    found = re.search(_SIZE, name)
    if material(name) is None or found is None:
        raise InputError(f"material = {name!r}: must be written like {FORMS}.")
    return float(found[1])


def resized(name: str, size: float) -> str:
    """The name of a library material with another size [mm]."""
    return re.sub(_SIZE, f"{size:.9g} mm", name, count=1)


def sizes_made(name: str) -> tuple[float, ...]:
    """Available sizes of a library material [mm]."""
    return CHAIN_SIZES if name.startswith("chain ") else ROPE_SIZES


def chain_strength(factor: float, d: float) -> float:
    """Breaking load of a chain [N]; factor: of its grade [kN/mm^2], d: its bar [mm]."""
    return 1e3 * factor * d**2 * (44 - 0.08 * d)


def _chain(name: str, grade: str, link: str, size: float, less: float = 0.0) -> dict[str, Any]:
    if grade not in GRADES:
        raise InputError(f"material = {name!r}: must have one of the grades {', '.join(GRADES)}.")
    mass, EA, volume, across, along = LINKS[link]
    d, left = size * 1e-3, size - less
    return {
        "line_density": mass * d**2,
        "diameter": d,
        "area": math.pi / 4 * (volume * d) ** 2,
        "axial_stiffness": EA * d**2,
        "damping": DAMPING["chain"] * EA * d**2,
        "added_mass": 1.0,
        "normal_drag": across,
        "tangential_drag": along,
        "breaking_load": chain_strength(GRADES[grade], left),
        "steel_area": math.pi / 2 * (left * 1e-3) ** 2,
        "catalogue": name,
        "source": f"IACS UR {'W22' if grade[0] == 'R' else 'W18'}, OrcaFlex help, DNV-OS-E301; {_chosen('chain')}",
    }


def _rope(name: str, kind: str, d: float, load: float | None = None) -> dict[str, Any]:
    rope = ROPES[kind]
    breaking = rope.breaking * d**2 + rope.cubic * d**3
    stiffness, how = rope.stiffness, "; static stiffness" if rope.dynamic else ""
    if load is not None:
        if rope.dynamic is None:
            raise InputError(f"material = {name!r}: has one stiffness, whatever its load: leave out 'at {load:g} %'.")
        if not 0 < load <= MOST_LOAD:
            raise InputError(f"material = {name!r}: must have a mean load above 0 and up to {MOST_LOAD:g} %.")
        alpha, beta = rope.dynamic
        stiffness, how = alpha + beta * load / 100, f"; dynamic stiffness about {load:g} % of the breaking load"
    return {
        "line_density": rope.mass * d**2,
        "diameter": d,
        "area": rope.volume * d**2,
        "axial_stiffness": stiffness * breaking,
        "damping": DAMPING[kind] * stiffness * breaking,
        "added_mass": rope.added,
        "normal_drag": rope.drag,
        "breaking_load": breaking,
        "catalogue": name,
        "source": f"{rope.source}{how}; {_chosen(kind)}",
    }


def _chosen(kind: str) -> str:
    return f"damping chosen, c/EA = {1e3 * DAMPING[kind]:g} ms"


def expanded(data: dict[str, Any], parse: Callable[[str], dict[str, Any]]) -> dict[str, Any]:
    """The dict of a scene with a [material.NAME] for every library material of a cable or segment.
    Also for those in the file of the key `library`, which is removed.  parse: of TOML.  Raises InputError."""
    own = _own(data["library"], parse) if data.get("library") is not None else {}
    found = {name: value for name, value in data.items() if name != "library"}
    materials = found.get("material") or {}
    if not isinstance(materials, dict):
        return found  # invalid: validation rejects it
    known = dict(materials)

    def named(table: Any, path: str) -> Any:
        """A cable or a segment whose material, and that of its segments, is in `known`."""
        if not isinstance(table, dict):
            return table
        if isinstance(table.get("segments"), list):
            places = ((f"{path}.segments.{k}", segment) for k, segment in enumerate(table["segments"]))
            table = table | {"segments": [_with_body(named(segment, place), place) for place, segment in places]}
        name = table.get("material")
        keys = own.get(name) or _at(path, material, name) if isinstance(name, str) and name not in known else None
        if keys is None:
            return table
        place = re.sub(r"[^A-Za-z0-9_]+", "-", name.replace(".", "_")).strip("-")
        there = known.setdefault(place, keys)
        if (there if isinstance(there, dict) else there.model_dump(exclude_none=True)) != keys:
            raise InputError(
                f"{path}.material = {name!r}: the scene has another [material.{place}]: "
                "take that name, or call it otherwise."
            )
        return table | {"material": place}

    if isinstance(found.get("joint"), list):
        found["joint"] = [_at(f"joint.{k}", with_float, joint) for k, joint in enumerate(found["joint"])]
    if "cable" in found:
        cable = found["cable"]
        several = isinstance(cable, list)
        found["cable"] = [named(x, f"cable.{k}") for k, x in enumerate(cable)] if several else named(cable, "cable")
    return found | {"material": known} if known else found


def _with_body(segment: Any, path: str) -> Any:
    """A segment whose body may be a float of the library."""
    if not isinstance(segment, dict) or "body" not in segment:
        return segment
    return segment | {"body": _at(f"{path}.body", with_float, segment["body"])}


def _at(path: str, make: Callable[[Any], Any], given: Any) -> Any:
    """Call it; prefixes error messages about a key with its path."""
    try:
        return make(given)
    except InputError as error:
        raise InputError(f"{path}.{error}") from None


def _own(library: Any, parse: Callable[[str], dict[str, Any]]) -> dict[str, Any]:
    """Materials of a file: a table of keys for each name, which may be any text."""
    if not isinstance(library, str | Path | Named):
        raise InputError(f"library = {library!r}: must be the name of a TOML file.")
    try:
        path = inside(library.folder, library.name) if isinstance(library, Named) else library
        with open(path, "rb") as file:
            content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise ValueError(f"must have {MOST_BYTES:,} bytes at most")
        found = parse(content.decode("utf-8-sig"))
        if not all(isinstance(table, dict) for table in found.values()):
            raise ValueError('must hold a table of keys for each material, ["NAME"]')
    except OSError as error:
        raise InputError(f"library = {library!r}: cannot be read: {error.strerror}.") from None
    except ValueError as error:
        raise InputError(f"library = {library!r}: {str(error).rstrip('.')}.") from None
    return found

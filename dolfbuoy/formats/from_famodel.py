"""Moorings in the YAML of a floating array (FAModel) as a scene, via the YAML of MoorPy.

Every platform of the array is a vessel with its position and heading; its lines run outwards at their headings,
anticlockwise from x, or to an anchor or another platform (`array_mooring`).
"""

import math
from typing import Any

from ..errors import InputError
from . import from_yaml
from .from_yaml import number, read_yaml, text_of
from .names import Note

#: Keys of a line type and their names in MoorPy.
LINE_TYPE = {"d_vol": "diameter", "m": "mass_density", "EA": "stiffness", "MBL": "breaking_load"}
LINE_TYPE |= {"Cd": "transverse_drag", "Ca": "transverse_added_mass"}
LINE_TYPE |= {"CdAx": "tangential_drag", "CaAx": "tangential_added_mass"}
#: Keys without effect on the water or the line's mechanics.
SILENT = ("d_nom", "cost", "material", "name", "type", "notes")
CARRIED = {"site", "array", "array_mooring", "platform", "platforms", "name", "type", "comments", "anchor_types"}
CARRIED |= {"mooring_systems", "mooring_line_configs", "mooring_line_types", "mooring_connector_types"}


def scene_of(text: str, title: str = "", depth: float | None = None) -> tuple[dict[str, Any], list[Note]]:
    """The scene of a floating array, as its sections and keys, and notes on parts that could not be translated.

    depth: of the water [m] where the file does not give it.  Raises InputError.
    """
    data = read_yaml(text)
    if not isinstance(data, dict) or not all(data.get(name) for name in ("array", "mooring_line_configs")):
        raise InputError("there is no array with mooring_line_configs: this is no file of FAModel.")
    return _Reader(data, depth).scene(title)


def _table(data: dict[str, Any], place: str, keys: str = "keys", rows: str = "data") -> list[dict[str, Any]]:
    """Rows of a table of keys and data."""
    names, found = data.get(keys), data.get(rows) or []
    if not isinstance(names, list) or not all(isinstance(row, list) and len(row) <= len(names) for row in found):
        raise InputError(f"{place}: must have {keys}, and {rows} with a value for each.")
    return [dict(zip(map(str, names), row, strict=False)) for row in found]


def _named(data: Any) -> dict[str, Any]:
    """Tables by name, some of which may be given as a table of keys and data."""
    found = dict(data) if isinstance(data, dict) else {}
    if "keys" in found:
        found |= {str(row.get("name")): row for row in _table(found, "mooring_line_types")}
    return {str(name): row for name, row in found.items() if name not in ("keys", "data") and isinstance(row, dict)}


class _Reader:
    def __init__(self, data: dict[str, Any], depth: float | None):
        self.data, self.notes = data, list[Note]()
        self.configs, self.systems = _named(data["mooring_line_configs"]), _named(data.get("mooring_systems"))
        self.types = _named(data.get("mooring_line_types"))
        self.connectors = _named(data.get("mooring_connector_types"))
        site = data.get("site") if isinstance(data.get("site"), dict) else {}
        self.water = (site or {}).get("general") or {}
        given = self.water.get("water_depth", depth)
        self.depth = number(given, "site.general.water_depth")
        self.points: list[dict[str, Any]] = []
        self.lines: list[dict[str, Any]] = []
        self.vessels: dict[str, dict[str, Any]] = {}

    def scene(self, title: str) -> tuple[dict[str, Any], list[Note]]:
        rows = _table(self.data["array"], "array")
        for row in rows:
            place = [number(row.get(key), f"array: {key}") for key in ("x_location", "y_location")]
            turn, name = number(row.get("heading_adjust", 0.0), "array: heading_adjust"), str(row.get("ID"))
            self.vessels[name] = {"name": _word(name), "position": [*place, 0.0], "heading_deg": turn}
        for row in rows:
            if (system := row.get("mooringID")) not in (0, None, "0"):
                self._system(row, str(system))
        self._shared()
        if left := [str(name) for name in self.data if name not in CARRIED]:
            self.notes.append(Note(f"of this array only moorings are carried over, and not {', '.join(left)}"))
        self.notes.append(Note("headings are taken counterclockwise from x; platforms are vessels at rest"))
        moorpy = {"points": self.points, "lines": self.lines, "line_types": [self._type(name) for name in self.types]}
        site = {"water_depth": self.depth, "rho_water": self.water.get("rho_water")}
        if not self.lines:
            raise InputError("no mooring of the array has a line.")
        vessels = {vessel["name"]: vessel for vessel in self.vessels.values()}
        scene, more = from_yaml.scene_of_mooring(moorpy, {"site": site}, title, None, vessels)
        return scene, [*self.notes, *more]

    def _system(self, row: dict[str, Any], system: str) -> None:
        """Lines from a platform out to anchors."""
        if system not in self.systems:
            raise InputError(f"array: mooringID {system!r} is none of mooring_systems: {', '.join(self.systems)}.")
        fowt = str(row.get("ID"))
        for k, line in enumerate(_table(self.systems[system], f"mooring_systems, {system}"), 1):
            config, name = self._config(line), f"{fowt}_{k}"
            heading = math.radians(number(line.get("heading", 0.0), f"mooring_systems, {system}: heading"))
            radius, low = self._fairlead(row, config)
            way = [math.cos(heading), math.sin(heading)]
            self._put_fairlead(f"{name}_fair", fowt, [radius * way[0], radius * way[1], low])
            if "anchoring_radius" in config:
                out = number(config["anchoring_radius"], "mooring_line_configs: anchoring_radius")
            else:
                out = radius + number(config.get("span"), "mooring_line_configs: anchoring_radius (or span)")
            turn = heading + math.radians(self.vessels[fowt]["heading_deg"])
            x, y, _ = self.vessels[fowt]["position"]
            self._put_anchor(f"{name}_anchor", [x + out * math.cos(turn), y + out * math.sin(turn)])
            self._line(name, config, f"{name}_anchor", f"{name}_fair", line)

    def _shared(self) -> None:
        """Lines shared in the array: from an anchor or a platform to another platform."""
        shared = self.data.get("array_mooring") or {}
        anchors = {str(row.get("ID")): row for row in self._rows(shared, "anchor")}
        for name, row in anchors.items():
            self._put_anchor(name, [number(row.get(axis), f"anchor_data, {name}: {axis}") for axis in "xy"])
        fowts = {str(row.get("ID")): row for row in _table(self.data["array"], "array")}
        for k, line in enumerate(self._rows(shared, "line"), 1):
            config, name = self._config(line), f"shared_{k}"
            ends = [str(line.get(key, line.get(other))) for key, other in (("end A", "endA"), ("end B", "endB"))]
            places = [self._middle(end, anchors, f"line_data, row {k}") for end in ends]
            for i, end in enumerate(ends):
                if end in anchors:
                    continue
                own, far = places[i], places[1 - i]
                way = math.atan2(far[1] - own[1], far[0] - own[0]) - math.radians(self.vessels[end]["heading_deg"])
                radius, low = self._fairlead(fowts[end], config)
                self._put_fairlead(f"{name}_{'ab'[i]}", end, [radius * math.cos(way), radius * math.sin(way), low])
            names = [end if end in anchors else f"{name}_{'ab'[i]}" for i, end in enumerate(ends)]
            self._line(name, config, names[0], names[1], line)

    @staticmethod
    def _rows(shared: dict[str, Any], what: str) -> list[dict[str, Any]]:
        return _table(shared, "array_mooring", f"{what}_keys", f"{what}_data") if shared.get(f"{what}_data") else []

    def _middle(self, end: str, anchors: dict[str, Any], where: str) -> list[float]:
        if end in anchors:
            return [number(anchors[end].get(axis), f"anchor_data, {end}: {axis}") for axis in "xy"]
        if end not in self.vessels:
            raise InputError(f"{where}: {end!r} is none of the anchors and platforms of the array.")
        found: list[float] = self.vessels[end]["position"]
        return found

    def _config(self, line: dict[str, Any]) -> dict[str, Any]:
        name = str(line.get("MooringConfigID"))
        if name not in self.configs:
            raise InputError(f"MooringConfigID {name!r} is none of mooring_line_configs: {', '.join(self.configs)}.")
        found: dict[str, Any] = self.configs[name]
        return found

    def _fairlead(self, row: dict[str, Any], config: dict[str, Any]) -> tuple[float, float]:
        """Radius and height of a fairlead: those of the line, else those of its platform."""
        platforms = self.data.get("platforms") or [self.data.get("platform") or {}]
        which = row.get("platformID", 1)
        platform = platforms[which - 1] if isinstance(which, int) and 1 <= which <= len(platforms) else platforms[0]
        radius = config.get("fairlead_radius", platform.get("rFair"))
        height = config.get("fairlead_depth", platform.get("zFair"))
        return number(radius, "fairlead_radius (or rFair)"), -abs(number(height, "fairlead_depth (or zFair)"))

    def _put_fairlead(self, name: str, fowt: str, place: list[float]) -> None:
        vessel = self.vessels[fowt]["name"]
        self.points.append({"name": name, "type": "vessel", "location": place, "vessel": vessel})

    def _put_anchor(self, name: str, place: list[float]) -> None:
        self.points.append({"name": name, "type": "fixed", "location": [*place, -self.depth]})

    def _line(self, name: str, config: dict[str, Any], low: str, high: str, row: dict[str, Any]) -> None:
        """Sections of a line with connectors between them, each a line of its own."""
        if row.get("lengthAdjust"):
            self.notes.append(Note(f"{name}: lengthAdjust = {row['lengthAdjust']} is not carried over"))
        parts = [dict(part) for part in config.get("sections") or [] if isinstance(part, dict)]
        if parts and config.get("symmetric"):
            parts = _mirrored(parts)
        sections = [k for k, part in enumerate(parts) if "type" in part]
        if not sections:
            raise InputError(f"mooring_line_configs: {name} has no sections.")
        below = low
        for i, k in enumerate(sections):
            above = high
            if k != sections[-1]:
                above = f"{name}_{i + 1}"
                between = [part for part in parts[k + 1 : sections[i + 1]] if "connectorType" in part]
                self.points.append({"name": above, "type": "free", "location": [0.0, 0.0, 0.0]} | self._body(between))
            length = number(parts[k].get("length"), f"mooring_line_configs: length of a section of {name}")
            kind = text_of(parts[k], "type", "sections")
            self.lines.append(
                {"name": f"{name}_{i + 1}_line", "endA": below, "endB": above, "type": kind, "length": length}
            )
            below = above

    def _body(self, between: list[dict[str, Any]]) -> dict[str, float]:
        found: dict[str, float] = {}
        for part in between:
            kind = str(part["connectorType"])
            if kind not in self.connectors:
                self.notes.append(Note(f"the connector {kind} is none of mooring_connector_types, and weighs nothing"))
            for key, own in (("m", "mass"), ("v", "volume"), ("CdA", "CdA")):
                if value := self.connectors.get(kind, {}).get(key):
                    found[own] = found.get(own, 0.0) + number(value, f"mooring_connector_types, {kind}: {key}")
        return found

    def _type(self, name: str) -> dict[str, Any]:
        kind, found = self.types[name], {"name": name}
        for key, value in kind.items():
            if key in LINE_TYPE:
                found[LINE_TYPE[key]] = value
            elif key in ("EAd", "EAd_Lm"):
                self.notes.append(
                    Note(f"mooring_line_types, {name}: {key} = {value}, the dynamic stiffness, is left out")
                )
            elif key not in SILENT:
                found[key] = value
        return found


def _mirrored(parts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Parts of a symmetric line given by half: the last section is doubled, or mirrored at a final connector."""
    *half, last = parts
    if "type" in last:
        return [*half, last | {"length": 2 * number(last.get("length"), "sections: length")}, *half[::-1]]
    return [*half, last, *half[::-1]]


def _word(name: str) -> str:
    """The name of a platform in a form that a scene allows."""
    own = "".join(c if c.isalnum() or c in "_-" else "_" for c in name)
    return own if own[:1].isalpha() else f"platform{own}"

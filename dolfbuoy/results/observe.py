"""Recorded quantities of a problem: states of buoys, tensions, wet hulls, and shapes of cables."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..model import effects
from ..model.airy import sea_of
from ..model.buoy import MOTION, REST
from ..model.potential_flow import radiation_memory
from ..model.rigid import mass_properties
from ..model.wet_hull import SUBMERGED
from ..scene.network import attached_ends
from ..solver import compat
from ..solver.vector_ops import copies, picked, together, traced
from ..version import __version__, now
from .devices import winds_of
from .noted import Design, Noted
from .places import Place
from .quantities import over
from .quantity import Absent
from .record import FORMAT
from .running import Bending, Grounded, Smallest, Utilisation, stressed

if TYPE_CHECKING:
    from ..model.problem import Problem


#: Array, index in it, and factor.
Entry = tuple[NDArray[Any], int, float]


class Observer:
    """Reads the recorded quantities from a solved Problem.  Collective; values are complete on rank 0.

    end_forces: by name, arrays that are up to date whenever `note` is called.  places: from `places_of`, where the
    tension is noted.  evaluated: True if the hulls have already been evaluated near enough whenever `note` is called.
    """

    def __init__(
        self,
        problem: Problem,
        end_forces: dict[str, NDArray[Any]] | None = None,
        places: Sequence[Place] = (),
        evaluated: bool = False,
    ) -> None:
        self.problem, self.comm, self.network = problem, problem.comm, problem.network
        self._masses = np.array([mass_properties(b).mass for b in self.network.buoys.values()])
        self._design = Design(problem.scene)
        self._wet = problem.wet_hulls if problem.buoys and problem.scene.sea else None
        self._smallest = Smallest(problem) if problem.lines else None
        self._stress = Utilisation(problem) if stressed(self.network) else None
        self._bending = Bending(problem) if self.network.bends else None
        self._grounded = Grounded(problem, self._bending)
        self._wound = np.zeros(len(self.network.winches))
        self._winds = winds_of(problem.scene, problem.dynamic)
        self._blown = np.zeros((len(self._winds), 3))
        self.places = tuple(places)
        sources, self._places, self.width = self._sources(end_forces or {}), {}, 0
        for name, entries in sources.items():
            self._places[name] = slice(self.width, self.width + len(entries))
            self.width += len(entries)
        self._row = np.zeros(self.width)
        pick = picked([entry for entries in sources.values() for entry in entries], self._row)
        if evaluated and self._wet:
            problem.system.read_given()
            self._wet()
        self._take = together(*self._notes(evaluated), pick)

    def _sources(self, end_forces: dict[str, NDArray[Any]]) -> dict[str, list[Entry]]:
        """Entries for `picked` of everything noted at an instant, by name; 0 on other ranks."""
        problem, u, found, root = self.problem, self.problem.system.u, {}, self.comm.rank == 0
        for name, force in end_forces.items():
            found[name] = _all_of(force, root)
        if problem.lines:
            found["tension_anchor"] = _joined(map(self._tension_at, range(len(self.network.cables))))
            if self.places:
                found["place_tension"] = _joined(map(self._tension_near, self.places))
            if problem.lines.bed is not None:
                found["bed"] = _all_of(self._grounded.rows, root)
            if self._smallest is not None:
                found["smallest_tension"] = _all_of(self._smallest.values, root)
            if self._stress is not None:
                found["utilisation"] = _all_of(self._stress.values, root)
            if self._bending is not None:
                found["bending"] = _all_of(self._bending.values, root)
                if problem.lines.bed is not None:
                    found["touchdown_moment"] = _all_of(self._grounded.moments, root)
                if self._bending.limited:
                    found["bend_utilisation"] = _all_of(self._bending.utilisation, root)
        if self.network.buoys:
            fields = MOTION if problem.dynamic else REST
            mine = [problem.buoys.get(name) for name in self.network.buoys]
            states = [u[buoy.part.slice] if buoy else np.zeros(fields.size) for buoy in mine]
            found["buoy"] = _joined(map(_all_of, states))
            if problem.scene.sea:
                known = dict(
                    zip(problem.buoys, self._wet.out.reshape(-1, SUBMERGED) if self._wet else (), strict=False)
                )
                wet = [known.get(name, np.zeros(SUBMERGED)) for name in self.network.buoys]
                found["water"] = _joined(map(_all_of, wet))
            if problem.dynamic and effects.DRIFT in effects.names(problem.scene):
                slow = [one and one.slow_drift for one in mine]
                found["drift"] = _joined(_all_of(one.numbers if one else np.zeros(3)) for one in slow)
        if problem.attachments:
            found["mooring"] = _joined(_all_of(u[a.slice], a.buoy is not None) for a in problem.attachments)
        if self.network.take_offs:
            here: list[NDArray[Any]] = [device.numbers for device in problem.take_offs]
            found["take_off"] = _joined(map(_all_of, here or [np.zeros(3)] * len(self.network.take_offs)))
        if self.network.winches:
            found["winch"] = _all_of(self._wound)
        if self._winds:
            found["wind"] = _all_of(self._blown, root)
        if self.network.joints:
            found["joint"] = _joined(map(self._place_of, self.network.joints))
        return found

    def _tension_at(self, cable: int) -> list[Entry]:
        lines: Any = self.problem.lines
        u, piece = self.problem.system.u, self.network.first_of(cable)
        tension: Callable[[], float] = partial(lines.anchor_tension, u, piece)
        return traced(tension, [u]) if np.isfinite(tension()) else _all_of(np.zeros(1))

    def _tension_near(self, place: Place) -> list[Entry]:
        """Entry of the tension unknown nearest to a place on its piece; of two elements, in the lower one."""
        lines: Any = self.problem.lines
        group, piece = lines.holder(place.piece)
        cells, nearest = group.cells_of[piece], (np.inf, np.inf, self.comm.rank, -1)
        if len(cells):
            cells = cells[np.argsort(group.cell_ends[cells].mean(axis=1))]
            away = np.abs(group.T_s[cells] - group.begins[piece] - place.s).round(9)
            cell, node = np.unravel_index(np.argmin(away + 1e-12 * np.arange(len(cells))[:, None]), away.shape)
            middle = group.cell_ends[cells[cell]].mean()
            nearest = away[cell, node], middle, self.comm.rank, int(group.T_dofs[cells[cell], node])
        *_, rank, dof = min(self.comm.allgather(nearest))
        return (
            [(self.problem.system.u, group.part.offset + dof, 1.0)] if rank == self.comm.rank else _all_of(np.zeros(1))
        )

    def _place_of(self, joint: str) -> list[Entry]:
        """Entries of the position of a joint, from the first end there."""
        lines: Any = self.problem.lines
        ends = (
            (k, i)
            for k, piece in enumerate(self.network.pieces)
            for i, end in enumerate(piece.ends)
            if end.name == joint
        )
        piece, end = next(ends)
        if not lines.owns_end(piece, end):
            return _all_of(np.zeros(3))
        return [(self.problem.system.u, int(dof), 1.0) for dof in lines.end_dofs[piece][end]]

    def labels(self) -> dict[str, NDArray[Any]]:
        """Names of cables, buoys, joints, ... by dimension of the record, without xyz and quaternion."""
        n = self.network
        ends = [f"{n.cables[n.pieces[k].cable]}.{('from', 'to')[end]}" for k, end in attached_ends(n)]
        found = {"cable": n.cables, "buoy": n.buoys, "attachment": ends, "anchor": self._design.anchors}
        found |= {"joint": n.joints, "segment": stressed(n), "take_off": n.take_offs, "winch": n.winches}
        found["vessel"] = self._winds
        found["place"] = [place.name for place in self.places]
        return {name: np.array(list(names)) for name, names in found.items() if names}

    def values(self, end_forces: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Quantities at this instant.  end_forces: from the Simulation, or from the Problem at rest."""
        return self._quantities({name: np.ravel(force) for name, force in end_forces.items()} | self._columns())

    def begun(self) -> dict[str, NDArray[Any]]:
        """Quantities read at the beginning of a run, which must be the present instant; on rank 0."""
        return self._quantities(self._columns(), "")

    def _columns(self) -> dict[str, NDArray[Any]]:
        """Notes of this instant by source; empty on other ranks."""
        row = self.note()
        return {} if row is None else {name: row[place].copy() for name, place in self._places.items()}

    def note(self) -> NDArray[Any] | None:
        """The numbers of this instant in one row for `values_of`, in memory that is reused; None on other ranks."""
        self._take()
        if self.comm.size == 1:
            return self._row
        total = np.zeros_like(self._row)
        self.comm.Reduce(self._row, total)
        return total if self.comm.rank == 0 else None

    def noting(self, out: NDArray[Any]) -> Callable[[], object]:
        """Function that writes the numbers of `note` into `out`, zeros on other ranks."""
        if self.comm.size == 1:
            return together(self._take, copies([(out, self._row)]))
        return lambda: np.copyto(out, 0.0 if (row := self.note()) is None else row)

    def _notes(self, evaluated: bool) -> Iterator[Callable[[], object]]:
        """Functions that update the numbers that are not unknowns."""
        if self._wet:
            yield from () if evaluated else (self.problem.system.read_given,)
            yield self._wet.in_c(hooks=not evaluated)
        if "bed" in self._places:
            yield from self._grounded.notes()
        if self._smallest is not None:
            yield self._smallest.note
        if self._stress is not None:
            yield self._stress.note
        if self._bending is not None:
            yield self._bending.note
        for buoy in self.problem.buoys.values():
            if buoy.slow_drift is not None:
                yield buoy.slow_drift.noting(self.problem.system.u)
        for device in self.problem.take_offs:
            yield partial(device.note, self.problem.system.u)
        if self.network.winches:
            yield self._note_winches
        if self._winds:
            yield self._note_winds

    def _note_winches(self) -> None:
        for k, piece in enumerate(self.network.winches.values()):
            lines, number = self.problem.lines.holder(piece)
            self._wound[k] = lines.winch.length_of(number)

    def _note_winds(self) -> None:
        self._blown[:] = [wind.force(self.problem.time.item()) for wind in self._winds.values()]

    def values_of(self, rows: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """Quantities at instants (..., numbers of `note`), without time and solver."""
        return self._quantities({name: rows[..., place] for name, place in self._places.items()})

    def _quantities(self, columns: dict[str, NDArray[Any]], axis: str = "time") -> dict[str, NDArray[Any]]:
        noted, found = Noted(columns, self.problem, self._masses, self._design), {}
        for name, quantity in over(axis).items():
            if quantity.read:
                with suppress(Absent):
                    found[name] = quantity.read(noted)
        return found

    def fixed(self) -> dict[str, NDArray[Any]]:
        """Arc lengths of nodes and cells, marine growth, and components of an irregular sea, on rank 0."""
        found, waves = self._along() | self._grown(), self.problem.scene.waves
        if self.comm.rank == 0 and self.places:
            found["place_s"] = np.array([place.s for place in self.places])
        if self.comm.rank == 0 and waves is not None and waves.irregular and self.problem.dynamic:
            names = (f"wave_{name}" for name in ("amplitude", "period", "direction_deg", "phase_deg"))
            found |= dict(zip(names, sea_of(self.problem.scene).as_rows().T, strict=True))
        return found

    def _grown(self) -> dict[str, NDArray[Any]]:
        """Marine growth on the elements; call `_along` before, which finds their order."""
        growth = self.problem.lines.growth if self.problem.lines else None
        if growth is None:
            return {}
        found = self._gather(np.column_stack([growth.factors, growth.weights]))
        if self.comm.rank != 0:
            return {}
        return dict(zip(("growth_diameter", "growth_mass", "growth_weight"), found[self._cell_order].T, strict=True))

    def _along(self) -> dict[str, NDArray[Any]]:
        """Arc lengths cable by cable, each from its lower end, and the cable and segment of each node or element."""
        lines = self.problem.lines
        if lines is None:
            return {}
        s = self._gather(lines.node_s[: lines.owned_nodes])
        middle = self._gather(lines.cell_ends.mean(axis=1))
        if self.comm.rank != 0:
            return {}
        self._node_order, self._cell_order = np.argsort(s, kind="stable"), np.argsort(middle, kind="stable")
        return self._of_pieces(s[self._node_order], middle[self._cell_order])

    def _of_pieces(self, s: NDArray[Any], middle: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """`fixed` from sorted mesh coordinates; a node between two segments counts once, with the lower one."""
        lines: Any = self.problem.lines
        pieces = self.network.pieces
        piece, of_cell = lines.line_at(s), lines.line_at(middle)
        number = np.array([p.number for p in pieces])
        lengths = [p.section.length for p in pieces]
        before = np.array([sum(lengths[k - p.number : k]) for k, p in enumerate(pieces)]) - lines.begins
        first = np.concatenate([[True], np.diff(piece) > 0])
        kept = ~(first & (number[piece] > 0))
        self._node_order, piece, s = self._node_order[kept], piece[kept], s[kept]
        cable = np.array([p.cable for p in pieces])
        found = {"s": s + before[piece], "s_cell": middle + before[of_cell]}
        found |= {"cable_of_node": cable[piece], "cable_of_cell": cable[of_cell]}
        return found | {"segment_of_cell": number[of_cell]}

    def parted(self, fixed: dict[str, NDArray[Any]]) -> str:
        """Text stating which cables have parted, where and when, on rank 0.
        fixed: result of `fixed`, whose `parted_at` is updated."""
        if not any(piece.section.fails_at for piece in self.network.pieces):
            return ""
        lines: Any = self.problem.lines
        since = self._gather(lines.parted_at)
        if self.comm.rank != 0:
            return ""
        fixed["parted_at"] = since = since[self._cell_order]
        cable = fixed["cable_of_cell"]
        gone = (k for k in np.argsort(since, kind="stable") if np.isfinite(since[k]))
        where = (f"{self.network.cables[cable[k]]} at s = {fixed['s_cell'][k]:g} m, t = {since[k]:g} s" for k in gone)
        return "; ".join(where)

    def frame(self, velocity: NDArray[Any] | None = None) -> dict[str, NDArray[Any]]:
        """Node positions, velocities and element tensions in order from the anchor, on rank 0; call `fixed` before.

        velocity: of the lines' unknowns [m/s]; None at rest.
        """
        cable: Any = self.problem.lines
        u = self.problem.system.u
        nodes = {"cable_position": u} | ({} if velocity is None else {"cable_velocity": velocity})
        nodes = {name: values[cable.node_dofs[: cable.owned_nodes]] for name, values in nodes.items()}
        if self._bending is not None:
            nodes |= {"cable_moment": cable.moments(u)[: cable.owned_nodes], "curvature": self._bending.curvatures()}
        return self.along(nodes, {"cable_tension": cable.mean_tension(u)})

    def along(self, nodes: dict[str, NDArray[Any]], cells: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Arrays of this rank's nodes and of its elements in order from the anchor, on rank 0; call `fixed` before."""
        of_nodes, of_cells = ({name: self._gather(x) for name, x in arrays.items()} for arrays in (nodes, cells))
        if self.comm.rank != 0:
            return {}
        found = {name: values[self._node_order] for name, values in of_nodes.items()}
        return found | {name: values[self._cell_order] for name, values in of_cells.items()}

    def _gather(self, array: NDArray[Any]) -> Any:
        if self.comm.size == 1:
            return np.array(array)
        parts = self.comm.gather(np.ascontiguousarray(array))
        return np.concatenate(parts) if parts is not None else None


def _all_of(array: NDArray[Any], here: bool = True) -> list[Entry]:
    """Entries for `picked` of all numbers of an array; zeros if it is not on this rank."""
    array = array.ravel() if here else np.zeros(array.size)
    return [(array, k, 1.0) for k in range(array.size)]


def _joined(lists: Iterable[list[Entry]]) -> list[Entry]:
    return list(itertools.chain.from_iterable(lists))


def attributes(problem: Problem) -> dict[str, Any]:
    """Global attributes of a record: those of CF, versions, the complete scene as TOML, and the solution method."""
    versions = {f"version_{name}": value for name, value in compat.versions().items()}
    return {
        "Conventions": "CF-1.9",
        "title": problem.scene.title,
        "source": f"dolfbuoy {__version__}",
        "scene": problem.scene.to_toml(),
        "unknowns": problem.system.unknowns,
        "effects": ", ".join(effects.names(problem.scene)),
        "format": FORMAT,
        "ranks": problem.comm.size,
        "created": now(),
        "version_dolfbuoy": __version__,
        **versions,
        **({"route": problem.route} if problem.route else {}),
        **({"radiation_memory": said} if (said := radiation_memory(problem.scene)) else {}),
    }

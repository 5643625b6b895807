"""A vessel moved by a caller: it has one pose, which the ends of lines and take-offs on it follow."""

import math
from typing import Any

import numpy as np

from ..errors import InputError
from ..model.rigid import rotation_of
from ..motion.simulation import Simulation
from ..scene.vessel import Vessel
from .paths import Array, Pose, Wrench


class Carried:
    """Ends on a vessel that rests in its scene; `path`: its pose, reference point and axes [m, quaternion].

    Raises InputError for a vessel that is moved by the scene, or that clamps lines.
    """

    def __init__(self, simulation: Simulation, vessel: Vessel):
        self.simulation, self.vessel, scene = simulation, vessel, simulation.scene
        if vessel.motion is not None or vessel.raos is not None:
            raise InputError(f"driven = {vessel.name!r}: the scene moves it.")
        if vessel.wind is not None:
            raise InputError(f"driven = {vessel.name!r}: it has wind, whose force is known where the scene moves it.")
        half = math.radians(vessel.heading_deg) / 2
        self.path = Pose(simulation.t, [*vessel.position, math.cos(half), 0.0, 0.0, math.sin(half)])
        #: (piece, end) -> fairlead; and (take-off, end) -> fairlead.
        self.ends: dict[tuple[int, int], str] = {}
        self.devices: list[tuple[Any, int, str]] = []
        for k, piece in enumerate(scene.network.pieces):
            for i, end in enumerate(piece.ends):
                if (fairlead := self._fairlead(end)) is not None:
                    if end.clamp is not None:
                        raise InputError(
                            f"driven = {vessel.name!r}: it holds a line in a direction, a pin may be driven."
                        )
                    self.ends[k, i] = fairlead
                    simulation.drive(k, i, self._place(fairlead))
        for device in simulation.problem.take_offs:
            for i, end in enumerate(device.holders):
                if (fairlead := self._fairlead(end)) is not None:
                    self.devices.append((device, i, fairlead))
                    device.driven[i] = self._place(fairlead)

    def _fairlead(self, end: Any) -> str | None:
        name, _, fairlead = (end.name or "").partition(".")
        return fairlead if name == self.vessel.name and end.kind == "fixed" else None

    def _arm(self, fairlead: str, orientation: Array) -> Array:
        return np.asarray(rotation_of(orientation) @ np.array(self.vessel.fairleads[fairlead]))

    def _place(self, fairlead: str) -> Any:
        def place(t: float) -> Array:
            position, orientation, *_ = self.path(t)
            return np.asarray(position + self._arm(fairlead, orientation))

        return place

    def pulls(self) -> Wrench:
        """Force [N] and moment about the reference point [N m] of all lines and take-offs on it, world frame."""
        network, held = self.simulation.scene.network, self.simulation.latest_end_forces
        orientation = self.path(self.simulation.t)[1]
        force, moment = np.zeros(3), np.zeros(3)
        found = [
            (fairlead, -held["end_tension" if i else "anchor_force"][network.pieces[k].cable])
            for (k, i), fairlead in self.ends.items()
        ]
        for device, i, fairlead in self.devices:
            reactions = dict(device.reactions(self.simulation.system.last_residual))
            found.append((fairlead, -reactions[i]))
        for fairlead, pull in found:
            force, moment = force + pull, moment + np.cross(self._arm(fairlead, orientation), pull)
        return Wrench(force, moment)

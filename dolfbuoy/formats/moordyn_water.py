"""Sea, bed, wave and current of a scene in MoorDyn's files.

A regular wave is a spectrum of one component on MoorDyn's table in space and time (`WaveKin 2`), as its sum of
components (`WaveKin 7`) has no pressure and does not move a floating body.  MoorDyn uses Wheeler stretching.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..model.sea import heading, main_propagation, velocity_at
from ..model.varying import varies
from ..scene.network import Network
from ..scene.sections import Current, Scene
from ..scene.waves import Waves

#: Points of the table per wavelength and per period; MoorDyn interpolates linearly between them.
PER_WAVE = 64
#: Depth for a scene without water [m], and depth of MoorDyn's bed, in water depths, if the scene has none.
DRY, FAR_DOWN = 1e4, 10.0
#: Length of the table in wave periods, unless the scene has a time.
PERIODS = 40


def options(scene: Scene, network: Network, note: Callable[..., Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """MoorDyn's options, and the files of its input by name; note(text): for parts that are not translated."""
    found = {"g": scene.gravity, "rho": scene.sea.density if scene.sea else 0.0}
    depth = scene.sea.depth if scene.sea else DRY
    far = FAR_DOWN if scene.sea and not (scene.waves or scene.seabed) else 1.0  # waves need the true depth
    found["WtrDpth"] = depth * far
    if far > 1:
        note(f"sea.depth: WtrDpth is {far:g} times it, which keeps MoorDyn's bed away from the lines")
    found |= _bed(scene, network, note)
    found |= {"TmaxIC": 0, "disableOutput": 1, "disableOutTime": 1}
    files: dict[str, str] = {}
    if scene.waves and scene.waves.irregular:
        note("[waves]: of an irregular sea nothing is carried over")
    elif scene.waves:
        found["WaveKin"] = 2
        files |= {
            "wave_frequencies.txt": _wave(scene, scene.waves),
            "water_grid.txt": _grid(scene, network, scene.waves, depth),
        }
        note("waves.ramp: MoorDyn's wave is there at once, at its full height")
        if scene.waves.theory == "stream":
            note("waves.theory: MoorDyn's wave is linear, with half the height as amplitude")
        elif scene.waves.stretching != "wheeler":
            note("waves.stretching: MoorDyn stretches its table as wheeler does")
    if scene.current:
        found["Currents"] = 1
        files["current_profile.txt"] = _current(scene, scene.current, depth)
        if varies(scene.current):
            note("current: MoorDyn's is steady, that of t = 0")
    if scene.sea and scene.sea.tide:
        note("sea.tide: MoorDyn's water stays as high as at t = 0")
    return found, files


def _bed(scene: Scene, network: Network, note: Callable[..., Any]) -> dict[str, Any]:
    if scene.seabed is None:
        return {"kBot": 0, "cBot": 0}
    from ..model.contact import hardness, parameters_of_line

    sections = [piece.section for piece in network.pieces]
    k_b = hardness(scene, sections)
    grips = [(parameters_of_line(scene, section, k_b), section) for section in sections]
    damping = max(grip.damping / (section.diameter or math.nan) for grip, section in grips)
    note("seabed.damping_ratio: MoorDyn's damping of the bed acts at once on contact and not with the penetration")
    found = {"kBot": float(k_b), "cBot": float(damping)}
    if scene.seabed.friction:
        found |= {"FrictionCoefficient": scene.seabed.friction}
        note("seabed.friction: MoorDyn's friction follows the speed, and lets go of what lies still")
    if any(scene.seabed.slope):
        note("seabed.slope is not carried over")
    if scene.seabed.depths:
        note("seabed.depths are not carried over: the bed is flat, at sea.depth")
    return found


def _wave(scene: Scene, waves: Waves) -> str:
    """The component and empty ones, whose frequency spacing sets the length of the table, and the last one its step.

    The table is longer than the run, as MoorDyn reads a wrong value where it restarts, and the cable rings.
    """
    frequency = main_propagation(scene).at_ground
    end = scene.time.end if scene.time else PERIODS * 2 * math.pi / frequency
    periods = math.ceil(end * frequency / (2 * math.pi)) + 1
    phase = math.radians(waves.phase_deg)  # MoorDyn takes the real and the imaginary part of a exp(-i phase)
    wave = (waves.size * math.cos(phase), -waves.size * math.sin(phase), math.radians(waves.direction_deg))
    rows = []
    for i in range(periods * PER_WAVE // 2 + 1):
        row = wave if i == periods else (0.0, 0.0, 0.0)
        rows.append(" ".join(f"{value:.14g}" for value in (i * frequency / periods, *row)))
    return "\n".join(rows) + "\n"


def _grid(scene: Scene, network: Network, waves: Waves, depth: float) -> str:
    """Points of the table in space: PER_WAVE per wavelength along the wave and, near the surface, along z.

    It extends half a wavelength beyond the scene at the start (of lines to a buoy, their parts above a depth of half a
    wavelength); beyond the table there are no waves.
    """
    wave = 2 * math.pi / main_propagation(scene).wavenumber
    ends = (end for piece in network.pieces for end in piece.ends if end.held or end.is_on_sinker)
    places = [np.array(end.position) for end in ends]
    starts = [buoy.initial for buoy in network.buoys.values()]
    buoys = [np.array(start.buoy_position) for start in starts if start and start.buoy_position]
    if buoys:
        near = [[min(1.0, wave / 2 / max(-place[2], 1e-9)) * (place - buoy) for place in places] for buoy in buoys]
        places = [buoy + way for buoy, ways in zip(buoys, near, strict=True) for way in (np.zeros(3), *ways)]
    low, high = np.min(places, axis=0), np.max(places, axis=0)
    along = np.abs(heading(waves.direction_deg))
    axes = []
    for axis in (0, 1):
        if along[axis] < 1e-9:
            axes.append([-1e4, 1e4])
            continue
        reach = (low[axis] - wave / 2, high[axis] + wave / 2)
        points = math.ceil((reach[1] - reach[0]) * along[axis] * PER_WAVE / wave)
        axes.append(np.linspace(*reach, points + 1))
    shallow = np.arange(0.0, min(depth, wave / 2), wave / PER_WAVE)
    z = -np.concatenate([shallow, np.linspace(shallow[-1], depth, 12)[1:]])[::-1]
    lists = ["1\n" + " ".join(f"{value:.6f}" for value in values) for values in (*axes, z)]
    return "waves\nx, y, z\nkind of list, values\n" + "\n".join(lists) + "\n"


def _current(scene: Scene, current: Current, depth: float) -> str:
    still, profile = scene.model_copy(update={"waves": None}), current.profile
    z = [row[0] for row in profile] if isinstance(profile, list) else np.linspace(-depth, 0.0, 21).tolist()
    speeds = velocity_at(still, 0.0, np.array([[0.0, 0.0, at] for at in z]))
    rows = [(at, *map(float, speed)) for at, speed in zip(z, speeds, strict=True)]
    return "current\nprofile\nz ux uy uz\n" + "".join(" ".join(f"{v:.14g}" for v in row) + "\n" for row in rows)

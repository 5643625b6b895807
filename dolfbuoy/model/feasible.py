"""Refusal of infeasible or too large scenes before anything is built."""

import math
import os
import resource

import numpy as np

from ..elsewhere import MPI
from ..errors import InputError
from ..meshes import cable_nodes, number_of_cells
from ..scene import Scene
from ..scene.network import Network
from .rigid import cross_section, float_upright, mass_properties, shape_of, weight_per_length

#: Memory of a run [bytes]: measured 1.9 to 2.4 kB per unknown of a line and 0.7 MB per buoy, for any scheme.
PER_UNKNOWN, PER_BUOY = 1.9e3, 0.7e6


def check_feasible(scene: Scene) -> None:
    """Refuse an infeasible scene: too large for memory, an inextensible cable too short, a sinking buoy, or a mass that
    is not positive.

    Raises InputError with one sentence.
    """
    network = scene.network
    _check_memory(network, MPI.COMM_WORLD.size)
    if scene.sea is not None:
        _check_effective_masses(scene)
        for name in network.buoys:
            if scene.gravity:
                buoy, pull = network.buoys[name], hanging_weight(scene, name)
                mass = mass_properties(buoy)
                if mass.mass * scene.gravity + pull > 0:  # else its bars carry it
                    properties = shape_of(buoy), mass, scene.sea.density
                    float_upright(*properties, scene.gravity, pull, buoy.mooring_height)
    for number in range(len(network.cables)):
        _check_length(network, number)
    _check_elements(network)


def _check_elements(network: Network) -> None:
    """Check that elements are long enough: nodes are identified by their mesh coordinates, see `layout.Layout.slip`."""
    sections = [piece.section for piece in network.pieces]
    whole = sum(c.length for c in sections) + 0.1 * len(sections) * max((c.length for c in sections), default=0.0)
    for piece in network.pieces:
        c = piece.section
        shortest = np.diff(cable_nodes(c.length, c.elements, c.grading)).min() / c.position_degree
        if shortest < 4e-9 * whole:
            raise InputError(
                f"{network.key_of(piece.cable)}.elements: nodes {shortest:.2g} m apart are too close beside lines of "
                f"{whole:.4g} m: they must be {4e-9 * whole:.2g} m apart at least."
            )


def _check_length(network: Network, number: int) -> None:
    """Check the length of an inextensible cable between two fixed ends."""
    pieces = [network.pieces[k] for k in network.pieces_of(number)]
    low, high = pieces[0].ends[0], pieces[-1].ends[1]
    stretches = any(math.isfinite(piece.section.axial_stiffness) for piece in pieces)
    if not (low.held and high.held) or stretches:
        return
    key, length = network.key_of(number), sum(p.section.length for p in pieces)
    chord = np.array(high.top.position) - np.array(low.top.position)
    amplitude = np.array(high.top.amplitude or (0.0, 0.0, 0.0)) - np.array(low.top.amplitude or (0.0, 0.0, 0.0))
    moved = [row[1:] for row in high.top.motion] if high.top.motion else [amplitude * f for f in (-1.0, 0.0, 1.0)]
    longest = np.linalg.norm(chord + np.array(moved), axis=1).max()
    if longest > length * (1 + 1e-12):
        raise InputError(
            f"{key}.length = {length}: is too short, the top is up to {longest:.6g} m from the anchor, "
            "and an inextensible cable (axial_stiffness = inf) cannot stretch."
        )
    if len(pieces) == 1 and pieces[0].section.elements == 1 and pieces[0].section.position_degree == 1:
        raise InputError(
            f"{key}.elements = 1: between two held ends an inextensible element of position_degree 1 cannot move; "
            "take more elements or a higher degree."
        )


def _check_effective_masses(scene: Scene) -> None:
    """Check the effective mass of every piece of line, with its growth, and of every submerged buoy."""
    network, rho_w = scene.network, scene.sea.density
    for piece in network.pieces:
        c, area = piece.section, cross_section(piece.section)
        grown = [(1.0, 1.0), *((thicker, heavier) for _, thicker, heavier in c.marine_growth or ())]
        effective = min(mass * c.line_density + c.added_mass * rho_w * d**2 * area for d, mass in grown)
        _check_positive(f"{network.key_of(piece.cable)}.added_mass", c.added_mass, effective, "kg/m of the cable")
    for name, buoy in network.buoys.items():
        if buoy.added_mass < 0:
            effective = mass_properties(buoy).mass + buoy.added_mass * rho_w * shape_of(buoy).volume()
            key = f"{network.key_of_buoy(name)}.added_mass"
            _check_positive(key, buoy.added_mass, effective, "kg of the submerged buoy")


def _check_positive(key: str, value: float, effective: float, what: str) -> None:
    if effective <= 0:
        raise InputError(
            f"{key} = {value}: the effective mass {effective:.6g} {what} is not positive (added_mass is C_A = C_M - 1)."
        )


def hanging_weight(scene: Scene, buoy: str) -> float:
    """Lower bound of the submerged weight of lines carried by a buoy afloat above their fixed ends [N].

    For a line heavy along its whole length: the part down to the level of the fixed end, plus half of what hangs lower;
    zero for a rod clamped at both ends.  Bars between points of the buoy count in full and may lift it.
    """
    network, found = scene.network, []
    bars = [section for cable in network.bars_of(buoy) for section in network.sections_of(cable)]
    total = sum(weight_per_length(scene, c) * c.length for c in bars)
    for cable in range(len(network.cables)):
        pieces = [network.pieces[k] for k in network.pieces_of(cable)]
        ends = pieces[0].ends[0], pieces[-1].ends[1]
        for near, far, along in ((1, 0, pieces[::-1]), (0, 1, pieces)):
            rod = ends[near].clamp and ends[far].clamp
            if ends[near].kind == "buoy" and ends[near].name == buoy and ends[far].held and not rod:
                found.append(([piece.section for piece in along], -ends[far].top.position[2]))
    for sections, height in found:
        weights = [weight_per_length(scene, c) for c in sections]
        if min(weights) < 0 or (scene.sea and height < 0):
            continue
        length = sum(c.length for c in sections)
        reach = height if scene.sea else length
        left = min(reach if scene.seabed or len(sections) > 1 else (length + reach) / 2, length)
        for c, w in zip(sections, weights, strict=True):
            total += w * min(c.length, left)
            left -= min(c.length, left)
    return total


# -- size --------------------------------------------------------------------------------------------------------------


def check_size(scene: Scene, comm: MPI.Comm) -> None:
    """Refuse more ranks than elements, and more elements or buoys than memory holds.  Raises InputError."""
    cells = sum(number_of_cells(piece.section.elements) for piece in scene.network.pieces)
    if scene.cables and comm.size > cells:
        raise InputError(
            f"cable.elements = {cells}: must be at least the number of MPI ranks of this run, {comm.size}."
        )
    _check_memory(scene.network, comm.size)


def _check_memory(network: Network, ranks: int) -> None:
    cells = [number_of_cells(piece.section.elements) for piece in network.pieces]
    degrees = [(piece.section.position_degree, piece.section.tension_degree) for piece in network.pieces]
    unknowns = (n * (3 * mu + nu + 1) for n, (mu, nu) in zip(cells, degrees, strict=True))  # except one node each
    lines = sum(unknowns) * PER_UNKNOWN
    buoys = len(network.buoys) * PER_BUOY
    needed, here = (lines + buoys) / ranks, memory()
    if needed > here:
        what = f"cable.elements = {sum(cells)}" if lines > buoys else f"buoy: {len(network.buoys)} tables"
        raise InputError(
            f"{what} in all: must be fewer, they take {needed / 1e9:.3g} GB of {here / 1e9:.3g} GB memory."
        )


def memory() -> float:
    """Memory available to this process [bytes]."""
    limits = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    try:
        with open("/sys/fs/cgroup/memory.max") as file:
            limits.append(int(file.read()))
    except (OSError, ValueError):  # no such group, or "max"
        pass
    allowed = resource.getrlimit(resource.RLIMIT_AS)[0]
    return float(min(limits if allowed == resource.RLIM_INFINITY else [*limits, allowed]))

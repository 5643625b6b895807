"""Quantities of a record, each declared once for record, observer, tables, figures, page and ParaView."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import attitude
from .fields import FIELDS
from .quantity import Curve, Quantity, of


def _radius(curvature: NDArray[Any]) -> NDArray[Any]:
    with np.errstate(divide="ignore"):
        return np.asarray(1 / curvature)


_whole = of("")
_cable_vector = of("cable xyz")
_cable = of("cable")
_buoy_vector = of("buoy xyz")
_buoy = of("buoy")
_anchor = of("anchor")
_take_off = of("take_off")
_winch = of("winch")
_vessel_vector = of("vessel xyz")
_end_vector = of("attachment xyz")
_ALL: tuple[Quantity, ...] = (
    _whole("time", "s", "time"),
    _whole("time_step", "s", "step that led to this time", effort=True),
    _whole("newton_iterations", "1", "Newton iterations of that step", effort=True, integer=True),
    _cable_vector(
        "anchor_force",
        "N",
        "force that holds the lower end of the cable, s = 0",
        read=lambda n: n.each("anchor_force", 3),
        at_ends="force that holds it at {low}",
    ),
    _cable_vector(
        "end_tension",
        "N",
        "force that holds the upper end of the cable",
        read=lambda n: n.each("end_tension", 3),
        at_ends="force that holds it at {high}",
    ),
    _cable(
        "tension_top",
        "N",
        "tension at the upper end of the cable",
        read=lambda n: attitude.length(n.each("end_tension", 3)),
        main=True,
        curves=(Curve("tension", "upper end"),),
        at_ends="tension at {high}",
        compared="top tension",
        peaks="",
        cycles="",
    ),
    _cable(
        "tension_anchor",
        "N",
        "tension at the anchor",
        read=lambda n: n["tension_anchor"],
        main=True,
        curves=(Curve("tension", "lower end"),),
        at_ends="tension at {low}",
        compared="anchor tension",
        peaks="",
        cycles="",
    ),
    _cable(
        "length_on_bed",
        "m",
        "unstretched length of the cable on the sea bed",
        read=lambda n: n.each("bed", 4)[..., 0],
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        counts="minimum",
        curves=(Curve("length on the bed", "on the bed"),),
        summary="length on the sea bed",
    ),
    _cable_vector(
        "touchdown",
        "m",
        "where the cable leaves the sea bed towards its upper end; nan if nothing lies",
        read=lambda n: n.each("bed", 4)[..., 1:],
        summary="x of the touchdown",
        component="x",
    ),
    _anchor(
        "anchor_uplift",
        "N",
        "upward part of the force on the anchor",
        read=lambda n: n.pulls[..., 2],
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        summary="uplift at the anchor",
        peaks="",
    ),
    _anchor(
        "anchor_horizontal",
        "N",
        "horizontal part of the force on the anchor",
        read=lambda n: np.hypot(n.pulls[..., 0], n.pulls[..., 1]),
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        summary="horizontal force on the anchor",
        peaks="",
    ),
    _anchor(
        "needed_weight",
        "N",
        "weight in water with which the sinker just stays, H/mu + V",
        read=lambda n: n.design.needed_weight(n.pulls),
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        summary="weight in water that the sinker needs",
        peaks="",
    ),
    _anchor(
        "anchor_use",
        "1",
        "part of what the anchor holds that is taken; above 1 it moves",
        read=lambda n: n.design.use(n.pulls),
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        summary="part of what the anchor holds",
        outputs=True,
    ),
    _anchor(
        "anchor_moved",
        "m",
        "distance of the sinker from its place",
        read=lambda n: n.design.moved(n.each("joint", 3)),
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        summary="way of the sinker",
        curves=(Curve("dragging", "sinker"),),
        outputs=True,
    ),
    Quantity(
        "utilisation",
        ("segment",),
        "1",
        "largest tension over the breaking load",
        read=lambda n: n["utilisation"],
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        outputs=True,
    ),
    _cable(
        "smallest_tension",
        "N",
        "smallest tension along the cable",
        read=lambda n: n["smallest_tension"],
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        counts="minimum",
        outputs=True,
    ),
    _cable(
        "anchor_moment",
        "N m",
        "bending moment at the lower end of the cable",
        read=lambda n: n.each("bending", 3)[..., 0],
        curves=(Curve("bending moment", "lower end"),),
        at_ends="bending moment at {low}",
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        summary="bending moment at the lower end",
    ),
    _cable(
        "end_moment",
        "N m",
        "bending moment at the upper end of the cable",
        read=lambda n: n.each("bending", 3)[..., 1],
        curves=(Curve("bending moment", "upper end"),),
        at_ends="bending moment at {high}",
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        summary="bending moment at the upper end",
    ),
    _cable(
        "touchdown_moment",
        "N m",
        "bending moment where the cable leaves the sea bed; 0 if nothing lies",
        read=lambda n: n["touchdown_moment"],
        curves=(Curve("bending moment", "touchdown"),),
        shown={"statistics": ""},
        summary="bending moment at the touchdown",
    ),
    _cable(
        "largest_curvature",
        "m-1",
        "largest curvature of the cable",
        read=lambda n: n.each("bending", 3)[..., 2],
        shown={"statistics": ""},
        curves=(Curve("largest curvature", "of the cable"),),
    ),
    _cable(
        "min_bend_radius",
        "m",
        "smallest radius to which the cable is bent; inf where it is straight",
        read=lambda n: _radius(n.each("bending", 3)[..., 2]),
        summary="radius to which the cable is bent",
    ),
    _cable(
        "bend_utilisation",
        "1",
        "curvature times minimum_bend_radius, the largest of the cable",
        read=lambda n: n["bend_utilisation"],
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        summary="curvature over the allowed one",
        outputs=True,
    ),
    _buoy_vector(
        "buoy_position",
        "m",
        "position of the buoy's centre of mass, r_C",
        read=lambda n: n.buoy.position,
        shown={"statistics": "xyz", "sweep figure": "xz", "sweep page": "z"},
        curves=(
            Curve("height", "C", "z"),
            Curve("horizontal position of C", "x", "x"),
            Curve("horizontal position of C", "y", "y"),
        ),
        compared="buoy position",
        peaks="z",
    ),
    _buoy(
        "offset",
        "m",
        "horizontal distance of C from the anchor, or the middle of its anchors",
        read=lambda n: n.design.offset(n.buoy.position),
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        curves=(Curve("offset", "of C"),),
        summary="offset of C from the anchor",
        peaks="",
    ),
    _buoy(
        "freeboard",
        "m",
        "height of the lowest point of the hull's upper rim above the water at C",
        read=lambda n: n.design.freeboard(n.buoy, n.hull.surface),
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        counts="minimum",
        curves=(Curve("freeboard", "lowest of the rim"),),
        summary="freeboard",
    ),
    Quantity(
        "buoy_orientation",
        ("buoy", "quaternion"),
        "1",
        "orientation of the buoy, q_4 = (q0, q), body to world",
        read=lambda n: n.buoy.orientation,
    ),
    _buoy(
        "cone_angle",
        "degree",
        "angle between the vertical and the axis of the buoy",
        read=lambda n: attitude.cone_angle(n.buoy.orientation),
        shown=dict.fromkeys(("statistics", "sweep", "sweep figure", "sweep page"), ""),
        summary="cone angle",
        figure=True,
        paraview="cone angle",
        compared="cone angle",
        peaks="",
    ),
    of("buoy", "")(
        "lean_at_start",
        "degree",
        "cone angle with which a run begins, at rest unless the buoy is thrown",
        read=lambda n: attitude.cone_angle(n.motion.orientation),
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        summary="lean at the start",
    ),
    _buoy(
        "roll",
        "degree",
        "turn of the buoy about its own x axis, after yaw and pitch",
        standard_name="platform_roll_starboard_down",
        read=lambda n: n.turns[0],
        shown={"statistics": ""},
        curves=(Curve("angle", "roll"),),
        paraview="roll",
        peaks="",
        turning=True,
    ),
    _buoy(
        "pitch",
        "degree",
        "turn of the buoy about its y axis as the yaw leaves it",
        standard_name="platform_pitch_fore_down",
        read=lambda n: n.turns[1],
        shown={"statistics": ""},
        curves=(Curve("angle", "pitch"),),
        paraview="pitch",
        peaks="",
    ),
    _buoy(
        "yaw",
        "degree",
        "turn of the buoy about the vertical, before pitch and roll",
        standard_name="platform_yaw_fore_port",
        read=lambda n: n.turns[2],
        curves=(Curve("angle", "yaw"),),
        paraview="yaw",
        turning=True,
    ),
    _take_off(
        "take_off_length",
        "m",
        "distance of the ends of the take-off",
        read=lambda n: n.each("take_off", 3)[..., 0],
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        curves=(Curve("length of take-offs", "of the ends"),),
        summary="length of the take-off",
    ),
    _take_off(
        "take_off_tension",
        "N",
        "tension of the take-off, positive where it draws its ends together",
        read=lambda n: n.each("take_off", 3)[..., 1],
        shown=dict.fromkeys(("statistics", "sweep"), ""),
        curves=(Curve("tension of take-offs", "of the take-off"),),
        summary="tension of the take-off",
        peaks="",
    ),
    _take_off(
        "absorbed_power",
        "W",
        "power that the take-off absorbs",
        read=lambda n: n.each("take_off", 3)[..., 2],
        main=True,
        counts="mean",
        curves=(Curve("absorbed power", "of the take-off"),),
        summary="absorbed power",
        peaks="",
    ),
    _winch(
        "winch_length",
        "m",
        "unstretched length of the line with the winch",
        read=lambda n: n["winch"],
        curves=(Curve("unstretched length", "at the winch"),),
        summary="unstretched length by the winch",
    ),
    _vessel_vector(
        "wind_force",
        "N",
        "force of the wind on the vessel",
        read=lambda n: n.each("wind", 3),
        shown={"statistics": "xy"},
        curves=(Curve("wind force on vessels", "x", "x"), Curve("wind force on vessels", "y", "y")),
        summary="wind force",
    ),
    _buoy_vector(
        "drift_force",
        "N",
        "force of the waves' mean drift, by Newman's approximation",
        read=lambda n: n.each("drift", 3),
        shown={"statistics": "xy"},
        curves=(Curve("mean drift of waves", "x", "x"), Curve("mean drift of waves", "y", "y")),
        summary="force of mean drift",
    ),
    _buoy_vector("linear_momentum", "kg m s-1", "linear momentum of the buoy, p", read=lambda n: n.motion.momentum),
    _buoy_vector(
        "angular_momentum",
        "kg m2 s-1",
        "angular momentum of the buoy about C, L_C (world frame)",
        read=lambda n: n.motion.angular_momentum,
    ),
    _end_vector("mooring_point", "m", "mooring point, r_O", read=lambda n: n.attachment.point),
    _end_vector("mooring_force", "N", "force of the cable on the buoy, T_O", read=lambda n: n.attachment.force),
    _buoy(
        "displaced_mass",
        "kg",
        "mass of the displaced water, M_D",
        read=lambda n: n.hull.mass,
        paraview="displaced mass",
    ),
    _buoy_vector("buoyancy_center", "m", "centre of buoyancy, r_BC", read=lambda n: n.hull.centre),
    _buoy("submerged_length", "m", "wetted length of the axis, H_sub", read=lambda n: n.hull.length),
    _buoy("submerged_diameter", "m", "mean diameter of the wetted hull, <D_sub>", read=lambda n: n.hull.diameter),
    _buoy(
        "surface_elevation",
        "m",
        "water surface above C, eta(r_C, t)",
        standard_name="sea_surface_height_above_mean_sea_level",
        read=lambda n: n.hull.surface,
        shown=dict.fromkeys(("statistics", "statistics figure"), ""),
        curves=(Curve("height", "water"),),
        paraview="surface elevation",
        peaks="",
        place="at the buoy",
    ),
    Quantity(
        "fixed_point_elevation",
        (),
        "m",
        "water surface at a fixed point",
        over="sample",
        shown=dict.fromkeys(("statistics", "statistics figure"), ""),
        peaks="",
        place="at a fixed point",
    ),
    Quantity(
        "place_tension",
        ("place",),
        "N",
        "tension at a place of a line that [fatigue] looks at",
        read=lambda n: n["place_tension"],
        shown={"statistics": ""},
        curves=(Curve("tension at places", ""),),
        cycles="",
    ),
    Quantity("place_s", ("place",), "m", "unstretched arc length of the place on its segment", over=""),
    Quantity("joint_position", ("joint", "xyz"), "m", "position of the joints", read=lambda n: n.each("joint", 3)),
    *FIELDS,
)
ERROR = "_error"
LEADING = "minus what it were without the leading error of the time steps"
_ALL += tuple(
    Quantity(one.name + ERROR, one.dims, one.unit, f"{one.name} {LEADING}", turning=one.turning, effort=True)
    for one in _ALL
    if one.has_outputs or one.name == "anchor_force"
)
#: Quantities by name; all entries are recorded and shown.
QUANTITIES: dict[str, Quantity] = {quantity.name: quantity for quantity in _ALL}


def less(one: Any, other: Any) -> NDArray[Any]:
    """Difference of two arrays; nan where both are infinite, as for the bend radius of a straight line."""
    with np.errstate(invalid="ignore"):
        return np.asarray(one - other)


def errors(values: Mapping[str, NDArray[Any]], corrected: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Errors of quantities by the names of their variables, from values of a run and its corrected trajectory."""
    found = {}
    for name in values.keys() & corrected.keys():
        if (error := QUANTITIES.get(name + ERROR)) is not None:
            difference = less(values[name], corrected[name])
            found[error.name] = (difference + 180) % 360 - 180 if error.turning else difference
    return found


def over(*axes: str) -> dict[str, Quantity]:
    """Quantities over these axes ("time", "frame", "run", ...), by name."""
    return {name: quantity for name, quantity in QUANTITIES.items() if quantity.over in axes}


def shown_in(place: str) -> list[str]:
    """Series shown in a place of EVERYWHERE, in the order of declaration."""
    every = ((one, "" if one.main else one.shown.get(place)) for one in QUANTITIES.values())
    return [name for one, components in every if components is not None for name in one.series(components)]


def chosen(field_name: str) -> set[str]:
    """Series whose `peaks` or `cycles` are kept."""
    every = ((one, getattr(one, field_name)) for one in QUANTITIES.values())
    return {name for one, components in every if components is not None for name in one.series(components)}


def declared(series: str) -> Quantity:
    """The quantity of a series, which may be a component."""
    return QUANTITIES[max((one for one in QUANTITIES if series == one or series.startswith(f"{one}_")), key=len)]

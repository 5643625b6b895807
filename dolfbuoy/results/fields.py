"""Quantities along lines, in frames and over all steps, and those known at the beginning."""

from .quantity import Quantity, of

_frame_nodes = of("node xyz", "frame")
_frame_sizes = of("node", "frame")
_run_nodes = of("node xyz", "run")
_run_sizes = of("node", "run")
_run_cells = of("cell", "run")
_node = of("node", "")
_cell = of("cell", "")
_component = of("component", "")
#: Fields in the order of a record.
FIELDS: tuple[Quantity, ...] = (
    Quantity("frame", (), "s", "time of a frame", over="frame"),
    _frame_nodes("cable_position", "m", "position of the cable's nodes, in order from the anchor"),
    _frame_nodes("cable_velocity", "m s-1", "velocity of the cable's nodes, in order from the anchor"),
    _frame_nodes(
        "cable_moment", "N m", "m = EI t' of the cable's nodes; the bending moment is t x m", paraview="moment m"
    ),
    _frame_sizes("curvature", "m-1", "curvature in the cable's nodes, in order from the anchor", paraview="curvature"),
    Quantity("cable_tension", ("cell",), "N", "mean tension of each element, in order from the anchor", over="frame"),
    _run_nodes("cable_position_minimum", "m", "least coordinates of the cable's nodes in any step"),
    _run_nodes("cable_position_maximum", "m", "largest coordinates of the cable's nodes in any step"),
    _run_sizes(
        "curvature_maximum",
        "m-1",
        "largest curvature in the cable's nodes in any step",
        paraview="largest curvature",
    ),
    _run_sizes("curvature_maximum_after_ramp", "m-1", "largest curvature in the nodes from the end of the ramp on"),
    _run_cells("cable_tension_minimum", "N", "least tension at any node of each element in any step"),
    _run_cells(
        "cable_tension_maximum",
        "N",
        "largest tension at any node of each element in any step",
        paraview="largest tension",
    ),
    _run_cells("cable_tension_minimum_after_ramp", "N", "least tension of each element from the end of the ramp on"),
    _run_cells("cable_tension_maximum_after_ramp", "N", "largest tension of each element from the end of the ramp on"),
    _run_cells(
        "cable_utilisation_maximum",
        "1",
        "cable_tension_maximum over the breaking load; nan without one",
        paraview="largest utilisation",
    ),
    _node("s", "m", "unstretched arc length of the nodes"),
    _cell("s_cell", "m", "unstretched arc length of the middle of each element"),
    _node("cable_of_node", "1", "number of the cable to which each node belongs, from 0", integer=True),
    _cell("cable_of_cell", "1", "number of the cable to which each element belongs, from 0", integer=True),
    _cell("segment_of_cell", "1", "number of the segment of its cable, from 0", integer=True),
    _cell("parted_at", "s", "when each element has parted; nan for those that are whole", changing=True),
    _cell("growth_diameter", "1", "factor of marine growth on the diameter of each element"),
    _cell("growth_mass", "1", "factor of marine growth on the mass of each element"),
    _cell("growth_weight", "N", "weight in water that marine growth adds to each element"),
    _component("wave_amplitude", "m", "amplitude of a component of the sea"),
    _component("wave_period", "s", "its period"),
    _component("wave_direction_deg", "degree", "direction towards which it runs, from x towards y"),
    _component("wave_phase_deg", "degree", "its phase in a cos(k.x - omega t + phase)"),
)

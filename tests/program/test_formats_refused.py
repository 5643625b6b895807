"""Invalid MoorDyn, MoorPy and RAFT input is refused in one sentence; MoorDyn comparisons use end forces on both sides.

Source: MoorDyn's manual, "Input Files": every column has a value, units are m, kg, s and N, ends are points; MoorDyn
itself refuses a line that begins below the bed.
"""

import numpy as np
import pytest
import xarray as xr
from test_formats_numbers import BODY, FREE, LINES, MOORING

from dolfbuoy.errors import InputError
from dolfbuoy.formats import from_moordyn, from_yaml
from dolfbuoy.scene import load_scene
from dolfbuoy.studies import peer

BODY = BODY.format(**FREE)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("AttachA AttachB", "A AttachB"), "line 15: 'ID LineType A AttachB UnstrLen NumSegs LineOutputs' must name"),
        (("Diam Mass/m EA", "Diam EA"), "and has no mass_density"),
        (("ID Attachment X Y Z", "ID Attachment X Y"), "line 9"),
        (("TypeName Diam Mass/m EA BA/-zeta", "TypeName Diam Mass/m EA BA/-zeta BA"), "line 4: two columns"),
        (("(-) (m) (kg/m) (N)", "(-) (m) (kg/m) (kN)"), "line 5: the unit (kN) of EA is none of MoorDyn's"),
        (("(-) (m) (kg/m) (N)", "(-) (mm) (kg/m) (N)"), "line 5: the unit (mm) of Diam"),
        (("(#) (-) (#) (#) (m)", "(#) (-) (#) (#) (ft)"), "line 16: the unit (ft) of UnstrLen"),
        (("221 41 p", "221"), "line 17: there are 5 values in 7 columns"),
        (("221 41 p", "221 41 p 7"), "line 17: there are 8 values in 7 columns"),
        (("221 41 p", "nan 41 p"), "line 17: length is 'nan'"),
        (("5.1e8", "inf"), "line 6: EA is the file inf"),
        (("-100.5 0", "-inf 0"), "line 11: z is '-inf'"),
        (("1013 WtrDnsty", "nan rhoW"), "line 22: rho is 'nan'"),
        (("9.79 g", "inf g"), "line 21: g is 'inf'"),
        (("221 41 p", "221 0 p"), "line 17: NumSegs is 0: must be a whole number from 1 on"),
        (("221 41 p", "221 4.5 p"), "line 17: NumSegs is 4.5"),
        (("1 chain 1 3", "1 chain 3 3"), "line 17: both ends are on point 3"),
        (("1 chain 1 3", "1 chain R1A 3"), "line 17: there is no end R1A"),
        (("1 chain 1 3", "1 chain R1C 3"), "line 17: an end on 'R1C' is not known: must be a point, or an end"),
        (("1 chain 1 3", "1 chain 1 4"), "line 17: there is no point 4"),
        (("1 chain 1 3", "1 cable 1 3"), "line 17: LineType 'cable' is none of the LINE TYPES: chain, rope"),
        (("2 Coupled", "1 Coupled"), "line 12: 1 of POINTS is given twice"),
        (("rope 0.07", "chain 0.07"), "line 7: chain of LINE TYPES is given twice"),
        (("2 rope 3 2", "1 rope 3 2"), "line 18: 1 of LINES is given twice"),
        (("2 Coupled", "2 Body3"), "line 12: there is no body 3"),
        (("2 Coupled", "2 Glued"), "line 12: the attachment 'Glued'"),
        (("102.5 WtrDpth", "100 WtrDpth"), "line 11: z = -100.5 is below the bed, which WtrDpth puts at -100 m"),
        (("102.5 WtrDpth", "0 WtrDpth"), "line 23: WtrDpth is 0: must be above 0"),
        (("102.5 WtrDpth", "-102.5 WtrDpth"), "line 23: WtrDpth is -102.5: must be above 0"),
        (("102.5 WtrDpth", "WtrDpth 102.5"), "line 23: 'WtrDpth 102.5' is no option: a value and then its name"),
        (("102.5 WtrDpth", "WtrDpth"), "line 23: 'WtrDpth' is no option"),
        (("9.79 g", "9.79 g\n9.81 g"), "line 22: the option g is given twice, 9.79 and 9.81"),
        (("2.1e6 kBot", "-1 kBot"), "line 24: kBot is -1: must be 0 or above"),
    ],
)  # fmt: skip
def test_a_file_of_moordyn(change, words):
    with pytest.raises(InputError) as error:
        from_moordyn.scene_of(LINES.replace(*change))
    assert words in str(error.value)


@pytest.mark.parametrize("heights", [(0, -5, -60), (5, -5, -60), (-59, -5, -60), (-59, -61, -58), (0, 1, 2), (0, 0, 0)])
def test_a_depth_that_no_anchor_gives_is_asked_for(heights):
    """The deepest point floats or is moved, or all are above the water: 1 m would put a joint 59 m below the bed."""
    anchor, ship, joint = heights
    text = LINES.replace("102.5 WtrDpth\n", "").replace("12 -100.5", f"12 {anchor}")
    text = text.replace("3 4 -5", f"3 4 {ship}").replace("7 -60", f"7 {joint}")
    with pytest.raises(InputError) as error:
        from_moordyn.scene_of(text)
    assert str(error.value) == (
        "there is no WtrDpth, and no fixed point is the deepest: give the depth as OPTIONS, NUMBER WtrDpth."
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("0|0|0.5", "0|0.5"), "line 16: CG is '0|0.5': must be 1 or 3 numbers, with | between them"),
        (("10|20|30", "10|20"), "line 16: I is '10|20': must be 1 or 3 numbers"),
        (("10|20|30", "10|x|30"), "line 16: I is '10|x|30'"),
        (("10|20|30 0 0 0", "10|20|30 0 1|2|3|4 0"), "line 16: CdA is '1|2|3|4': must be 1 or 2 or 3 or 6 numbers"),
        (("2 wide Body1 0 0 -1", "2 wide Glued 0 0 -1"), "line 21: the attachment 'Glued' of a rod is not known"),
        (("2 wide Body1", "2 hull Body1"), "line 21: RodType 'hull' is none of the ROD TYPES: wide, slim"),
        (("2 wide Body1", "1 wide Body1"), "line 21: 1 of RODS is given twice"),
        (("slim 1 50 0.61", "wide 1 50 0.61"), "line 12: wide of ROD TYPES is given twice"),
        (("Xa Ya Za Xb Yb Zb", "Xa Ya Za Xb Yb Q"), "line 18"),
    ],
)
def test_a_body_of_moordyn(change, words):
    with pytest.raises(InputError) as error:
        from_moordyn.scene_of(BODY.replace(*change))
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("endB: clump", "endB: foot 1"), "lines, 1: endA and endB are both 'foot 1': must be two points"),
        (("endB: clump", "endB: nowhere"), "lines, 1: endB = 'nowhere' is none of the points: foot 1, ship, clump"),
        (
            ("type: R4 chain, length", "type: R5, length"),
            "lines, 1: type 'R5' is none of the line_types: R4 chain, wire",
        ),
        (("length: 251", "length: .nan"), "lines, 1: length is nan, which is no number"),
        (("length: 251", "length: true"), "lines, 1: length is True"),
        (("length: 251", "len: 251"), "lines, 1: length is None"),
        (("-200.5]", "-.inf]"), "points, foot 1: location is -inf"),
        (("-200.5]", "]"), "points, foot 1: location must be [x, y, z]"),
        (("type: vessel", "type: glued"), "points, ship: the type 'glued' is not known: fixed, vessel or free"),
        (("mass_density: 103, ", ""), "line_types, R4 chain: mass_density is missing"),
        (
            ("mass_density: 103, ", "mass_density: 103, EI: -1, "),
            "line_types, R4 chain: EI is -1: must be 0 or greater",
        ),
        (
            ("mass_density: 103, ", "mass_density: 103, EI: stiff, "),
            "line_types, R4 chain: EI is 'stiff', which is no number",
        ),
        (("name: clump", "name: ship"), "points: 'ship' is given twice"),
        (
            ("water_depth: 202", "water_depth: 102"),
            "points, foot 1: z = -200.5 is below the bed, which water_depth puts",
        ),
        (("[1, 2, -15]", "[1, 2, -215]"), "points, ship: z = -215 is below the bed, which water_depth puts at -202 m"),
        (("g: 9.79", "g: high"), "site.g is 'high', which is no number"),
        (("mooring:", "mooring:\n  file: lines.dat"), "mooring.file = 'lines.dat': the mooring is in that file"),
    ],
)
def test_a_file_of_yaml(change, words):
    pytest.importorskip("yaml")
    with pytest.raises(InputError) as error:
        from_yaml.scene_of(MOORING.replace(*change))
    assert words in str(error.value)


def test_a_design_without_depth_whose_deepest_point_floats():
    pytest.importorskip("yaml")
    text = MOORING.replace("water_depth: 310, ", "").replace("water_depth: 202", "rho: 1000").replace("-200.5", "-149")
    with pytest.raises(InputError, match="there is no water_depth, and no fixed point is the deepest"):
        from_yaml.scene_of(text)


# -- a comparison ------------------------------------------------------------------------------------------------------


def test_both_ends_of_a_comparison_are_forces():
    """Not the mean of an element beside it, which lacks half its weight."""
    scene = load_scene({"cable": {"length": 5.0, "line_density": 1.0, "top": {"kind": "fixed", "position": [3, 0, 4]}}})
    dims = ("time", "cable", "xyz")
    forces = {"anchor_force": (dims, [[[2.0, 3.0, 6.0]]]), "end_tension": (dims, [[[1.0, 4.0, 8.0]]])}
    means = {name: (("time", "cable"), [[5.0]]) for name in ("tension_top", "tension_anchor")}
    found = peer._ours(xr.Dataset(forces | means), scene)
    assert {name: float(values[0]) for name, values in found.items()} == {
        "cable: tension_top": 9.0,
        "cable: tension_anchor": 7.0,
    }


@pytest.mark.parametrize(
    ("ours", "theirs", "of", "relative"),
    [
        ([0.0, 10.0, 20.0], [1.0, 11.0, 21.0], "range", 0.05),
        ([500.0, 500.0, 500.0], [505.0, 505.0, 505.0], "value", 0.01),
        ([-500.0, -500.0, -500.1], [-505.0, -505.0, -505.1], "value", 5 / 500.1),
        ([1000.0, 1000.0, 1002.0], [1001.0, 1001.0, 1003.0], "range", 0.5),
    ],
)
def test_a_difference_is_relative_to_the_range_or_to_the_value_of_a_constant(ours, theirs, of, relative):
    t = np.array([0.0, 1.0, 2.0])
    row = peer._row("x", "N", (t, {"x": np.array(ours)}), (t, {"x": np.array(theirs)}), 0.0, None)
    assert (row["of"], row["relative"]) == (of, pytest.approx(relative, rel=1e-9))
    assert row["difference"] == pytest.approx(abs(theirs[0] - ours[0]), rel=1e-9)
    assert (row["least"], row["largest_moordyn"]) == (min(ours), max(theirs))
    assert (row["bar"], row["beyond"]) == (None, None)


@pytest.mark.parametrize(("bar", "beyond"), [(0.9, "yes"), (1.1, "no")])
def test_largest_values_differ_by_more_than_the_bar_of_ours_or_not(bar, beyond):
    """Largest values of 21 and 22, whatever the rest does."""
    ours, theirs = ((np.array([0.0, 1.0]), {"x": np.array(values)}) for values in ([0.0, 21.0], [-50.0, 22.0]))
    row = peer._row("x", "N", ours, theirs, 0.0, bar)
    assert (row["bar"], row["beyond"]) == (bar, beyond)

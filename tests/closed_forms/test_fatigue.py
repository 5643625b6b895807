"""Fatigue: curves by name or constants, Miner sums of known cycles, locations along lines, lives in a scatter diagram.

Source: tables of API RP 2SK (3rd edition), DNV-OS-E301 and IACS by hand; ASTM E1049-85; a hanging weight; rainflow
counts of sinusoids in closed form.
"""

import math

import numpy as np
import pytest
import xarray as xr
from dynamics_helpers import MOORED, merged
from every_key import changed, shows
from mpi_helpers import needs_mpirun, start_scenes

from dolfbuoy import InputError, load_scene, simulate, solve_static
from dolfbuoy.check import check
from dolfbuoy.commands.statistics import _lives, _of_lives
from dolfbuoy.results.lifetime import lifetime
from dolfbuoy.results.record import read
from dolfbuoy.results.sample import YEAR, Fatigue, sample_of
from dolfbuoy.results.series import Series
from dolfbuoy.results.statistics import Run, together
from dolfbuoy.results.summary import life_rows, summary
from dolfbuoy.results.tables import years

MBL, BAR = 1e6, 0.05
AREA = math.pi / 2 * BAR**2
#: Cycles to failure at R = 0.1 of the breaking load or 50 MPa; of wires at a mean of 0.3 of it.
CYCLES = {
    "API studless": 316e3,
    "API studlink": 1e6,
    "API connecting link": 178e3,
    "API six-strand": 10 ** (3.20 - 2.79 * 0.3 + 4.09),
    "API spiral strand": 10 ** (3.25 - 3.43 * 0.3 + 5.05),
    "DNV studless": 6e10 / 50**3,
    "DNV studlink": 1.2e11 / 50**3,
    "DNV six-strand": 3.4e14 / 50**4,
    "DNV spiral strand": 1.7e17 / 50**4.8,
    "DNV polyester": 0.259 * 10**13.46,
    "50 MBL^4": 50e4,
    "6e10 MPa^3": 6e10 / 50**3,
    "1e15 N^3": 1e15 / 1e5**3,
    "1e6 kN^3": 1e6 / 100**3,
}


def sampled(ranges, counts=None, mean=0.3 * MBL, duration=100.0, **strength):
    """A sample of one line with these cycles of its tension."""
    line = {"breaking_load": MBL} | strength
    counts = np.ones(len(ranges)) if counts is None else counts
    return {
        "duration": duration,
        "series": {"tension_top of line": {"mean": mean, "standard_deviation": 1.0, "maximum": mean}},
        "peaks": {},
        "cycles": {"tension_top of line": [list(ranges), list(counts)]},
        "strength": {"tension_top of line": line},
    }


def damage(sample, **how):
    return Fatigue(**how).damage(sample, "tension_top of line").sum


@pytest.mark.parametrize(("name", "cycles"), CYCLES.items())
def test_one_cycle_of_each_curve(name, cycles):
    of_stress = "DNV s" in name or "MPa" in name
    sample = sampled([50e6 * AREA if of_stress else 0.1 * MBL], **({"steel_area": AREA} if of_stress else {}))
    assert damage(sample, curve=name) == pytest.approx(1 / cycles, rel=1e-12)


def test_a_sinusoid_in_closed_form():
    """n cycles of the range 2 a do n (2 a/MBL)^3/316, whatever the mean; those of a wire more at a higher one."""
    t, mean, a, n = np.linspace(0, 60.0, 6001), 3e5, 4e4, 10
    series = Series("tension_top of line", t, mean + a * np.cos(2 * np.pi * n * t / 60))
    ranges, counts = series.ranges()
    sample = sampled(ranges, counts, series.mean)
    assert damage(sample, curve="API studless") == pytest.approx(n * (2 * a / MBL) ** 3 / 316, rel=1e-9)
    wire = n * (2 * a / MBL) ** 5.05 / 10 ** (3.25 - 3.43 * mean / MBL)
    assert damage(sample, curve="API spiral strand") == pytest.approx(wire, rel=1e-4)
    assert damage(sampled(ranges, counts, -mean), curve="API spiral strand") == pytest.approx(
        n * (2 * a / MBL) ** 5.05 / 10**3.25, rel=1e-9
    )


def test_the_series_of_astm_e1049():
    """Half cycles of 3, 6, 9 and one and a half of 4, one of 8, in hundredths of the breaking load."""
    x = 0.01 * MBL * np.array([-2, 1, -3, 5, -1, 3, -4, 4, -2.0])
    ranges, counts = Series("tension_top of line", np.arange(9.0), x).ranges()
    by_hand = (0.5 * (3**3 + 6**3 + 9**3) + 1.5 * 4**3 + 8**3) * 1e-6 / 1000
    assert damage(sampled(ranges, counts), curve="API studlink") == pytest.approx(by_hand, rel=1e-12)


def test_chain_of_a_better_grade_is_measured_by_the_bar():
    """76 mm: ORQ breaks at 21.1 76^2 (44 - 0.08 76) = 4621 kN, R4 at 6001 kN; a weaker chain keeps its own load."""
    orq, ranges = 21.1 * 76**2 * (44 - 0.08 * 76), [5e5]
    chain = load_scene({"cable": hanging("chain R4 studless 76 mm")}).network.pieces[0].section
    assert chain.breaking_load == pytest.approx(27.4 / 21.1 * orq, rel=1e-12)
    assert chain.steel_area == pytest.approx(2 * math.pi * 0.076**2 / 4, rel=1e-12)
    line = {"breaking_load": chain.breaking_load, "steel_area": chain.steel_area}
    assert damage(sampled(ranges, **line), curve="API studless") == pytest.approx((5e5 / orq) ** 3 / 316, rel=1e-12)
    weak = line | {"breaking_load": 0.5 * orq}
    assert damage(sampled(ranges, **weak), curve="API studless") == pytest.approx((1e6 / orq) ** 3 / 316, rel=1e-12)
    assert damage(sampled(ranges, **line), curve="316 MBL^3") == pytest.approx(
        (5e5 / chain.breaking_load) ** 3 / 316, rel=1e-12
    )
    stress = 5e5 / (math.pi / 2 * 76**2)
    assert damage(sampled(ranges, **line), curve="DNV studless") == pytest.approx(stress**3 / 6e10, rel=1e-12)


@pytest.mark.parametrize("lost", [0.001, 0.004])
def test_corrosion_thins_the_bar(lost):
    """Stress by the smaller area, tension by the load of the smaller bar; wires keep theirs."""
    line, ranges = {"steel_area": AREA, "breaking_load": MBL}, [1e5]
    thin = BAR - lost
    stress = 1e5 / (math.pi / 2 * (1e3 * thin) ** 2)
    assert damage(sampled(ranges, **line), curve="DNV studlink", corrosion=lost) == pytest.approx(stress**3 / 1.2e11)
    weaker = (1e3 * thin) ** 2 * (44 - 80 * thin) / ((1e3 * BAR) ** 2 * (44 - 80 * BAR))
    found = damage(sampled(ranges, **line), curve="316 MBL^3", corrosion=lost)
    assert found == pytest.approx((0.1 / weaker) ** 3 / 316, rel=1e-12)
    for wire in ("API six-strand", "DNV polyester", "1e15 N^3"):
        assert damage(sampled(ranges, **line), curve=wire, corrosion=lost) == damage(
            sampled(ranges, **line), curve=wire
        )


def test_small_and_large_ranges_of_a_steep_curve():
    """R^13 of a small range is 1e-160 and no error; a range of nothing does nothing."""
    found = damage(sampled([1e-6, 0.0, 0.5 * MBL]), curve="DNV polyester")
    assert found == pytest.approx(0.5**13.46 / 0.259, rel=1e-12)


# -- what is refused ---------------------------------------------------------------------------------------------------


def hanging(material, **more):
    return {"material": material, "length": 10.0, "top": {"kind": "free", "force": [0.0, 0.0, 1e6]}} | more


PLAIN = {"line_density": 50.0, "length": 10.0, "top": {"kind": "free", "force": [0.0, 0.0, 1e6]}}
REFUSED = {
    "no name": ({"curve": "API chain"}, {}, "fatigue.curve = 'API chain': must be one of API studless"),
    "no unit": ({"curve": "6e10"}, {}, "with the unit of its ranges"),
    "odd unit": ({"curve": "6e10 psi^3"}, {}, "with the unit of its ranges"),
    "no number": ({"curve": "nan MPa^3"}, {}, "with the unit of its ranges"),
    "no exponent": ({"curve": "6e10 MPa^0"}, {}, "with the unit of its ranges"),
    "no curve": ({}, {}, "fatigue.curve: must be given"),
    "no load": ({"curve": "API studless"}, {}, "cable.breaking_load: must be given, the fatigue curve 'API studless'"),
    "no area": ({"curve": "DNV studless"}, {"breaking_load": 1e6}, "cable.steel_area: must be given"),
    "corrosion": (
        {"curve": "DNV studless", "corrosion": 0.09, "corrosion_rate": 0.01},
        {"steel_area": AREA},
        "= 0.09: must be less than the bar of the chain",
    ),
    "bar": ({"curve": "API studless", "corrosion": 0.001}, {"breaking_load": 1e6}, "cable.steel_area: must be given"),
    "wire": ({"curve": "API six-strand", "corrosion": 0.001}, {"breaking_load": 1e6}, "goes with chains"),
    "dense": ({"curve": "1e15 N^3", "spacing": 1e-4}, {}, "fatigue.spacing = 0.0001: must be at least"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case):
    fatigue, line, words = REFUSED[case]
    with pytest.raises(InputError) as error:
        load_scene({"cable": PLAIN | line, "fatigue": fatigue})
    assert words in str(error.value)
    assert str(error.value).count("\n") == 0


def test_fatigue_without_lines_is_refused():
    buoy = load_scene("free-buoy").to_dict()
    with pytest.raises(InputError, match=r"cable: must be given, \[fatigue\] is of lines"):
        load_scene(buoy | {"fatigue": {"curve": "1e15 N^3"}})


def test_a_constant_without_a_unit_is_asked_for(call, tmp_path):
    """6e10 of MPa, taken for N, made a Miner sum of 2e8 a year without a question."""
    for text in ("6e10", "1e15"):
        code, _, err = call("statistics", tmp_path, "--constant", text, "--out", tmp_path / "st")
        assert code == 2
        assert f"--constant {text}: needs the unit of the ranges with its exponent, like '6e10 MPa^3'" in err
    code, _, err = call("statistics", tmp_path, "--curve", "API", "--out", tmp_path / "st")
    assert code == 2
    assert "--curve API: must be one of API studless" in err


def test_a_curve_that_a_line_has_no_number_for():
    sample = sampled([1e5])
    with pytest.raises(InputError, match=r"tension_top of line: steel_area: must be given, .* of the line there"):
        damage(sample, curve="DNV studless")
    for how in ({"curve": "API"}, {"corrosion": -0.1}, {"safety_factor": 0.0}, {"curve": "1 N^3", "constant": 1.0}):
        with pytest.raises(InputError, match=next(reversed(how))):
            Fatigue(**how)


def test_check_names_what_ranges_are_measured_against():
    fatigue = {"curve": "API studless"}
    told = check({"cable": hanging("chain R4 studless 76 mm"), "fatigue": fatigue})
    numbers = {name: (value, unit) for name, value, unit, _ in told.numbers}
    orq = 21.1 * 76**2 * (44 - 0.08 * 76)
    assert numbers["R = 1 of the fatigue curve 'API studless'"] == (pytest.approx(orq), "N")
    assert not any("ORQ" in sentence for sentence in told.warnings)
    told = check({"cable": PLAIN | {"breaking_load": 1e6}, "fatigue": fatigue})
    assert any("API refers ranges of chain to the breaking load of grade ORQ" in text for text in told.warnings)


# -- places ------------------------------------------------------------------------------------------------------------

#: A lazy wave over four lengths of which one floats, on a bed: two joints, touchdown, hog, sag.
LAZY = merged(
    load_scene("lazy-wave").to_dict(),
    **{"material.riser.breaking_load": 1e6, "material.floats.breaking_load": 2e6, "current": None},
    fatigue={"curve": "API six-strand"},
    time={"end": 0.4, "step": 0.1, "output_every": 0.1, "scheme": "bdf2"},
)


@pytest.fixture(scope="module")
def lazy():
    return simulate(LAZY)


def test_places_of_a_lazy_wave(lazy):
    names = lazy.place.values.tolist()
    assert names == [
        "cable.0 at touchdown",
        "cable.0 at upper end",
        "cable.1 at lower end",
        "cable.1 at hog",
        "cable.1 at upper end",
        "cable.2 at lower end",
        "cable.2 at sag",
    ]
    s, z = lazy.s.values, lazy.cable_position.values[0, :, 2]
    before = {"cable.0": 0.0, "cable.1": 160.0, "cable.2": 230.0}
    along = {
        name.partition(" at ")[2]: before[name.partition(" at ")[0]] + float(at)
        for name, at in zip(names, lazy.place_s.values, strict=True)
    }
    floating = (s > along["touchdown"] + 1) & (s < along["hog"] + 20)
    assert along["hog"] == pytest.approx(s[floating][z[floating].argmax()])
    hanging_part = s > along["hog"]
    assert along["sag"] == pytest.approx(s[hanging_part][z[hanging_part].argmin()])
    assert along["touchdown"] == pytest.approx(float(lazy.length_on_bed[0, 0]), abs=1e-6)


def test_tensions_at_places_are_those_of_their_elements(lazy):
    """Of degree 0, in every frame; at joints those of the last element below and the first one above."""
    segment, s = lazy.segment_of_cell.values, lazy.s_cell.values
    before = np.array([0.0, 160.0, 230.0])
    for name, at in zip(lazy.place.values.tolist(), lazy.place_s.values, strict=True):
        number = int(name.partition(" at ")[0].rpartition(".")[2])
        mine = np.flatnonzero(segment == number)
        away = np.abs(s[mine] - before[number] - at)
        nearest = mine[np.flatnonzero(away < away.min() + 1e-6)[0]]
        np.testing.assert_array_equal(lazy.place_tension.sel(place=name), lazy.cable_tension[:, nearest])


@pytest.mark.parametrize("degrees", [(1, 0), (2, 1)])
def test_spacing_on_a_chain_that_hangs(degrees):
    """Tension at s is the weight below it and the pull, at elements' middles or nodes of T."""
    cable = PLAIN | {"length": 10.0, "elements": 5, "position_degree": degrees[0], "tension_degree": degrees[1]}
    rest = solve_static({"cable": cable, "fatigue": {"curve": "1e15 N^3", "spacing": 2.5}})
    assert rest.place.values.tolist() == ["cable at 2.5 m", "cable at 5 m", "cable at 7.5 m"]
    at = np.array([3.0, 5.0, 7.0] if degrees[1] == 0 else [2.0, 4.0, 8.0])
    np.testing.assert_allclose(rest.place_tension, 1e6 - 50 * 9.81 * (10 - at), rtol=1e-9)


def test_nothing_is_recorded_unasked():
    scene = merged(MOORED, cable__breaking_load=2e4, cable__elements=4, time={"end": 0.2, "step": 0.05})
    record = simulate(scene)
    assert not {"place", "place_tension", "place_s"} & set(record.variables)
    asked = simulate(merged(scene, fatigue={"curve": "API studless", "spacing": 5.0}))
    for name in record.data_vars:
        np.testing.assert_array_equal(record[name], asked[name])


def test_a_resumed_run_keeps_its_places(tmp_path):
    """To the last bit: places of the start, not of where the line is by then."""
    whole = simulate(LAZY)
    simulate(LAZY, out=tmp_path / "run", time__end=0.2)
    again = simulate(resume=tmp_path / "run", time__end=0.4)
    for name in ("place_tension", "place_s", "place", "time"):
        np.testing.assert_array_equal(whole[name], again[name])


@pytest.mark.slow
@needs_mpirun
@pytest.mark.mpi
def test_places_on_two_ranks(lazy, tmp_path):
    done = start_scenes(2, {"lazy": LAZY}, tmp_path)
    assert done.returncode == 0, done.stderr
    found = read(tmp_path / "lazy" / "results.nc")
    assert found.place.values.tolist() == lazy.place.values.tolist()
    np.testing.assert_allclose(found.place_s, lazy.place_s, rtol=1e-6)
    np.testing.assert_allclose(found.place_tension, lazy.place_tension, rtol=1e-6)


# -- keys, and lives ---------------------------------------------------------------------------------------------------

#: Two segments of chain, driven.
TWO = {
    "cable": {
        "segments": [
            {"material": "low", "length": 6.0, "elements": 2},
            {"line_density": 20.0, "breaking_load": 5e4, "fatigue_curve": "API studlink", "length": 6.0, "elements": 2},
        ],
        "steel_area": AREA,
        "top": {"kind": "prescribed", "position": [9.0, 0.0, 6.0], "amplitude": [0.3, 0.0, 0.0], "period": 2.0},
    },
    "material": {
        "low": {"line_density": 30.0, "breaking_load": 4e4, "fatigue_curve": "API studless", "steel_area": AREA}
    },
    "fatigue": {"corrosion": 0.0, "safety_factor": 5.0},
    "time": {"end": 6.0, "step": 0.05},
}


@pytest.fixture(scope="module")
def two():
    return simulate(TWO)


def miner(record, label, m, K, load):
    """Miner sum by hand of one series of a record."""
    name, _, part = label.partition(" of ")
    x = record[name].sel({"place" if name.startswith("place") else "cable": part}).values
    ranges, counts = Series(label, record.time.values, x).ranges()
    return np.sum(counts * (ranges / load) ** m) / K


def of_sample(record, scene, label):
    return Fatigue().damage(sample_of(record, load_scene(scene)), label).sum


@shows("cable.fatigue_curve", "cable.segments.fatigue_curve", "material.NAME.fatigue_curve", "fatigue.curve")
@shows("fatigue.connectors", "fatigue.places", "fatigue.spacing")
def test_each_place_has_the_curve_of_its_line(two):
    labels = ["tension_anchor of cable", "place_tension of cable.0 at upper end"]
    for label in labels:
        assert of_sample(two, TWO, label) == pytest.approx(miner(two, label, 3, 316, 4e4), rel=1e-9)
    for label in ("tension_top of cable", "place_tension of cable.1 at lower end"):
        assert of_sample(two, TWO, label) == pytest.approx(miner(two, label, 3, 1000, 5e4), rel=1e-9)
    linked = changed(TWO, {"fatigue.connectors": "API connecting link"})
    for label in labels:
        assert of_sample(two, linked, label) == pytest.approx(miner(two, label, 3, 178, 4e4), rel=1e-9)
    plain = changed(TWO, {"cable.segments.1.fatigue_curve": None, "fatigue.curve": "50 MBL^4"})
    assert of_sample(two, plain, "tension_top of cable") == pytest.approx(
        miner(two, "tension_top of cable", 4, 50, 5e4), rel=1e-9
    )
    own = changed(plain, {"cable.fatigue_curve": "60 MBL^4"})
    assert of_sample(two, own, "tension_top of cable") == pytest.approx(
        miner(two, "tension_top of cable", 4, 60, 5e4), rel=1e-9
    )
    sag = [name for name in two.place.values if "sag" in name]
    assert len(sag) == 1
    assert "place" not in solve_static(changed(TWO, {"fatigue.places": []})).dims
    every = solve_static(changed(TWO, {"fatigue.places": ["joints"], "fatigue.spacing": 5.0})).place.values.tolist()
    assert every == ["cable.0 at 5 m", "cable.0 at upper end", "cable.1 at lower end", "cable.1 at 10 m"]


@shows("cable.steel_area", "cable.segments.steel_area", "material.NAME.steel_area", "fatigue.corrosion")
def test_the_steel_of_a_line(two):
    label = "tension_anchor of cable"
    stress = changed(TWO, {"material.low.fatigue_curve": "DNV studless"})
    assert of_sample(two, stress, label) == pytest.approx(miner(two, label, 3, 6e10, 1e6 * AREA), rel=1e-9)
    thicker = changed(stress, {"material.low.steel_area": 2 * AREA})
    assert of_sample(two, thicker, label) == pytest.approx(of_sample(two, stress, label) / 8, rel=1e-9)
    nearer = changed(thicker, {"cable.segments.0.steel_area": AREA})
    assert of_sample(two, nearer, label) == pytest.approx(of_sample(two, stress, label), rel=1e-9)
    without = changed(stress, {"material.low.steel_area": None, "cable.steel_area": 3 * AREA})
    assert of_sample(two, without, label) == pytest.approx(of_sample(two, stress, label) / 27, rel=1e-9)
    worn = changed(stress, {"fatigue.corrosion": 0.1 * BAR})
    assert of_sample(two, worn, label) == pytest.approx(of_sample(two, stress, label) / 0.9**6, rel=1e-9)


@shows("fatigue.safety_factor")
def test_the_command_shows_lives(two, call, tmp_path):
    """Life of the run's sea, and over the factor of the scene, or of the command."""
    simulate(TWO, out=tmp_path / "run")
    code, out, err = call("statistics", tmp_path / "run", "--out", tmp_path / "st")
    assert (code, err) == (0, "")
    yearly = miner(two, "tension_anchor of cable", 3, 316, 4e4) / 6.0 * YEAR
    row = next(line for line in out.splitlines() if "tension anchor" in line and f"{yearly:.4g}" in line)
    assert f"{1 / yearly:.4g}" in row
    assert f"{1 / yearly / 5:.4g}" in row
    for words in ("over safety factor 5", "Fatigue by API studless, ranges over 40 kN", "place tension of cable.0 at"):
        assert words in " ".join(out.split())
    more = ["--safety-factor", "10", "--corrosion", "0.001", "--curve", "6e10 MPa^3", "--overwrite"]
    code, out, err = call("statistics", tmp_path / "run", "--out", tmp_path / "st", *more)
    assert (code, err) == (0, "")
    assert "over safety factor 10" in " ".join(out.split())
    assert "Fatigue by 6e10 MPa^3, ranges over 3771.5 mm², bar thinner by 1 mm" in " ".join(out.split())


@pytest.mark.parametrize(("factor", "columns"), [(1.0, ["20"]), (5.0, ["20", "4"])])
def test_a_factor_of_one_has_no_column(factor, columns):
    """Life in years by a Miner sum of a year, as it is and over the safety factor."""
    assert _lives(0.05, factor, math.nan) == columns
    assert len(_of_lives(factor)) == len(columns)


def test_a_life_over_a_scatter_diagram(tmp_path):
    """0.6 of the year 10 cycles of 0.1 in 100 s, 0.1 of it one of 0.3 in 50 s; the rest calm."""
    (tmp_path / "seas.csv").write_text("waves.significant_height,probability\n1,0.6\n3,0.1\n")
    runs = []
    for height, (size, number, duration) in {1: (0.1, 10.0, 100.0), 3: (0.3, 1.0, 50.0)}.items():
        sample = sampled([size * MBL], [number], duration=duration, curve="API studless")
        sample["fatigue"] = {"corrosion": 0.0, "safety_factor": 3.0}
        runs.append(Run(str(height), sample, str(height), {"waves.significant_height": height}))
    yearly = YEAR * (0.6 * 10 * 0.1**3 / 316 / 100 + 0.1 * 0.3**3 / 316 / 50)
    life = lifetime(runs, tmp_path / "seas.csv", Fatigue())
    (k,) = np.flatnonzero(life.series.values == "tension_top")
    assert float(life.damage_per_year[k]) == pytest.approx(yearly, rel=1e-12)
    assert float(life.life[k]) == pytest.approx(1 / yearly, rel=1e-12)
    assert float(life.life_with_factor[k]) == pytest.approx(1 / yearly / 3, rel=1e-12)
    assert "Fatigue by API studless, ranges over 1000 kN: tension_top of line." in life.attrs["notes"]
    shortest = f"{1 / yearly:.4g} years, of tension_top of line, {1 / yearly / 3:.4g} years over the safety factor 3."
    assert life.attrs["notes"].endswith(f"The shortest life is {shortest}")
    less = lifetime(runs, tmp_path / "seas.csv", Fatigue(curve="API studlink", safety_factor=1.0))
    assert float(less.life[k]) == pytest.approx(1000 / 316 / yearly, rel=1e-12)
    assert "life_with_factor" not in less


@shows("fatigue.corrosion_rate")
@pytest.mark.parametrize("rate", [0.0002, 0.0008])
def test_a_bar_that_corrodes_lives_as_long_as_its_stress_lets_it(rate, tmp_path):
    """Stress goes like d^-2, damage like d^-6: (1 - r L/d)^-5 = 1 + 5 r/(d D), with the damage D of the first year."""
    (tmp_path / "seas.csv").write_text("waves.significant_height,probability\n1,1\n")
    sample = sampled([0.05 * MBL], [1.0], steel_area=AREA, curve="DNV studless")
    sample["fatigue"] = {"corrosion": 0.001, "corrosion_rate": rate, "safety_factor": 3.0}
    d = BAR - 0.001
    stress = 0.05 * MBL / (math.pi / 2 * d**2) / 1e6
    yearly = YEAR / 100 * stress**3 / 6e10
    expected = d / rate * (1 - (1 + 5 * rate / (d * yearly)) ** -0.2)
    found = lifetime([Run("1", sample, "1", {"waves.significant_height": 1})], tmp_path / "seas.csv", Fatigue())
    (k,) = np.flatnonzero(found.series.values == "tension_top")
    assert float(found.damage_per_year[k]) == pytest.approx(yearly, rel=1e-9)
    assert float(found.life[k]) == pytest.approx(expected, rel=1e-4)
    assert expected < 0.9 / yearly
    quiet = sample | {"fatigue": sample["fatigue"] | {"corrosion_rate": 0.0}}
    assert Fatigue().life(quiet, "tension_top of line", yearly) == 1 / yearly


def test_lives_in_the_table_of_a_run(two):
    """The shortest first, by hand, from the time after the ramp, which is all of the run here."""
    scene, label = load_scene(TWO), "place_tension of cable.0 at upper end"
    rows = {name: value for name, value, unit in summary(two, scene) if unit == "years"}
    life = 6.0 / YEAR / miner(two, label, 3, 316, 4e4)
    named = "life of cable.0 at upper end, from 6 s, over safety factor 5"
    assert rows[named] == f"{years(life)}, {years(life / 5)}"
    shown = [float(value.partition(",")[0]) for value in rows.values()]
    assert shown == sorted(shown)
    assert len(shown) == 5  # both ends, the joint from either side, the sag
    assert years(3.2e7) == "> 1,000,000"
    bare = {"fatigue": None, "cable.segments.1.fatigue_curve": None, "material.low.fatigue_curve": None}
    assert life_rows(two, load_scene(changed(TWO, bare))) == []


def test_the_life_of_what_corrodes_is_in_the_statistics(two):
    sample = sample_of(two, load_scene(changed(TWO, {"fatigue.corrosion_rate": 0.001})))
    found = together([Run("1", sample, "", {})], Fatigue())
    yearly = float(found.tension_anchor_damage[0, 0]) * YEAR / sample["duration"]
    life = Fatigue().life(sample, "tension_anchor of cable", yearly)
    assert float(found.tension_anchor_life[0, 0]) == pytest.approx(life, rel=1e-12)
    assert life < 1 / yearly
    assert "tension_anchor_life" not in together([Run("1", sample_of(two, load_scene(TWO)), "", {})], Fatigue())


def test_a_sweep_keeps_cycles_of_places(two, call, tmp_path):
    """Cases keep no records: their lives are those of runs of the same scenes, with another curve too."""
    (tmp_path / "two.toml").write_text(load_scene(TWO).to_toml())
    (tmp_path / "seas.csv").write_text("cable.top.period,probability\n2.0,0.7\n3.0,0.2\n")
    code, _, err = call(
        "sweep", tmp_path / "two.toml", "--table", tmp_path / "seas.csv", "--out", tmp_path / "sw", "--set", "title=x"
    )
    assert (code, err.count("rror")) == (0, 0), err
    slow = simulate(changed(TWO, {"cable.top.period": 3.0}))
    cases = xr.load_dataset(tmp_path / "sw" / "sweep.nc")
    lives = np.array([6.0 / YEAR / miner(one, "tension_anchor of cable", 3, 316, 4e4) for one in (two, slow)])
    np.testing.assert_allclose(cases.tension_anchor_life.values[:, 0], lives, rtol=1e-5)
    every = (cases.tension_top_life, cases.tension_anchor_life, cases.place_tension_life)
    least = np.min([one.min(one.dims[1]) for one in every], axis=0)
    np.testing.assert_allclose(cases.shortest_life, least, rtol=1e-12)
    lasting = [Series("", one.time.values, one.tension_top.values[:, 0]).lasting_maximum for one in (two, slow)]
    np.testing.assert_allclose(cases.tension_top_lasting_maximum.values[:, 0], lasting, rtol=1e-6)
    smallest = [[one.cable_tension_minimum.values.min()] for one in (two, slow)]  # of all steps and elements
    np.testing.assert_allclose(cases.smallest_tension_minimum, smallest, rtol=1e-12)
    code, _, err = call("report", tmp_path / "sw")
    assert (code, err) == (0, "")
    text = (tmp_path / "sw" / "report.html").read_text()
    where = f"life {years(least[0])} years, {cases.shortest_life_of.values[0]}"
    for words in (where, "for 1 s", "vary cable.top.period 2.0, 3.0;", f"{cases.attrs['created'][:10]}"):
        assert words in text, words
    label = "place_tension of cable.0 at upper end"
    for more, (m, K) in (((), (3, 316)), (("--curve", "50 MBL^4"), (4, 50))):
        arguments = ["--scatter", tmp_path / "seas.csv", "--out", tmp_path / "st", "--overwrite", *more]
        code, out, err = call("statistics", tmp_path / "sw", *arguments)
        assert (code, err) == (0, "")
        life = xr.load_dataset(tmp_path / "st" / "lifetime.nc")
        (k,) = np.flatnonzero((life.series.values == "place_tension") & (life.part.values == "cable.0 at upper end"))
        yearly = YEAR / 6.0 * sum(p * miner(one, label, m, K, 4e4) for p, one in ((0.7, two), (0.2, slow)))
        assert float(life.damage_per_year[k]) == pytest.approx(yearly, rel=1e-5)
        assert float(life.life_with_factor[k]) == pytest.approx(1 / yearly / 5, rel=1e-5)
        assert "over safety factor 5" in " ".join(out.split())
        assert "The shortest life is" in " ".join(out.split())


def test_places_of_lines_of_several_kinds():
    """Legs of two pairs of elements, a group each; the tension is that of the element in every frame."""
    scene = load_scene("three-legs").to_dict() | {"time": {"end": 0.1, "step": 0.05, "output_every": 0.05}}
    for cable, degrees in zip(scene["cable"], ((1, 0), (2, 1), (1, 0)), strict=True):
        cable |= {"position_degree": degrees[0], "tension_degree": degrees[1], "elements": 5}
    record = simulate(scene, fatigue={"curve": "1e15 N^3", "places": [], "spacing": 25.0})
    names = [cable["name"] for cable in scene["cable"]]
    assert record.place.values.tolist() == [f"{name} at 25 m" for name in names]
    for k in (0, 2):
        mine = np.flatnonzero(record.cable_of_cell.values == k)
        tension = record.cable_tension.values[:, mine]
        np.testing.assert_array_equal(record.place_tension[:, k], tension[:, 2])
    mine = np.flatnonzero(record.cable_of_cell.values == 1)
    middle = record.cable_tension.values[:, mine]
    assert (record.place_tension.values[:, 1] > middle[:, 1]).all()
    assert (record.place_tension.values[:, 1] < middle[:, 3]).all()

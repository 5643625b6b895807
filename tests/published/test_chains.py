"""Chains with heaving tops on a bed with friction, against another program's table: peaks, and the whole period.

Source: MoorDyn's test data (quasi-static moorings, reported there as validated against OrcaFlex); tests/reference.
"""

import csv
import functools
import math

import alone
import numpy as np
import pytest
from helpers import REFERENCE, reference

BEDS = reference("bed_and_networks")["cases"]
CASES = {name: case for name, case in BEDS.items() if name.startswith("chain_")}
HEAVE = {"chain_wd0050_heave2": 2.0, "chain_wd0200_heave5": 5.0, "chain_wd0600_heave2": 2.0}
PERIOD = 10.0
#: The table's heave begins a little later than ours: z(10 s) = -0.036 m of 2 m, -0.09 m of 5 m.
LAG = PERIOD * math.asin(0.018) / (2 * math.pi)
STATED = {"stiffness": 1e6, "stick_length": 0.05}


@functools.cache
def run(name, stated=True):
    """Record of a case with the reference's bed, or with the default bed."""
    case = CASES[name]["input"]
    keys = ("line_density", "diameter", "axial_stiffness", "added_mass", "normal_drag", "tangential_drag")
    cable = {key: float(case[key]) for key in keys} | {"length": float(case["L"]), "elements": 80}
    cable |= {"slack": "tension-only"}
    cable["top"] = {"kind": "prescribed", "position": [float(case["X"]), 0.0, 0.0], "period": PERIOD, "ramp": 20.0}
    cable["top"] |= {"amplitude": [0.0, 0.0, HEAVE[name]]}
    bed = {"friction": case["friction"]} | (STATED if stated else {})
    time = {"end": 60.0, "step": 0.05, "scheme": "bdf2"}
    found = alone.simulate({"sea": {"depth": float(case["depth"])}, "cable": cable, "seabed": bed, "time": time})
    assert found.attrs["failed_steps"] == 0
    return found


def extremes(found):
    """Of the last three periods [kN]."""
    last = found.time.values > 30.0
    top, anchor = found.tension_top.values[last] / 1e3, found.tension_anchor.values[last] / 1e3
    return {"top_max": top.max(), "top_min": top.min(), "anchor_max": anchor.max(), "anchor_min": anchor.min()}


@pytest.mark.parametrize("stated", [True, False], ids=["stated bed", "default bed"])
@pytest.mark.parametrize("name", CASES)
def test_extremes(name, stated):
    """Within the acceptance of the case at its settings; the default bed, printed alongside, is as close."""
    found, accepted = extremes(run(name, stated)), CASES[name]["acceptance"]
    table = CASES[name]["values"]["tabulated_kN"]
    print(name, "stated" if stated else "default", {key: f"{x:.1f} ({table[key]:.1f})" for key, x in found.items()})
    assert found["top_max"] == pytest.approx(table["top_max"], rel=accepted["top_peak"])
    assert found["top_min"] == pytest.approx(table["top_min"], rel=accepted["top_peak"])
    assert found["anchor_max"] == pytest.approx(table["anchor_max"], rel=accepted["anchor_peak"])
    assert found["anchor_min"] == pytest.approx(table["anchor_min"], rel=accepted["anchor_peak"])


def rows_of(file, name):
    """[{column: number}] of a case in a reference file."""
    with open(REFERENCE / file, newline="") as stream:
        found = [row for row in csv.DictReader(stream) if row["case"] == name]
    return [{key: float(value) for key, value in row.items() if key != "case"} for row in found]


def last_period(name, stated, t):
    """Tension at the top at the times t of the table's first period [kN]."""
    found = run(name, stated)
    return np.interp(t + 4 * PERIOD - LAG, found.time, found.tension_top / 1e3)


@pytest.mark.parametrize("name", ["chain_wd0050_heave2", "chain_wd0200_heave5"])
def test_the_whole_period(name):
    """Root mean square difference over the table's range."""
    t, top = np.array([(row["t"], row["top"]) for row in rows_of("chains.csv", name)]).T
    assert len(t) == 20
    rms = [100 * float(np.sqrt(np.mean((last_period(name, x, t) - top) ** 2))) / np.ptp(top) for x in (True, False)]
    print(name, f"rms {rms[0]:.2f} % of the range; with the default bed {rms[1]:.2f} %")
    assert rms[0] < CASES[name]["acceptance"]["rms_percent_of_range"]


@pytest.mark.parametrize("name", ["chain_wd0050_heave2", "chain_wd0200_heave5"])
def test_harmonics_are_those_of_the_tables(name):
    """Of the two that are known by both: one period every 0.5 s beside two every 0.1 s."""
    top, (table,) = [row["top"] for row in rows_of("chains.csv", name)], rows_of("chains_harmonics.csv", name)
    c, size = 2 * np.fft.rfft(top) / len(top), table["largest"] - table["least"]
    assert c[0].real / 2 == pytest.approx(table["mean"], abs=5e-3 * size)
    for k in (1, 2, 3):
        theirs = table[f"a{k}"] * np.exp(1j * np.radians(table[f"phase{k}"]))
        assert abs(c[k] - theirs) < 2e-2 * size


def largest_rms(ours, table):
    """Bound of the root mean square of the difference between values over a period and a table of harmonics.

    By Parseval for the mean and three harmonics; of the higher ones the table's size is known, and no phase.
    """
    n, k = len(ours), np.arange(1, 4)
    c = np.fft.rfft(ours) / n
    theirs = np.array([table[f"a{j}"] * np.exp(1j * np.radians(table[f"phase{j}"])) for j in k])
    low = (c[0].real - table["mean"]) ** 2 + (np.abs(2 * c[k] - theirs) ** 2).sum() / 2
    first = (theirs.real).sum()  # two periods of 100 samples and one more, which the deviation counts too
    variance = (201 * table["std"] ** 2 - first**2) / 200
    higher = max(variance - (np.abs(theirs) ** 2).sum() / 2, 0.0)
    mine = 2 * (np.abs(c[4:]) ** 2).sum()
    return float(np.sqrt(low + (np.sqrt(higher) + np.sqrt(mine)) ** 2))


@pytest.mark.parametrize("name", CASES)
def test_harmonics_of_the_period(name):
    """The same of all three, from the harmonics of the table; the last one is known by these only."""
    (table,), within = rows_of("chains_harmonics.csv", name), CASES[name]["acceptance"]["rms_percent_of_range"]
    assert {key: table[key] for key in ("largest", "least")} == {
        "largest": CASES[name]["values"]["tabulated_kN"]["top_max"],
        "least": CASES[name]["values"]["tabulated_kN"]["top_min"],
    }
    t = PERIOD / 200 * np.arange(200)
    rms = [
        100 * largest_rms(last_period(name, x, t), table) / (table["largest"] - table["least"]) for x in (True, False)
    ]
    print(name, f"rms at most {rms[0]:.2f} % of the range; with the default bed {rms[1]:.2f} %")
    assert rms[0] < within


@pytest.mark.slow
def test_landing_elements_do_not_ring():
    """The force at the anchor of the shipped chain gets better with the step on the same elements, by the order of
    the scheme in the end; without damping the modes of single elements ring, and it does not."""
    t, found = np.arange(22.0, 40.0, 0.05), {}
    for damping in (2e6, 0.0):
        forces = []
        for step in (0.05, 0.025, 0.0125, 0.00625, 0.003125):
            run = alone.simulate("chain-on-bed", cable__damping=damping, time__step=step, time__end=40.0)
            forces.append(np.interp(t, run.time, np.linalg.norm(run.anchor_force, axis=-1)))
        *coarse, fine = forces
        found[damping] = [100 * np.sqrt(np.mean((force - fine) ** 2)) / np.ptp(fine) for force in coarse]
        print(damping, [f"{error:.3f} %" for error in found[damping]])
    damped = np.array(found[2e6])
    assert np.all(damped[1:] < 0.8 * damped[:-1])
    assert damped[0] < 1.0
    assert damped[-1] < 0.1
    assert min(found[0.0]) > 1.0


def test_chain_on_bed():
    """The shipped scene: no failed step, the closed form at rest, and a peak that is not due to the bed."""
    values = BEDS["bed_chain100_frictionless"]["values"]
    found = alone.simulate("chain-on-bed")
    assert found.attrs["failed_steps"] == 0
    assert float(found.tension_top[0]) == pytest.approx(values["T_top"], rel=1e-3)
    peak, weight = found.tension_top.values.max(), 700.0
    anchor = np.linalg.norm(found.anchor_force, axis=-1).max()
    for factor in (0.1, 10.0, 100.0):
        stiffness = factor * weight / 0.1 / 0.01
        other = alone.simulate("chain-on-bed", seabed__stiffness=stiffness)
        assert other.attrs["failed_steps"] == 0
        assert other.tension_top.values.max() == pytest.approx(peak, rel=0.02)
    # where landing nodes make steps fail, those that are retried add nothing to what they land with
    hard = alone.simulate("chain-on-bed", seabed__stiffness=3e9, cable__elements=80)
    assert 0 < hard.attrs["failed_steps"] < 100
    assert hard.tension_top.values.max() == pytest.approx(peak, rel=0.02)
    assert np.linalg.norm(hard.anchor_force, axis=-1).max() == pytest.approx(anchor, rel=0.02)

"""Sweeps over sea states: seeds of each case, Latin hypercubes, scatter diagrams, statistics, executors.

Source: the runs of the cases one by one; sums over sea states by hand; the Gumbel distribution in numpy.
"""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

import numpy as np
import pytest
import xarray as xr
from dynamics_helpers import MOORED, merged
from mpi_helpers import needs_mpirun, start

import dolfbuoy
from dolfbuoy import InputError, load_scene, statistics
from dolfbuoy.results.lifetime import against_seeds, lifetime
from dolfbuoy.results.parts import alone
from dolfbuoy.results.sample import YEAR, Fatigue
from dolfbuoy.results.statistics import Run, gumbels, runs_of
from dolfbuoy.scene.variants import cases_of, latin_hypercube, probabilities, with_seeds
from dolfbuoy.studies.sweep import plan, sweep

SEA = {"spectrum": "jonswap", "significant_height": 0.8, "peak_period": 4.0, "components": 20, "ramp": 2.0}
SCENE = merged(MOORED, cable__elements=4, waves=SEA, time={"end": 12.0, "step": 0.04})
SCENE["waves"] = SEA
TABLE = "waves.significant_height,waves.peak_period,probability\n0.5,4,0.6\n1.0,5,0.1\n"


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """(folder, dataset) of two sea states with two seeds each."""
    folder = tmp_path_factory.mktemp("seas")
    (folder / "table.csv").write_text(TABLE)
    return folder, sweep(SCENE, [], folder / "table.csv", folder, seeds=2)


# -- cases -----------------------------------------------------------------------------------------------------------


def test_seeds_follow_from_the_case_alone():
    """Whatever others there are, in whatever order; and all differ."""
    changes = [{"waves.significant_height": h} for h in (1.0, 2.0, 3.0)]
    found = with_seeds(changes, 4)
    assert len(found) == len({case["waves.seed"] for case in found}) == 12
    assert with_seeds(changes[::-1], 4)[:4] == found[8:]
    assert with_seeds(changes[1:2], 2) == found[4:6]
    for bad, n in ((changes, 0), (changes, 10**6), ([{"waves.seed": 1}], 2)):
        with pytest.raises(InputError, match="--seeds"):
            with_seeds(bad, n)


@pytest.mark.parametrize("count", [1, 7, 50])
def test_a_latin_hypercube_has_one_value_in_every_stripe(count):
    found = latin_hypercube(["waves.amplitude=0.5:2", "current.speed=-1:0"], None, count)
    for key, low, high in (("waves.amplitude", 0.5, 2.0), ("current.speed", -1.0, 0.0)):
        stripes = np.floor((np.array([case[key] for case in found]) - low) / (high - low) * count)
        assert sorted(stripes) == list(range(count))
    assert found == latin_hypercube(["waves.amplitude=0.5:2", "current.speed=-1:0"], None, count)
    if count == 50:
        x, y = np.array([list(case.values()) for case in found]).T
        assert abs(np.corrcoef(x, y)[0, 1]) < 0.5


@pytest.mark.parametrize(
    "vary", [[], ["a=1,2"], ["a=1:1"], ["a=2:1"], ["a=0:inf"], ["a=0:1:0.1"], ["=0:1"], ["a=0:1"] * 2]
)
def test_what_no_latin_hypercube_is_made_of(vary):
    with pytest.raises(InputError, match=r"--latin|--vary"):
        latin_hypercube(vary, None, 5)


def test_the_probability_of_a_table_is_no_change(tmp_path):
    table = tmp_path / "table.csv"
    table.write_text(TABLE)
    changes = cases_of([], table)
    assert changes == [{"waves.significant_height": h, "waves.peak_period": t} for h, t in ((0.5, 4), (1.0, 5))]
    assert probabilities(table) == list(zip(changes, (0.6, 0.1), strict=True))
    for text in (
        "gravity\n1\n",
        "gravity,probability\n1,0.7\n2,0.4\n",
        "gravity,probability\n1,-0.1\n",
        "probability\nx\n",
    ):
        table.write_text(text)
        with pytest.raises(InputError, match="needs a column probability"):
            probabilities(table)


# -- statistics --------------------------------------------------------------------------------------------------------


def test_statistics_of_a_sweep_are_those_of_its_runs(swept):
    """Numbers to the last bit; peaks and ranges to the seven digits that are kept, few enough to have no bins."""
    folder, dataset = swept
    found = alone(statistics(folder))
    assert found.sizes["set"] == 2
    assert found.set_of_run.values.tolist() == [0, 0, 1, 1]
    names = {}
    for i in range(4):
        case = dataset.isel(case=i)
        keys = [key.replace(".", "_") for key in dataset.attrs["varied"].split(", ")]
        names[
            ", ".join(
                f"{k} = {case[n].item():g}" for k, n in zip(dataset.attrs["varied"].split(", "), keys, strict=True)
            )
        ] = i
        record = dolfbuoy.simulate(
            SCENE, **{k: case[n].item() for k, n in zip(dataset.attrs["varied"].split(", "), keys, strict=True)}
        )
        one = alone(statistics(record))
        (k,) = np.flatnonzero(found.tension_top_maximum.values == float(one.tension_top_maximum[0]))
        for name in ("tension_top_mean", "surface_elevation_Hs", "fixed_point_elevation_m0", "pitch_skewness"):
            assert float(found[name][k]) == float(one[name][0])
        assert float(found.tension_top_equivalent_load[k]) == pytest.approx(
            float(one.tension_top_equivalent_load[0]), rel=1e-6
        )
    assert len(names) == 4


def test_a_life_is_the_sum_over_its_seas(swept):
    """Damage by hand; seeds are too few for the largest value."""
    folder, _ = swept
    fatigue, runs = Fatigue(4.0, 1e14), runs_of([folder])
    found = lifetime(runs, folder / "table.csv", fatigue).sel(series="tension_top")
    damage = 0.0
    for height, share in ((0.5, 0.6), (1.0, 0.1)):
        mine = [run.sample for run in runs if run.changes["waves.significant_height"] == height]
        assert len(mine) == 2
        worn = [
            np.dot(np.array(s["cycles"]["tension_top of cable"][0]) ** 4, s["cycles"]["tension_top of cable"][1])
            for s in mine
        ]
        damage += share * sum(worn) / sum(s["duration"] for s in mine)
    assert float(found.damage_per_year) == pytest.approx(damage * YEAR / 1e14, rel=1e-12)
    assert float(found.life) == pytest.approx(1e14 / YEAR / damage, rel=1e-12)
    assert float(found.equivalent_load) == pytest.approx(damage**0.25, rel=1e-12)
    assert np.isnan(found.largest)


def test_the_largest_value_of_fifty_years():
    """Probability of all 3-h maxima by hand, with Gumbel's distributions of runs of half an hour."""
    generator, runs = np.random.default_rng(2), []
    for state, (location, scale) in enumerate(((10.0, 1.0), (30.0, 2.0))):
        for k, x in enumerate(generator.gumbel(location, scale, 20)):
            series = {"tension_top": {"maximum": float(x)}}
            sample = {"duration": 1800.0, "series": series, "peaks": {"tension_top": ([], [])}, "cycles": {}}
            runs.append(Run(f"{state}-{k}", sample, str(state), {"sea": state}))
    for shares, years in (((0.9, 0.001), 50.0), ((0.0, 1.0), 1.0)):
        table = [({"sea": k}, p) for k, p in enumerate(shares)]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("dolfbuoy.results.lifetime.probabilities", lambda path, table=table: table)
            found = float(lifetime(runs, None, Fatigue(), years).sel(series="tension_top").largest)
        fits = [gumbels([run for run in runs if run.changes["sea"] == k], "tension_top")[0] for k in (0, 1)]
        below = [np.exp(-6 * np.exp(-(found - fit.location) / fit.scale)) for fit in fits]
        above = sum(p * (1 - b) for p, b in zip(shares, below, strict=True))
        assert above == pytest.approx(3 / (years * YEAR / 3600), rel=1e-6)


def test_a_design_wave_against_the_seeds():
    """Gumbel's distribution of runs of half an hour, six of them in 3 h, by hand."""
    generator, runs = np.random.default_rng(3), []
    for k, x in enumerate([*generator.gumbel(10.0, 1.0, 30), 15.0]):
        sample = {
            "duration": 1800.0,
            "series": {"tension_top": {"maximum": float(x)}},
            "peaks": {"tension_top": ([], [])},
        }
        runs.append(Run(str(k), sample, "design" if k == 30 else "sea"))
    found = against_seeds(runs[:-1], runs[-1]).sel(series="tension_top")
    fit = gumbels(runs[:-1], "tension_top")[0]
    assert float(found.largest) == 15.0
    assert float(found.above) == pytest.approx(1 - np.exp(-6 * np.exp(-(15.0 - fit.location) / fit.scale)), rel=1e-9)
    assert float(found.most_probable) == pytest.approx(fit.location + fit.scale * np.log(6), rel=1e-9)
    with pytest.raises(InputError, match="differ in their seed only"):
        against_seeds(runs, runs[-1])


def test_a_sea_without_runs_is_named(swept, tmp_path):
    folder, _ = swept
    (tmp_path / "table.csv").write_text("waves.significant_height,waves.peak_period,probability\n7,4,0.5\n")
    with pytest.raises(InputError, match=r"no run with waves.significant_height = 7, waves.peak_period = 4"):
        lifetime(runs_of([folder]), tmp_path / "table.csv", Fatigue())
    with pytest.raises(InputError, match="a sweep keeps no records"):
        statistics(folder, start=3.0)


def test_the_command_shows_a_life(swept, call, tmp_path):
    folder, _ = swept
    arguments = ["--scatter", folder / "table.csv", "--constant", "1e14 N^3", "--years", "20", "--out", tmp_path / "st"]
    code, out, err = call("statistics", folder, *arguments)
    assert (code, err) == (0, "")
    for words in ("A life in these seas, 70 % of the time", "once in 20 years", "set 1: 2 runs, 10 s from t = 2 s on"):
        assert words in out
    written = xr.load_dataset(tmp_path / "st" / "lifetime.nc")
    assert f"{float(written.damage_per_year.sel(series='tension_top')):.4g}" in out


# -- executors ---------------------------------------------------------------------------------------------------------


@contextmanager
def processes():
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
        yield executor


@contextmanager
def dask():
    """Of a cluster on this computer."""
    distributed = pytest.importorskip("distributed", reason="needs distributed, of the extra test")
    local = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with distributed.LocalCluster(**local) as cluster, cluster.get_client() as client:
        yield client.get_executor()


@pytest.mark.parametrize("make", [processes, pytest.param(dask, marks=pytest.mark.slow)])
def test_an_executor_gives_what_one_process_gives(make, swept, tmp_path):
    """Processes of their own; the lines of the store but for times and order."""
    _, dataset = swept
    (tmp_path / "table.csv").write_text(TABLE)
    scene = load_scene(SCENE)
    with make() as executor:
        found = sweep(scene, [], tmp_path / "table.csv", tmp_path, seeds=2, executor=executor)
    xr.testing.assert_identical(*(one.assign_attrs(created="") for one in (found, dataset)))


FUTURES = """
from mpi4py.futures import MPIPoolExecutor
from dolfbuoy.studies.sweep import plan, sweep

if __name__ == "__main__":
    with MPIPoolExecutor() as executor:
        sweep("sea.toml", [], "table.csv", "out", seeds=2, executor=executor)
"""


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_ranks_are_workers_of_mpi4py_futures(swept, tmp_path):
    """One rank asks for the sweep, others evaluate: these start PETSc when their first case comes."""
    _, dataset = swept
    for name, text in (("table.csv", TABLE), ("futures.py", FUTURES)):
        (tmp_path / name).write_text(text)
    load_scene(SCENE).save(tmp_path / "sea.toml")
    done = start(3, ["-m", "mpi4py.futures", "futures.py"], tmp_path)
    assert done.returncode == 0, done.stderr
    xr.testing.assert_equal(xr.load_dataset(tmp_path / "out" / "sweep.nc"), dataset)


def test_settings_of_cases_are_not_looked_for():
    """Bars of them may be estimated."""
    vary = ["cable.normal_drag=0.8"]
    assert len(plan(load_scene(SCENE, accuracy={"estimate": "companion"}), vary, None).cases) == 1
    with pytest.raises(InputError, match=r"accuracy\.target: cases of a sweep keep their settings"):
        plan(load_scene(SCENE, accuracy={"target": 0.1}), vary, None)

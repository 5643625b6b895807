"""Statistics of many made-up runs of a sea: largest values on Gumbel's paper, a life of seas, a wave beside them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from made_up import RECORD, SCENE
from told import refused

from dolfbuoy import load_scene
from dolfbuoy.commands.statistics import show
from dolfbuoy.results.lifetime import against_seeds, lifetime
from dolfbuoy.results.sample import Fatigue
from dolfbuoy.results.statistics import runs_of, together
from dolfbuoy.results.statistics_figures import draw_all

FATIGUE = {"curve": "API studless", "safety_factor": 5.0, "corrosion_rate": 2e-4}
HEIGHT = "waves.significant_height"
SERIES = [name for name, x in RECORD.items() if x.dims[0] == "time" and x.dtype.kind == "f" and name != "time_step"]
draws = np.random.default_rng(11)


def made(size, count):
    """Records of as many seeds, in which everything is larger or smaller."""
    scene = load_scene(SCENE, cable__steel_area=5e-4, cable__breaking_load=4e5, fatigue=FATIGUE)
    for _ in range(count):
        series = {name: RECORD[name].mean() + size * draws.gumbel(1.0, 0.1) * _beside(name) for name in SERIES}
        yield RECORD.assign(series).assign_attrs(scene=scene.to_toml())


def _beside(name):
    """A series about its mean."""
    return RECORD[name] - RECORD[name].mean()


def runs():
    """Two seas with seeds enough, and one with too few."""
    for height, size, count in ((1.0, 1.0, 10), (2.5, 2.2, 11), (4.0, 3.0, 2)):
        for k, run in enumerate(runs_of(made(size, count))):
            yield replace(run, name=f"{height} {k}", set=f"{height}", changes={HEIGHT: height}, seconds=10.0 + k)


def table(text):
    """A scatter diagram."""
    Path("scatter.csv").write_text(f"{HEIGHT},probability\n{text}")
    return Path("scatter.csv")


every = list(runs())
two = [run for run in every if run.changes[HEIGHT] < 3]
together(every, Fatigue(exponent=4.0, frequency=0.5)).to_netcdf("three.nc")
both = together(two, Fatigue(constant=1e20))
show(both, Path("both"))
draw_all(both, Path())
lives = {"both": ("1,0.7\n2.5,0.2\n", 20.0), "rare": ("1,1e-9\n2.5,0\n", 50.0), "few": ("1,0.5\n4,0.1\n", 50.0)}
for name, (seas, years) in lives.items():
    lifetime(every, table(seas), Fatigue(curve="DNV studless"), years).to_netcdf(f"{name}.nc")
against_seeds(two[:10], every[-1]).to_netcdf("design.nc")
refused(
    lambda: against_seeds(every, every[0]),
    lambda: lifetime(every, table("3,0.5\n"), Fatigue()),
    lambda: lifetime(every, table("1,0.5\n"), Fatigue(), 0.0),
)

"""Numbering of unknowns on several ranks: unique, shared by all ranks, and in the order of one rank.

Source: the numbering on one rank; every node, tension and joint is a single unknown.
"""

import contextlib
import itertools
import json
from pathlib import Path

import pytest
from mpi4py import MPI
from mpi_helpers import needs_mpirun, start_scenes

from dolfbuoy import load_scene
from dolfbuoy.model.connectivity import Joining
from dolfbuoy.model.problem import Problem
from dolfbuoy.solver.numbering import Numbering

LINE = {"length": 10.0, "line_density": 1.0, "axial_stiffness": 2e4, "elements": 3}
FLOAT = {"mass": 30.0, "center_of_mass": 0.0, "inertia": [2.0, 4.0]}
FOOT = [[0.0, 0.0, 0.0], [15.0, 0.0, 0.0], [0.0, 15.0, 0.0]]
LEGS = [LINE | {"name": f"leg{k}", "from": foot, "to": "Y"} for k, foot in enumerate(FOOT)]
BENT = [line | {"bending_stiffness": 9.0} for line in LEGS]
SCENES = {
    "a line on a buoy": {"cable": LINE | {"from": FOOT[0], "to": "buoy"}, "buoy": FLOAT},
    "a body, a buoy and take-offs": {
        "cable": [*LEGS, LINE | {"name": "up", "from": "Y", "to": "buoy.f"}],
        "joint": [{"name": "Y", "mass": 9.0}],
        "buoy": FLOAT | {"fairleads": {"f": [0.2, 0.1, 0.4]}},
        "take_off": [
            {"name": "one", "from": "Y", "to": "buoy", "stiffness": 9.0, "length": 1.0},
            {"name": "two", "from": [0.0, 0.0, 9.0], "to": "Y", "stiffness": 9.0, "length": 1.0},
        ],
    },
    "two buoys": {
        "cable": [
            LINE | {"name": "a", "from": FOOT[0], "to": "east"},
            LINE | {"name": "b", "from": "east", "to": "west", "strain": "element-average"},
            LINE | {"name": "c", "from": "west", "to": FOOT[1], "position_degree": 2, "tension_degree": 1},
        ],
        "buoy": [FLOAT | {"name": name} for name in ("east", "west")],
    },
    "lines that bend": {
        "cable": [BENT[0], BENT[1], BENT[2] | {"to": "buoy", "to_end": {"direction": [1, 0, 0]}}],
        "joint": [{"name": "Y", "weld": True}],
        "buoy": FLOAT,
    },
}


class Numbered(Problem):
    """A problem that stops once its unknowns are numbered, before any equation is built."""

    def residuals(self):
        size = max([place.stop for place, _ in self.named()] + [a.whole.stop for a in self.attachments])
        self.numbering = Numbering(self.comm, size, *Joining(self).numbers())
        raise StopIteration

    def __init__(self, scene):
        with contextlib.suppress(StopIteration):
            super().__init__(load_scene(scene), True, MPI.COMM_WORLD)

    def named(self):
        """[(place, name)] of what stands at each place of this rank's unknowns."""
        found = []

        def add(offset, dofs, *name):
            found.extend((slice(d, d + 1), [*name, i]) for i, d in enumerate((offset + dofs).tolist()))

        for lines in self.lines.groups:
            first, begins = lines.part.offset, lines.begins
            for kind, dofs in (("r", lines.node_dofs), ("m", lines.moment_dofs)):
                for row, s, k in zip(dofs if dofs is not None else (), lines.node_s, lines.line_of_node, strict=False):
                    s -= begins[k]
                    ends = lines.pieces[k].ends
                    end = next((ends[i] for i, x in ((0, 0.0), (1, 10.0)) if abs(s - x) < 1e-6), None)
                    joined = end is not None and end.kind == "joint"
                    add(first, row, kind, *([end.name] if joined else [lines.numbers[k], round(s, 6)]))
            middles = lines.cell_ends.mean(axis=1)
            for kind, dofs in (("T", lines.T_dofs), ("e", lines.mean_dofs)):
                for row, s, k in zip(dofs if dofs is not None else (), middles, lines.line_of_cell, strict=False):
                    add(first, row.reshape(-1), kind, lines.numbers[k], round(s - begins[k], 6))
        if self.bodies:
            for name, row in zip(self.bodies.names, self.bodies.dofs, strict=True):
                add(self.bodies.part.offset, row, "r", name)
        for device in self.take_offs:
            for end, holder in zip(device.ends, device.holders, strict=True):
                name = ["r", holder.name] if holder.kind == "joint" else ["take-off", device.name, holder.kind]
                found += [(slice(d, d + 1), [*name, i]) for i, d in enumerate(range(end.slice.start, end.slice.stop))]
        for a in (a for a in self.attachments if a.buoy or self.lines.owns_end(a.piece, a.end)):  # else of no concern
            whole = enumerate(range(a.whole.start, a.whole.stop))
            found += [(slice(d, d + 1), ["at", a.piece, a.end, i]) for i, d in whole]
        for name, buoy in self.buoys.items():
            place = enumerate(range(buoy.part.slice.start, buoy.part.slice.stop))
            found += [(slice(d, d + 1), ["buoy", name, i]) for i, d in place]
        return found

    def told(self):
        """{name: number}, names that this rank owns, and the order of elimination of all."""
        known, owned = {}, set(self.numbering.order.tolist())
        mine = []
        for place, name in self.named():
            text, number = json.dumps(name), int(self.numbering.global_index[place.start])
            assert known.setdefault(text, number) == number, text
            mine += [text] if place.start in owned else []
        order = self.numbering.elimination
        return known, mine, None if order is None else order.getIndices().tolist()


SCRIPT = """
import json, sys
sys.path[:0] = sys.argv[2:]
from test_connectivity import MPI, Numbered

with open(sys.argv[1]) as file:
    scenes = json.load(file)
found = MPI.COMM_WORLD.gather({name: Numbered(scene).told() for name, scene in scenes.items()})
if found:
    print(json.dumps(found))
"""


@pytest.fixture(scope="module", params=[2, pytest.param(3, marks=pytest.mark.slow)])
def ranks(request, tmp_path_factory):
    """The output of each rank for each scene."""
    here = Path(__file__).parent
    done = start_scenes(request.param, SCENES, tmp_path_factory.mktemp("ranks"), SCRIPT, here, here.parent / "support")
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout.splitlines()[-1])


@needs_mpirun
@pytest.mark.mpi
@pytest.mark.parametrize("name", SCENES)
def test_every_unknown_has_one_number(ranks, name):
    """Held ends have none; each is owned once, by a rank whose numbers follow each other."""
    one, _, _ = Numbered(SCENES[name]).told()
    found = [rank[name] for rank in ranks]
    numbers = {}
    for known, _, _ in found:
        for text, number in known.items():
            assert numbers.setdefault(text, number) == number, text
    assert numbers.keys() == one.keys()
    assert {text for text, number in numbers.items() if number < 0} == {
        text for text, number in one.items() if number < 0
    }
    free = {text: number for text, number in numbers.items() if number >= 0}
    assert sorted(free.values()) == list(range(len(free)))
    owned = [sorted({numbers[text] for text in mine}) for _, mine, _ in found]
    assert list(itertools.chain(*owned)) == list(range(len(free)))
    names = {number: json.loads(text) for text, number in free.items()}
    serial = {number: json.loads(text) for text, number in one.items() if number >= 0}
    order = [names[number][:-1] for number in found[0][2]]
    assert runs(order) == runs([serial[number][:-1] for number in range(len(serial))])


def runs(order):
    """Tensions waiting for the same joint have no order among themselves."""
    return [sorted(run) if kind == "T" else list(run) for kind, run in itertools.groupby(order, lambda name: name[0])]

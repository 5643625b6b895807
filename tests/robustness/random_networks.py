"""Random networks: lines between anchors, joints and buoys, in either spelling, each made from its number alone.

    .venv/bin/python tests/robustness/random_networks.py [--count 300] [--first 0] [--seconds 300] [--show NUMBER]

prints how each ends (`network_judge`), and what is wrong with those that end in none of these ways.
"""

import argparse
import collections
import itertools
import math
import signal
import sys
import time
import traceback
from pathlib import Path

import numpy as np

#: What lines are made of: (mass of a metre, EA, diameter of the drag) of 1 m of thickness, its drag, largest thickness.
FAMILIES = {
    "chain": (2e4, 8.5e10, 1.8, 2.4, 0.1),
    "wire": (3.6e3, 4e10, 1.0, 1.2, 0.1),
    "fibre": (800.0, 1.5e9, 1.0, 1.2, 0.2),
    "floating": (550.0, 8e8, 1.0, 1.2, 0.15),
    "cord": (1e3, 3e6, 1.0, 1.0, 0.06),
}
#: Materials of the library, with a metre's mass as above.
LIBRARY = ("chain R3 studless 19 mm", "chain Q3 studlink 32 mm", "wire 40 mm", "polyester 60 mm", "nylon 24 mm")
TABLE = [[0.0, 0.0], [0.3, 400.0], [0.8, 2500.0]]


def network(number: int) -> dict:
    """A scene as dict."""
    return _Network(np.random.default_rng(number)).scene()


class _Network:
    """Draws the tables of a scene one after the other."""

    def __init__(self, rng):
        self.rng, self.cables, self.joints, self.buoys, self.materials = rng, [], [], [], {}
        self.wet = self.often(0.9)
        self.depth = self.size(6.0, 200.0)
        self.bed = self.wet and self.often(0.4)

    # -- numbers ---------------------------------------------------------------------------------------------------

    def often(self, share):
        """Whether it happens, in this share of the scenes."""
        return bool(self.rng.random() < share)

    def size(self, low, high):
        """Evenly in the logarithm."""
        return float(np.exp(self.rng.uniform(math.log(low), math.log(high))))

    def number(self, low, high):
        """Evenly."""
        return float(self.rng.uniform(low, high))

    def one(self, of):
        """One of several."""
        return of[int(self.rng.integers(len(of)))]

    # -- the scene -------------------------------------------------------------------------------------------------

    def scene(self):
        """All tables, spelled at random."""
        self.shared = self.one([{}, {}, {}, {"position_degree": 2, "tension_degree": 1}, {"slack": "tension-only"}])
        kind = self.one(["line", "legs", "legs", "net", "net", "chain", "chain"] + ["buoys"] * self.wet)
        getattr(self, f"_{kind}")()
        scene = self._surroundings()
        for name, tables in (("cable", self.cables), ("buoy", self.buoys), ("joint", self.joints)):
            if tables:
                scene[name] = tables
        if self.materials:
            scene["material"] = self.materials
        return self._spelled(scene)

    def _surroundings(self):
        scene = {"time": self._time()}
        if self.wet:
            scene["sea"] = {"depth": self.depth}
            if self.often(0.5):
                scene["current"] = {"speed": self.size(0.05, 2.0), "direction_deg": self.number(0, 360)}
                scene["current"] |= self.one([{}, {"profile": "power"}])
            if self.often(0.4):
                wave = {"amplitude": self.size(0.05, 2.0), "period": self.size(3.0, 14.0), "ramp": 5.0}
                sea = {"spectrum": "jonswap", "significant_height": self.size(0.2, 4.0), "peak_period": 8.0}
                scene["waves"] = self.one([wave, wave, sea | {"components": 20}])
        if self.bed and self.cables:
            scene["seabed"] = self.one([{}, {"friction": 0.5}, {"friction": 0.5, "start": "pulled"}])
            scene["seabed"] |= self.one([{}, {}, {"slope": [self.number(-0.1, 0.1), 0.05]}])
        return scene

    def _time(self):
        step = self.size(0.005, 0.2)
        schemes = [{"scheme": "backward-euler"}, {"scheme": "bdf2"}]
        schemes.append({"scheme": "generalized-alpha", "spectral_radius": self.one([0.0, 0.0, 0.8])})
        return {"step": step, "end": int(self.rng.integers(0, 5)) * step} | self.one(schemes)

    # -- what hangs together ---------------------------------------------------------------------------------------

    def _line(self):
        """One line from an anchor to whatever holds its upper end."""
        low = self._anchor(0.0, 0.0)
        high = self.one([self._held_top, self._free_top, self._body, self._buoy])
        self._join(low, high(self.number(-0.5, 0.5) * self.depth, 0.0))

    def _legs(self):
        """Legs of a buoy, or of a body, spread about it."""
        middle, count = self.one([self._buoy, self._buoy, self._body])(0.0, 0.0), int(self.rng.integers(2, 5))
        radius, turn = self.depth * self.size(0.3, 3.0), self.number(0, 2 * math.pi)
        for k in range(count):
            angle = turn + 2 * math.pi * k / count
            self._join(self._anchor(radius * math.cos(angle), radius * math.sin(angle)), middle, angle)

    def _chain(self):
        """Buoys in a row, each with legs, with lines between them."""
        apart, count = self.depth * self.size(0.3, 2.0), int(self.rng.integers(2, 4))
        row = [self._buoy(k * apart, 0.0) for k in range(count)]
        for k, buoy in enumerate(row):
            for angle in [math.pi / 2, -math.pi / 2] if self.often(0.6) else [math.pi if k == 0 else 0.0]:
                place = k * apart + self.depth * math.cos(angle), self.depth * math.sin(angle)
                self._join(self._anchor(*place), buoy, angle)
        for one, other in itertools.pairwise(row):
            self._join(one, other, 0.0)

    def _net(self):
        """A tree over anchors, joints and buoys, and some lines more."""
        spread, nodes = self.depth * self.size(0.5, 2.0), []
        makers = [self._anchor, self._body, self._body, self._buoy, self._held_joint]
        for k in range(int(self.rng.integers(3, 7))):
            place = self.number(-spread, spread), self.number(-spread, spread)
            maker = self._anchor if k == 0 else self.one(makers)
            new = maker(*place)
            if k:
                self._join(self.one(nodes), new, self.number(0, 6.3))
            nodes.append(new)
        for _ in range(int(self.rng.integers(0, 3))):
            low, high = self.one(nodes), self.one(nodes)
            if low is not high:
                self._join(low, high, self.number(0, 6.3))

    def _buoys(self):
        """Buoys without any line."""
        for k in range(int(self.rng.integers(1, 4))):
            self._buoy(30.0 * k, 0.0)

    # -- ends: (how `from` and `to` name it, where it is) ------------------------------------------------------------

    def _anchor(self, x, y):
        place = np.array([x, y, self.one([-1.0, -1.0, -1.0, -0.9]) * self.depth])
        return place.tolist(), place

    def _held_top(self, x, y):
        z = self.number(-0.3, 0.1) * self.depth
        return {"kind": "fixed", "position": [x, y, z]}, np.array([x, y, z])

    def _free_top(self, x, y):
        force = [self.number(-1, 1) * 1e3, 0.0, self.size(1e2, 1e5)]
        return {"kind": "free", "force": force}, np.array([x, y, 0.0])

    def _held_joint(self, x, y):
        moved = {"amplitude": [0.0, 0.2, 0.5], "period": self.size(3.0, 12.0), "ramp": 5.0}
        return self._joint(x, y, self.number(-0.5, 0.0), lambda r: {"position": r.tolist()} | self.one([{}, moved]))

    def _body(self, x, y):
        return self._joint(x, y, self.number(-0.9, -0.1), lambda r: self._weight())

    def _joint(self, x, y, height, keys):
        place = np.array([x, y, height * self.depth])
        self.joints.append({"name": f"j{len(self.joints)}"} | keys(place))
        return self.joints[-1]["name"], place

    def _weight(self):
        """Keys of a clump, of a float, or of neither."""
        mass = self.size(1.0, 3e3)
        volume = self.one([0.0, mass / 7800, mass / 300, 0.0])
        return self.one([{}, {"mass": mass}, {"mass": mass, "volume": volume, "drag_area": 0.1, "added_mass": 0.5}])

    def _buoy(self, x, y):
        D = self.size(0.5, 4.0)
        H = D * self.number(0.4, 2.0)
        mass = 1025 * math.pi / 4 * D * D * H * self.number(0.1, 0.6)
        buoy = {"name": f"b{len(self.buoys)}", "mass": mass, "center_of_mass": H * self.number(0.1, 0.5)}
        buoy["hull"] = self.one([[[0.0, D], [H, D]], [[0.0, 0.4 * D], [0.4 * H, D], [H, D]]])
        buoy |= self.one([{}, {"normal_drag": 0.8, "axial_drag": 1.0, "added_mass": 0.5, "axial_added_mass": 0.8}])
        if not self.wet:
            buoy["inertia"] = [mass * D * D / 8, mass * D * D / 10]
        if self.often(0.2):
            buoy["external_force"] = {"force": [self.number(-1, 1) * mass, self.number(-1, 1) * mass, 0.0]}
        if self.often(0.2):
            buoy["wind"] = {"speed_10m": self.size(1.0, 30.0), "area": D * H / 3, "height": H, "direction_deg": 70.0}
        self.buoys.append(buoy)
        return buoy, np.array([x, y, 0.0])

    # -- lines -----------------------------------------------------------------------------------------------------

    def _join(self, low, high, angle=None):
        """A line between two ends, mostly somewhat longer than they are apart."""
        (a, r), (b, s) = low, high
        line = {
            "name": f"l{len(self.cables)}",
            **self.shared,
            **self._end("from", a, angle + math.pi if angle else 0.0),
        }
        line |= self._end("to", b, angle)
        length = max(float(np.linalg.norm(s - r)), 1.0) * (
            self.number(0.97, 1.05) if self.often(0.5) else self.size(1, 1.8)
        )
        spare = min((end["mass"] for end in (a, b) if isinstance(end, dict) and "mass" in end), default=1e4)
        if self.often(0.35):
            line |= self._made_of(0.0, {}) | {"segments": self._segments(length, spare)}
        else:
            line |= {"length": length, "elements": int(self.rng.integers(1, 9))} | self._made_of(spare / length)
        self.cables.append(line)

    def _end(self, key, end, angle):
        """The key that says what an end hangs on."""
        if isinstance(end, dict) and "kind" in end:
            return {"top": end}
        if not isinstance(end, dict):
            return {key: end}
        if self.often(0.4):
            return {key: end["name"]}
        radius, name = end["hull"][-1][1] / 2, f"f{len(end.setdefault('fairleads', {}))}"
        turn = angle or 0.0
        end["fairleads"][name] = [-radius * math.cos(turn), -radius * math.sin(turn), end["hull"][-1][0] / 2]
        return {key: f"{end['name']}.{name}"}

    def _segments(self, length, spare):
        shares = self.rng.dirichlet([2.0] * int(self.rng.integers(2, 4)))
        found = [
            {"length": float(share) * length, "elements": int(self.rng.integers(1, 6))} | self._made_of(spare / length)
            for share in shares
        ]
        for segment in found[:-1]:
            if self.often(0.4):
                segment["body"] = self._weight()
        return found

    def _made_of(self, spare, default=None):
        """Keys of a line whose metre weighs at most about `spare` [kg], its own or of a material."""
        if default is not None:
            return default
        if self.often(0.15):
            return {"material": self.one(LIBRARY)}
        family = self.one(list(FAMILIES))
        mass, EA, drag_diameter, C_n, thickest = FAMILIES[family]
        t = min(self.size(0.01, thickest), math.sqrt(max(spare, 1e-3) * self.one([0.1, 0.3, 3.0]) / mass))
        keys = {"line_density": mass * t * t, "axial_stiffness": EA * t * t, "diameter": drag_diameter * t}
        keys |= {"area": math.pi / 4 * t * t * (2.0 if family == "chain" else 1.0)} if self.often(0.7) else {}
        keys |= self.one([{}, {"normal_drag": C_n, "tangential_drag": 0.05, "added_mass": 1.0}])
        if family == "cord" and self.often(0.5):
            keys["axial_stiffness"] = TABLE
        if family in ("chain", "wire") and self.often(0.1):
            keys["axial_stiffness"] = math.inf
        if self.often(0.2) and keys["axial_stiffness"] not in (math.inf, TABLE):
            keys["damping"] = 0.01 * keys["axial_stiffness"]
        if self.often(0.5):
            return keys
        name = f"{family}{len(self.materials)}"
        self.materials[name] = keys
        return {"material": name}

    # -- spelling --------------------------------------------------------------------------------------------------

    def _spelled(self, scene):
        """One of a kind in either brackets, with its name or without; the only buoy's own sections on top or in it; the
        anchor by its key, by its place or unsaid; now and then something that is not there."""
        for line in scene.get("cable", []):
            if isinstance(line.get("from"), list) and self.often(0.3):
                line["anchor"] = line.pop("from")
            if self.wet and line.get("anchor") == [0.0, 0.0, -self.depth]:
                del line["anchor"]
            if self.often(0.01):
                line["to"] = self.one(["nowhere", "b0.nothing", "j0.side"])
        buoys = scene.get("buoy", [])
        if len(buoys) == 1:
            for key in ("wind", "external_force"):
                if key in buoys[0] and self.often(0.5):
                    scene[key] = buoys[0].pop(key)
            if self.often(0.5):
                self._rename(scene, buoys[0].pop("name"), "buoy")
        if len(scene.get("cable", [])) == 1 and self.often(0.5):
            del scene["cable"][0]["name"]
        for key in ("cable", "buoy"):
            if len(scene.get(key, [])) == 1 and self.often(0.5):
                scene[key] = scene[key][0]
        return scene

    @staticmethod
    def _rename(scene, old, new):
        for line in scene.get("cable", []):
            for key in ("from", "to"):
                name, dot, fairlead = line[key].partition(".") if isinstance(line.get(key), str) else ("", "", "")
                if name == old:
                    line[key] = f"{new}{dot}{fairlead}"


# -- the command -------------------------------------------------------------------------------------------------------


class Hangs(Exception):
    """A scene that takes too long."""


def _interrupt(*_):
    raise Hangs


def ending(number: int, seconds: float) -> tuple[str, str]:
    """(how a network ends, what is wrong with it or what was said)."""
    sys.path.append(str(Path(__file__).parents[1] / "support"))
    from network_judge import judge

    signal.signal(signal.SIGALRM, _interrupt)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        return judge(network(number))
    except Hangs:
        return "hangs", f"after {seconds:g} s"
    except AssertionError as error:
        return "wrong", f"{' '.join(str(error).split())[:300]} ({_where(error)})"
    except Exception as error:
        return "traceback", f"{type(error).__name__}: {error} ({_where(error)})"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _where(error):
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{place.filename.rpartition('/')[2]}:{place.lineno}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=300.0, help="longest time of a scene")
    parser.add_argument("--show", type=int, metavar="NUMBER", help="print the scene of a number")
    options = parser.parse_args()
    if options.show is not None:
        print(network(options.show))
        return
    ends = collections.Counter()
    for number in range(options.first, options.first + options.count):
        begin = time.perf_counter()
        how, said = ending(number, options.seconds)
        ends[how] += 1
        print(f"{number}: {how}, {time.perf_counter() - begin:.1f} s{'; ' if said else ''}{said}", flush=True)
    print(", ".join(f"{count} {how}" for how, count in ends.most_common()))


if __name__ == "__main__":
    main()

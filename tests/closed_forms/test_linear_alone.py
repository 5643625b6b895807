"""Parts of the linear analyses, each alone: requested waves, iterated drag, radiation memory of a buoy, periods.

Source: the same numbers by hand; roots of a cubic by numpy; made-up scenes and solvers.
"""

import math
from types import SimpleNamespace as Fake

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from dolfbuoy import load_scene
from dolfbuoy.errors import InputError, SolveError
from dolfbuoy.linear import periods, radiated
from dolfbuoy.linear.drag import _roots
from dolfbuoy.linear.layout import LineNodes, _units
from dolfbuoy.linear.linearisation import Equilibrated, Linearisation, _refuse_tow
from dolfbuoy.linear.natural import Mode, UnitQuaternions, mode_of, slack_in
from dolfbuoy.linear.periods import NaturalPeriod, _oscillations, _residual, modes_of_buoys, natural_periods
from dolfbuoy.linear.radiated import Radiated
from dolfbuoy.linear.seaway import Seaway
from dolfbuoy.linear.spectrum import Bins, check_periods, irregular_waves, small_waves

# -- waves ------------------------------------------------------------------------------------------------------------


def test_small_waves_are_those_of_the_scene_but_for_their_height():
    """Seen from where the scene's are, with its stretching; of a scene without waves as usual."""
    own = {"waves.period_seen_from": "water", "waves.stretching": "vertical", "waves.direction_deg": 70.0}
    found = small_waves(load_scene("short", **own), 7.0, 20.0, 0.1)
    assert (found.period, found.direction_deg, found.amplitude) == (7.0, 20.0, 0.1)
    assert (found.period_seen_from, found.stretching) == ("water", "vertical")
    usual, still = load_scene("short").waves, small_waves(load_scene("short", waves=None), 7.0)
    assert (still.direction_deg, still.amplitude) == (0.0, 0.0)
    assert still.period_seen_from == type(usual).model_fields["period_seen_from"].default


@pytest.mark.parametrize("period", [0.01, 10_000.0])
def test_periods_that_waves_may_have(period):
    check_periods("--periods", [1.0, period])
    for beyond in (0.0099, 10_001.0, math.nan):
        with pytest.raises(InputError, match=rf"^--periods {beyond:g}: must be from 0.01 to 10000 s\.$"):
            check_periods("--periods", [1.0, beyond])


@pytest.mark.parametrize(
    ("sea", "gamma", "spreading"),
    [((2.0, 7.0), 3.3, None), ((2.0, 7.0, 1.0), 1.0, None), ((2.0, 7.0, 5.0, 4.0), 5.0, 4.0)],
)
def test_a_sea_that_is_requested(sea, gamma, spreading):
    """JONSWAP's usual peak; from where the scene's waves come, if nothing else is given."""
    for scene, given, direction in (("short", None, 70.0), ("short", 0.0, 0.0), ("hanging-chain", None, 0.0)):
        own = {"waves.direction_deg": 70.0} if scene == "short" else {}
        waves = irregular_waves(load_scene(scene, **own), sea, given)
        assert (waves.spectrum, waves.significant_height, waves.peak_period) == ("jonswap", 2.0, 7.0)
        assert (waves.gamma, waves.spreading, waves.direction_deg) == (gamma, spreading, direction)


@pytest.mark.parametrize("sea", [(0.0, 7.0), (2.0, 0.0), (2.0, 7.0, 0.99), (2.0, 7.0, 3.3, 0.0), (-2.0, 7.0)])
def test_numbers_that_are_no_sea(sea):
    with pytest.raises(InputError, match="must be a height and a period above 0"):
        irregular_waves(load_scene("short"), sea)


def test_only_a_sea_is_one():
    assert irregular_waves(load_scene("short")) is None
    assert irregular_waves(load_scene("hanging-chain")) is None
    storm = load_scene("storm")
    assert irregular_waves(storm) is storm.waves


def test_density_of_what_runs_in_several_directions():
    """Energies of all directions of a frequency, over its width."""
    bins = Bins(
        np.array([1.0, 2.0]), np.array([0.5, 0.25]), np.array([0, 1, 0]), np.zeros(3), np.array([3.0, 5.0, 7.0])
    )
    np.testing.assert_array_equal(bins.density(), [20.0, 20.0])
    np.testing.assert_array_equal(
        bins.density(np.array([[1.0, 2.0, 0.0], [0.0, 0.0, 1.0]])), [[6.0, 40.0], [14.0, 0.0]]
    )
    assert list(bins.pairs()) == [(1.0, 0.0), (2.0, 0.0), (1.0, 0.0)]


def settling(changes):
    """A Seaway whose answers change by so much from each to the next; the shares of drag that it takes."""
    shares, answers, left = [], iter(range(1000)), iter(changes)
    sea = Fake(_change=lambda before, X, energies: next(left) if X - before == 1 else None)
    found = Seaway._settled(sea, lambda X, share: shares.append((X, share)), lambda: next(answers), None, "a sea")
    return found, [share for _, share in shares], [X for X, _ in shares]


def test_drag_takes_half_a_step_where_whole_ones_go_to_and_fro():
    """From then on, until a change is below a thousandth."""
    found, shares, begins = settling([0.5, 0.2, 0.1001, 0.05, 9e-4])
    assert (found, shares, begins) == (5, [1.0, 1.0, 1.0, 0.5, 0.5], [0, 1, 2, 3, 4])
    assert settling([0.5, 0.25, 1e-3, 9.99e-4])[:2] == (4, [1.0] * 4)
    with pytest.raises(SolveError, match="the drag in a sea did not settle in 60 iterations"):
        settling([1.0 + k % 2 for k in range(100)])
    assert settling([0.01] * 59 + [1e-4])[0] == 60


def test_change_of_standard_deviations():
    """Relative to the new one of each; what hardly moves counts to a thousandth of the largest."""
    sea = Fake(found=Fake(bodies=[Fake(motion=lambda x: x[:2])]), tensions=lambda x: x[2:])
    before, after = np.array([[3.0, 4.0], [1e-6, 0.0], [60.0, 80.0]]), np.array([[3.0, 5.0], [0.0, 0.0], [60.0, 81.0]])
    energies = np.array([4.0, 1.0])
    old, new = (np.sqrt(x**2 @ energies) for x in (before, after))
    expected = max(abs(new[0] - old[0]) / new[0], old[1] / (1e-3 * new[2]), abs(new[2] - old[2]) / new[2])
    assert Seaway._change(sea, before, after * 1j, energies) == pytest.approx(expected, rel=1e-12)


def test_waves_of_one_frequency_are_solved_together():
    """Each column is that of its wave."""
    waves, asked = [Fake(omega=w, name=k) for k, w in enumerate((1.0, 2.0, 1.0))], []

    def solve(*some):
        asked.append([wave.name for wave in some])
        return np.array([[wave.name + 1j for wave in some]] * 2)

    X = Seaway.all_of(Fake(equations=Fake(rows=2), solve=solve), waves)
    assert asked == [[0, 2], [1]]
    np.testing.assert_array_equal(X, [[1j, 1 + 1j, 2 + 1j]] * 2)


def test_roots_of_covariances():
    """Whose squares are the covariances of Re[V exp(-i w t)], amplitudes with the energies S dw."""
    rng = np.random.default_rng(5)
    velocities, energies = rng.normal(size=(4, 2, 3)) + 1j * rng.normal(size=(4, 2, 3)), rng.uniform(size=4)
    found = _roots(velocities, energies)
    for k in range(2):
        phases = 2 * np.pi * np.arange(8) / 8  # of each frequency, amplitude sqrt(2 S dw)
        moved = [
            np.sqrt(2 * e) * (v[k] * np.exp(1j * phases)[:, None]).real
            for v, e in zip(velocities, energies, strict=True)
        ]
        expected = sum(one.T @ one / 8 for one in moved)
        np.testing.assert_allclose(found[k] @ found[k], expected, rtol=1e-12)
        np.testing.assert_allclose(found[k], found[k].T, rtol=1e-12)


# -- memory -----------------------------------------------------------------------------------------------------------


def test_memory_is_that_of_the_file_where_it_has_frequencies():
    """Of its states, for the other sign of time, beyond them; its ends count."""
    coefficients = Fake(omega=np.array([0.5, 1.0, 3.0]))
    made = Fake(_known=[(None, coefficients)], _states=[lambda w: np.array(1j * w)], _splines=[lambda w: np.array(w)])
    made._matrix = lambda kernels: kernels
    found = [complex(Radiated.at_frequency(made, w)[0]) for w in (0.49, 0.5, 2.0, 3.0, 3.01)]
    assert found == [-0.49j, 0.5, 2.0, 3.0, -3.01j]
    made._states = [lambda s: s]
    assert Radiated.at_root(made, 2.0 + 3.0j) == [3.0 - 2.0j]


def test_memory_over_the_frequencies_of_a_file():
    """B - i w (A - A_inf), between its frequencies as a cubic."""
    w = np.linspace(0.5, 3.0, 6)
    damping, added = (np.outer(x, np.eye(3)).reshape(6, 3, 3) for x in (w**2, 5.0 + w))
    spline = radiated._over_frequency(Fake(omega=w, damping=damping, added_mass=added, at_once=5.0 * np.eye(3)))
    np.testing.assert_allclose(spline(1.1), (1.1**2 - 1.1j * 1.1) * np.eye(3), rtol=1e-12)


@pytest.mark.parametrize("there", [True, False])
def test_each_motion_of_a_buoy_has_the_mode_with_most_of_it(there, monkeypatch):
    """A tenth at least; with memory modes are followed, but for those of which hardly anything is a buoy's."""
    shares = {1j: {"a": 0.5, "b": 0.1, "line": 0.4}, 2j: {"a": 0.009, "b": 0.0, "line": 0.9}}
    shares |= {3j: {"a": 0.2, "b": 0.101, "line": 0.6}, 4j: {"a": 0.01, "b": 0.01, "line": 0.9}}
    shares |= {9j: {"a": 0.7, "b": 0.0, "line": 0.3}}
    followed = []

    def follow(root, vector):
        followed.append(root)
        return (9j if root == 3j else root), vector + 1, 0.0

    monkeypatch.setattr(periods, "Radiated", lambda found: Fake(there=there, followed=follow))
    monkeypatch.setattr(periods, "_oscillations", lambda found, once: ((k * 1j, k * 1j) for k in (1, 2, 3, 4)))
    moving = Fake(shares=lambda vector: shares[9j if vector == 3j + 1 else 1j * vector.imag], names_of=lambda b: [b])
    found = periods._of_motions(Fake(bodies=["b", "a"]), moving)
    if there:
        assert (found, followed) == ({"a": (0.7, 9j, 3j + 1)}, [1j, 3j, 4j])
    else:
        assert (list(found.items()), followed) == ([("b", (0.101, 3j, 3j)), ("a", (0.5, 1j, 1j))], [])


def oscillator(stiffness, damping, mass, size, rate):
    """One unknown with K(lambda) = size lambda/(lambda + rate); the roots."""
    made = Fake(found=Fake(whole=tuple(csr_matrix([[float(x)]]) for x in (stiffness, damping, mass))))
    made.at_root = lambda root: csr_matrix([[size * root / (root + rate)]])
    made._settled = lambda *given: Radiated._settled(made, *given)
    return made, np.roots([mass, damping + mass * rate, stiffness + damping * rate + size, stiffness * rate])


@pytest.mark.parametrize("size", [0.05, 1.0, 4.0])
def test_a_mode_is_followed_to_that_with_memory(size):
    """Near or far: by one step or by several, with the backward error of the whole."""
    made, roots = oscillator(4.0, 0.1, 1.0, size, 3.0)
    (expected,) = roots[roots.imag > 0]
    root, x, residual = Radiated.followed(made, -0.05 + 2j, np.array([2.0 + 0j]))
    assert root == pytest.approx(expected, rel=1e-9)
    assert (abs(x[0]), residual) == (pytest.approx(1.0), pytest.approx(0.0, abs=1e-9))


def test_backward_error_of_a_mode_that_has_not_settled(monkeypatch):
    """|left|/(|K| + |lambda E| + |lambda^2 M| + |K*|)."""
    made, _ = oscillator(4.0, 0.5, 2.0, 0.0, 3.0)
    made._settled = lambda root, *_: (root, np.array([0.5 + 0j]))
    *_, residual = Radiated.followed(made, 1j, np.array([1.0 + 0j]))
    assert residual == pytest.approx(abs(4 + 0.5j - 2) / (4 + 0.5 + 2), rel=1e-12)


def test_a_mode_that_goes_astray_is_followed_from_its_beginning():
    """Where one step leads to a root farther than a tenth away, or to another vector; lost if a share has none."""
    made, tried = Fake(found=Fake(whole=tuple(csr_matrix(np.eye(2)) for _ in range(3)))), []
    made.at_root = lambda root: csr_matrix((2, 2), dtype=complex)
    ends = {}

    def settled(root, x, share, most):
        tried.append((share, most))
        return ends.get((share, most), (root, x))

    made._settled = settled
    one, near = np.array([1.0, 0.0]), np.array([0.995, math.sqrt(1 - 0.995**2)])
    by_and_by = [(share, radiated.MOST) for share in (0.25, 0.5, 0.75, 1.0)]
    for end, more in (
        ((1.09j, one), []),
        ((1.11j, one), by_and_by),
        ((1j, near), []),
        ((1j, near[::-1]), by_and_by),
        (None, by_and_by),
    ):
        tried.clear()
        ends = {(1.0, radiated.FEW): end}
        assert Radiated.followed(made, 1j, 3 * one)[0] == (1j if more else end[0])
        assert tried == [(1.0, radiated.FEW), *more]
    ends = {(1.0, radiated.FEW): None, (0.5, radiated.MOST): None}
    with pytest.raises(SolveError, match=r"a mode next to 0\+1j/s is lost among the states"):
        Radiated.followed(made, 1j, one)


# -- modes ------------------------------------------------------------------------------------------------------------


def test_numbers_of_a_mode():
    """Of 3 + 4i per second; of what drifts, and of what is damped too much to swing."""
    mode = Mode(-3.0 + 4.0j, np.zeros(1), 0.0, "oscillates", {}, "")
    assert (mode.omega, mode.damping_ratio, mode.period) == (5.0, 0.6, 2 * math.pi / 5)
    drift, creep = (Mode(root, np.zeros(1), 0.0, "", {}, "") for root in (0j, -2.0 + 0j))
    assert (drift.omega, math.isnan(drift.damping_ratio), math.isnan(drift.period)) == (0.0, True, True)
    assert (creep.damping_ratio, math.isnan(creep.period)) == (1.0, True)


@pytest.mark.parametrize(
    ("root", "kind"),
    [
        (0j, "drifts"),
        (-1e-9 + 0j, "overdamped"),
        (1e-9 + 0j, "leaves"),
        (0.9e-7 * 5 + 5j, "oscillates"),
        (1.1e-7 * 5 + 5j, "grows"),
        (-1 + 5j, "oscillates"),
    ],
)
def test_kinds_of_modes(root, kind):
    """What grows by less than rounding oscillates."""
    moving = Fake(sized=lambda x: 2 * x, shares=lambda x: {"a": 0.7, "b": 0.3}, half_waves=lambda x: {"b": 3})
    found = mode_of(moving, root, np.array([1.0]), np.float64(0.5))
    assert (found.kind, found.name, found.vector.tolist(), found.residual) == (kind, "a + b 3", [2.0], 0.5)


@pytest.mark.parametrize(("smallest", "said"), [(1.1e-6, False), (1e-6, True), (-5.0, True)])
def test_a_line_is_slack_below_a_millionth_of_the_forces(smallest, said):
    problem = Fake(lines=True, smallest_tension=lambda of_rods: smallest * 100.0, typical_force=100.0)
    words = f"At rest a line is slack (smallest tension {100 * smallest:.3g} N): its equations have no slope there"
    assert slack_in(Fake(problem=problem)) == (words if said else None)
    problem.lines = None
    assert slack_in(Fake(problem=problem)) is None


def test_backward_error_of_a_pair_in_the_scales_of_the_system():
    rng = np.random.default_rng(7)
    K, E, M = (rng.normal(size=(3, 3)) for _ in range(3))
    rows, columns = np.array([2.0, 0.5, 1.0]), np.array([1.0, 10.0, 0.1])
    root, x = -0.3 + 2j, rng.normal(size=3) + 1j * rng.normal(size=3)
    system = Fake(row_scales=rows, unknown_scales=columns)
    found = Fake(problem=Fake(system=system), **{name: csr_matrix(A) for name, A in zip("KEM", (K, E, M), strict=True)})
    left = np.abs(rows * ((K + root * E + root**2 * M) @ x)).max()
    sizes = [np.abs(rows[:, None] * A * columns).sum(axis=1).max() for A in (K, E, M)]
    size = sizes[0] + abs(root) * sizes[1] + abs(root) ** 2 * sizes[2]
    assert _residual(found, root, x) == pytest.approx(left / (size * np.abs(x / columns).max()), rel=1e-12)


def test_modes_of_buoys_are_those_of_their_motions_once(monkeypatch):
    """The slowest first; periods, damping and shares of each."""
    slow, fast = -0.6 + 0.8j, -3.0 + 4.0j
    best = {"surge": (0.9, slow, "x"), "pitch": (0.5, fast, "y"), "heave": (0.7, slow, "x")}
    monkeypatch.setattr(periods, "Moving", lambda found, direction_deg: (found, direction_deg))
    monkeypatch.setattr(periods, "_of_motions", lambda found, moving: best if moving == ("scene", 30.0) else None)
    monkeypatch.setattr(periods, "_residual", lambda found, root, vector: (root, vector))
    monkeypatch.setattr(periods, "mode_of", lambda moving, *given: Fake(omega=abs(given[0]), given=given))
    found = modes_of_buoys("scene", 30.0)
    assert [mode.given for mode in found] == [(slow, "x", (slow, "x")), (fast, "y", (fast, "y"))]
    expected = {
        "surge": (2 * math.pi, 0.6, 0.9),
        "pitch": (2 * math.pi / 5, 0.6, 0.5),
        "heave": (2 * math.pi, 0.6, 0.7),
    }
    assert natural_periods("scene", 30.0) == {name: NaturalPeriod(*values) for name, values in expected.items()}


@pytest.mark.parametrize("unknowns", [250, 251])
def test_oscillations_between_a_hundredth_and_a_thousand_seconds(unknowns, monkeypatch):
    """Of small scenes all at once; next to a frequency there may be none; of those that come twice one."""
    roots, shifts = np.array([0.0062j, 0.0063j, -1j, -0.1 + 2j, 628j, 629j, -5.0]), []

    def near(found, shift):
        shifts.append(shift)
        if len(shifts) == 2:
            raise SolveError("none")
        return roots, np.arange(7)[None]

    monkeypatch.setattr(periods, "modes_near", near)
    found = Fake(problem=Fake(system=Fake(order=np.zeros(unknowns))))
    once = [(root, int(vector[0])) for root, vector in _oscillations(found, True)]
    assert once == [(0.0063j, 1), (-0.1 + 2j, 3), (628j, 4)]
    expected = [1j] if unknowns == 250 else list(1j * 2 * math.pi / np.geomspace(50.0, 0.4, 8))
    np.testing.assert_allclose(shifts, expected)
    shifts.clear()
    assert len(list(_oscillations(found, False))) == (3 if unknowns == 250 else 3 * 7)


# -- equations --------------------------------------------------------------------------------------------------------


def test_equations_in_equilibrium_are_solved():
    """Whatever the units of rows and columns; a diagonal has the condition 1, a rotated one that of its sizes."""
    rng = np.random.default_rng(2)
    A, b = rng.normal(size=(4, 4)), rng.normal(size=(4, 2))
    scaled = np.diag([1e-9, 1.0, 1e6, 1e3]) @ A @ np.diag([1e5, 1.0, 1e-7, 10.0])
    np.testing.assert_allclose(Equilibrated(csr_matrix(scaled))(b), np.linalg.solve(scaled, b), rtol=1e-9)
    assert Equilibrated(csr_matrix(np.diag([1e-9, 5.0, -1e6]))).condition() == pytest.approx(1.0)
    assert Equilibrated(csr_matrix([[1.0, 1.0], [1.0, 1.0 - 1e-3]])).condition() == pytest.approx(4e3, rel=1e-2)
    with pytest.raises(RuntimeError):
        Equilibrated(csr_matrix([[1.0, 1.0], [1.0, 1.0]]))


@pytest.mark.parametrize("name", ["", "J"])
def test_a_tow_is_refused_by_its_name(name):
    end, still = Fake(top=Fake(velocity=(1.0, 0.0, 0.0)), name=name), Fake(top=Fake(velocity=None), name="")
    pieces = [Fake(ends=(Fake(top=None, name=""), still), cable=0), Fake(ends=(still, end), cable=1)]
    network = Fake(pieces=pieces, key_of=lambda cable: f"cable.{cable}")
    with pytest.raises(InputError) as raised:
        _refuse_tow(Fake(network=network))
    key = "joint.J" if name else "cable.1.top"
    assert str(raised.value).startswith(f"{key}.velocity = [1.0, 0.0, 0.0]: a tow has no rest to move about")


def test_quaternions_keep_their_lengths():
    """A column along each is gone, with a 1 in K in its place; turns about the axes of the world are what is left."""
    q = np.array([0.6, 0.0, 0.8, 0.0])
    exchange = UnitQuaternions([Fake(at=Fake(orientation=np.arange(2, 6)), orientation=q)], 7)
    A = np.arange(49.0).reshape(7, 7)
    K, M = (found.toarray() for found in exchange.without_lengths(0, csr_matrix(A), csr_matrix(A)))
    assert (K[2, 2], M[2, 2]) == (1.0, 0.0)
    assert not np.delete(K[2], 2).any()
    assert not np.delete(K[:, 2], 2).any()
    turns = np.eye(7)
    turns[2:6, 2:6] = [[0.6, 0, -0.8, 0], [0, 0.6, 0, -0.8], [0.8, 0, 0.6, 0], [0, 0.8, 0, 0.6]]
    np.testing.assert_allclose(exchange.as_they_were(np.eye(7)), turns, atol=1e-15)
    np.testing.assert_allclose(exchange.exchanged(turns), np.eye(7), atol=1e-15)
    others = [k for k in range(7) if k != 2]
    for found in (K, M):
        np.testing.assert_allclose(
            found[np.ix_(others, others)], (turns.T @ A @ turns)[np.ix_(others, others)], atol=1e-12
        )


def test_directions_along_a_line_that_leans_or_hangs():
    """The plane is that of its chord; of one that hangs straight down that ahead; nodes at one place point upwards."""
    s, places = np.array([0.0, 5.0, 10.0]), np.zeros((3, 3), int)
    leaning = LineNodes("a", s, np.array([[0.0, 0, 0], [0, 3, 4], [0, 6, 8]]), places)
    t, across, out = leaning.directions(np.array([1.0, 0.0, 0.0]))
    np.testing.assert_allclose([t[1], across[1], out[1]], [[0, 0.6, 0.8], [0, 0.8, -0.6], [-1, 0, 0]], atol=1e-15)
    hanging = LineNodes("a", s, np.array([[0.0, 0, 0], [9.9e-3, 0, -5], [9.9e-3, 0, -10]]), places)
    assert hanging.heading is None
    np.testing.assert_array_equal(
        LineNodes("a", s, np.array([[0.0, 0, 0], [0, 0, -5], [0.011, 0, -10]]), places).heading, [1, 0, 0]
    )
    np.testing.assert_array_equal(
        _units(np.array([[0.0, 2.0, 0.0], [1e-10, 0.0, 0.0]]), [0.0, 0.0, 1.0]), np.eye(3)[1:]
    )
    assert Linearisation.whole.func(Fake(problem=Fake(comm=Fake(size=1)), K=1, E=2, M=3)) == (1, 2, 3)

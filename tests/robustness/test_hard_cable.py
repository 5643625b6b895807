"""Difficult equilibria of a cable.

Source: closed forms and quadrature, none of them from the program.
"""

import numpy as np
from hard import INF, SHORT, UNIT, ending, hanging, refusal, said, shape_of_pulled, static, with_
from mpi4py import MPI
from scipy.integrate import solve_ivp

from dolfbuoy.model.problem import Problem
from dolfbuoy.scene import load_scene

STIFF = (1e6, 1e8, 1e10, 1e12, 1e14)
FOURTH = 20**-4  #: (element/length)^4 of UNIT: forces at the ends of P2-P1 converge with order 4


def test_inextensible_limit(found):
    """Equilibrium with EA = 1e6 ... 1e14 times its weight, and EA = inf.  Must show: the inextensible answer is
    approached like 1/EA; iterations flat.
    """
    exact = static(UNIT)
    differences, iterations = [], [int(exact.newton_iterations)]
    for EA in STIFF:
        record = static(with_(UNIT, cable__axial_stiffness=EA))
        differences.append(float(abs(record.cable_position - exact.cable_position).max()))
        iterations.append(int(record.newton_iterations))
    found.close("top tension at EA = inf", exact.tension_top, 0.7984082610989, FOURTH)
    found.below("|r - r_inf| at EA = 1e6", differences[0], 1e-6, " L")
    ratio = differences[0] / differences[1]
    found.close("its fall from EA = 1e6 to 1e8", ratio, 100, 0.02)
    found.below("largest |r - r_inf| from EA = 1e10 on", max(differences[2:]), 1e-10, " L")
    found.below("spread of Newton's iterations", max(iterations) - min(iterations), 1)


def _pulled(found, EA):
    scene = with_(UNIT, cable__axial_stiffness=EA, cable__top={"kind": "free", "force": [0.5, 0.0, 0.75]})
    scene["cable"]["top"].pop("position")
    record = static(scene)
    end = record.cable_position.values[-1, [0, 2]]
    found.below("end off the quadrature of r' by", np.abs(end - shape_of_pulled(0.5, 0.75, 1.0, 1.0, EA)).max(), FOURTH)
    found.remark(f"mean strain {float(record.cable_tension.mean()) / EA:.3g}")
    found.holds("T > 0", record.attrs["smallest_tension_N"] > 0)


def test_stretch_50(found):
    """EA so small that the cable stretches by 50 %.  Must show: the end of the elastic catenary."""
    _pulled(found, 1.2347888733299130)


def test_stretch_200(found):
    """EA so small that the cable stretches by 200 %.  Must show: the end of the elastic catenary."""
    _pulled(found, 1.2347888733299130 / 4)


def test_fold_resolved(found):
    """Ends at (0, 0, 0) and (0.01, 0, 0.8) of a unit cable, elements shorter than its fold of 0.0015.  Must show: the
    catenary, all of it in tension.
    """
    scene = with_(UNIT, cable__top__position=[0.01, 0.0, 0.8])
    scene["cable"]["elements"] = [[0.09, 10], [0.02, 100], [0.89, 30]]
    record = static(scene)
    H, top = hanging(0.01, 0.8)
    found.close("top tension", record.tension_top, top, FOURTH)
    found.close("smallest tension, H", record.attrs["smallest_tension_N"], H, 2e-2)
    found.close("lowest point", record.cable_position[:, 2].min(), -0.09925391978048543, 1e-4)


def test_nearly_taut(found):
    """Ends at (0, 0, 0) and (0.01, 0, 0.99) of a unit cable.  Must show: the catenary, all of it in tension."""
    record = static(with_(UNIT, cable__top__position=[0.01, 0.0, 0.99], cable__elements=[[0.02, 100], [0.98, 40]]))
    H, top = hanging(0.01, 0.99)
    found.close("top tension", record.tension_top, top, FOURTH)
    found.close("smallest tension, H", record.attrs["smallest_tension_N"], H, 2e-2)


def test_exactly_taut(found):
    """Inextensible, ends exactly L apart.  Must show: refused: the tension is undetermined; with a finite EA it is
    not.
    """
    taut = with_(UNIT, cable__top__position=[0.6, 0.0, 0.8])
    found.says(refusal(taut), "undetermined")
    record = static(with_(taut, cable__axial_stiffness=1e3))
    # shallow catenary: strain of the sag, (w_n L)^2/(24 T^2) = T/EA with the weight 0.6 across the chord
    found.close("mean tension at EA = 1000", record.cable_tension.mean(), (0.6**2 * 1e3 / 24) ** (1 / 3), 2e-2)


def test_too_short(found):
    """Ends farther apart than L = 19.9 m: 20 m.  Must show: EA = inf refused; elastic: taut."""
    scene = with_(SHORT, cable__length=19.9, cable__top={"kind": "fixed", "position": [0.0, 0.0, 0.0]})
    found.says(refusal(with_(scene, cable__axial_stiffness=INF)), "too short")
    record = static(scene)
    found.close("top tension", record.tension_top, 1157970.0118398606, 1e-9, " N")
    # the record holds element means: the first lies half an element, 0.4975 m, above the anchor
    expected = 1153587.777104896 + 220.212800751986 * 0.4975
    found.close("tension of the first element", record.cable_tension[0], expected, 1e-9, " N")


def test_vertical(found):
    """L = 22 m between points 20 m above each other: a fold of no radius, T = 0 in it.  Must show: the tension of a
    folded cable, and a word if an element is compressed.
    """
    scene = with_(SHORT, cable__top={"kind": "fixed", "position": [0.0, 0.0, 0.0]}, cable__elements=22)
    for EA in (2.3e8, INF):
        folded = with_(scene, cable__axial_stiffness=EA)
        record, words = ending(folded)
        if record is None:
            found.says(words, "DIVERGED")
        elif record.attrs["smallest_tension_N"] < 0:
            found.remark(f"EA = {EA:g}: top tension {float(record.tension_top):.5g} N")
            found.says(said(folded), "compressed")
        else:
            # a node hangs in the fold by two upright elements, and nothing says how they share its weight
            shared = 220.212800751986 * 1.0 / 2
            off = abs(float(record.tension_top) - 4624.468815791706)
            found.below(f"EA = {EA:g}: top tension off by", off, 1.001 * shared, " N")


def test_straight_start(found):
    """Newton started on the straight chord between fixed ends, a singular point.  Must show: the hanging state or an
    error; never a state that is accepted silently.
    """
    _newton_from(found, lambda x: 0.0 * x)


def test_arch_start(found):
    """Newton started on an upward arch, which is an equilibrium with T < 0.  Must show: the program's own start is
    sagged: T > 0; the arch, if offered, is recognised by its T < 0.
    """
    _newton_from(found, lambda x: 1.6 * x * (0.6 - x))


def _newton_from(found, rise):
    """The program's equilibrium, and what Newton makes of another start."""
    record = static(UNIT)
    _, top = hanging(0.6, 0.5)
    found.close("top tension of `static`", record.tension_top, top, FOURTH)
    found.holds("T > 0 there", record.attrs["smallest_tension_N"] > 0)
    problem = Problem(load_scene(UNIT), dynamic=False, comm=MPI.COMM_SELF)
    try:
        x = np.array([0.6, 0.0, 0.5])
        bow = lambda s: np.multiply.outer(s, x) + np.multiply.outer(rise(0.6 * s), [0.0, 0.0, 1.0])  # noqa: E731
        problem.lines.set_shape(problem.system.u, bow, lambda s: -0.4 + 0.0 * s)
        problem.set_time(0.0)
        try:
            problem.newton.solve()
        except Exception as error:
            found.says(str(error), "DIVERGED")
            return
        smallest = problem.smallest_tension()
        found.remark(f"Newton from there ends with the smallest tension {smallest:.3g}")
        above = problem.system.u[problem.lines.node_dofs][:, 2].max() > 0.5
        found.holds("a state above its ends has T < 0, which `smallest_tension_N` shows", (smallest < 0) or not above)
    finally:
        problem.destroy()


def test_lighter_than_water(found):
    """A cable that floats up, w = -1 N/m.  Must show: the catenary upside down, T > 0; said."""
    area = 2 / 1025  # displaces 2 kg/m, weighs 1 kg/m
    cable = {"diameter": float(np.sqrt(4 * area / np.pi)), "anchor": [0.0, 0.0, -3.0]}
    scene = with_(UNIT, sea={"depth": 3.0}, cable=cable, cable__top__position=[0.6, 0.0, -2.5])
    record = static(scene)
    found.close("top tension", record.tension_top, 0.2984082610989, FOURTH)
    quarter = np.interp(0.5, record.s, record.cable_position[:, 2]) + 3.0
    found.close("height of the middle", quarter, 0.46187947950434, FOURTH)
    found.holds("T > 0", record.attrs["smallest_tension_N"] > 0)
    found.says(said(scene), "lighter than water")


def test_weightless(found):
    """No weight in water: pulled 10 % longer; slack between its ends; no gravity at all.  Must show: T = EA/10
    everywhere; slack has no definite shape: T near 0, or a sentence.
    """
    scene = with_(UNIT, gravity=0.0, cable__axial_stiffness=100.0)
    record = static(with_(scene, cable__top__position=[0.66, 0.0, 0.88]))
    found.below("|T - EA/10|", np.abs(record.cable_tension - 10.0).max(), 1e-8, " N")
    for EA in (100.0, INF):
        slack, words = ending(with_(scene, cable__axial_stiffness=EA))
        if slack is None:
            found.remark(f'slack, EA = {EA:g}: "{words}"')
            found.holds("one sentence", "\n" not in words and len(words) > 20)
        else:
            found.finite(slack)
            largest = float(np.abs(slack.cable_tension).max())
            if slack.attrs["smallest_tension_N"] < -1e-3:
                found.says(said(with_(scene, cable__axial_stiffness=EA)), "compressed")
            else:
                found.below(f"slack, EA = {EA:g}: largest |T|", largest, 1e-3, " N")


def test_one_element(found):
    """A single element: P1-P0 stretched, P1-P0 inextensible and slack, P4-P3 hanging.  Must show: Hooke's law; a
    sentence where one straight element cannot be slack; the catenary.
    """
    one = with_(UNIT, cable={"elements": 1, "position_degree": 1, "tension_degree": 0})
    record = static(with_(one, cable__axial_stiffness=100.0, cable__top__position=[0.66, 0.0, 0.88]))
    found.close("T of the stretched element", record.cable_tension[0], 10.0, 1e-9, " N")
    _, words = ending(one)
    found.holds("slack and inextensible: not solved in silence", bool(words))
    found.remark(f'"{words}"')
    best = static(with_(UNIT, cable={"elements": 1, "position_degree": 4, "tension_degree": 3}))
    found.close("top tension of P4-P3", best.tension_top, hanging(0.6, 0.5)[1], 5e-2)


def test_many_elements(found):
    """1000 elements on 750 m.  Must show: the catenary; iterations as with 20 elements."""
    long = {"length": 750.0, "line_density": 9.3, "elements": 1000}
    scene = with_(SHORT, sea__depth=700.0, cable=long, cable__top={"kind": "fixed", "position": [245.0, 0.0, 0.0]})
    many, few = static(scene), static(with_(scene, cable__elements=20))
    found.close("top tension", many.tension_top, 37977.6462893, 1e-5, " N")
    found.below("more iterations than with 20 elements", many.newton_iterations - few.newton_iterations, 2)


def test_degree_4(found):
    """Mu = 4 with nu = 0 ... 3; nu >= mu.  Must show: the catenary, better with nu; nu >= mu refused."""
    errors = []
    for nu in range(4):
        record = static(with_(UNIT, cable={"elements": 6, "position_degree": 4, "tension_degree": nu}))
        middle = record.cable_position[record.sizes["node"] // 2, 2]
        errors.append(abs(float(middle) - 0.03812052049565857))
    limits = (1e-2, 1e-3, 1e-4, 1e-5)
    for nu, (error, limit) in enumerate(zip(errors, limits, strict=True)):
        found.below(f"nu = {nu}: height of the middle off by", error, limit)
    for nu in (4, 5):
        found.says(refusal(with_(UNIT, cable={"position_degree": 4, "tension_degree": nu})), "lower than")


def _in_current(force, speed, cable, w, rho=1025.0):
    """Upper end of a cable pulled by a force in a uniform current along x: integrated downwards from the end."""
    D, L, EA = cable["diameter"], cable["length"], cable["axial_stiffness"]

    def slopes(_, state):
        N = state[3:]
        T = np.linalg.norm(N)
        t, U = N / T, np.array([speed, 0.0, 0.0])
        along = (U @ t) * t
        across = U - along
        drag = 0.5 * rho * D * cable["normal_drag"] * np.linalg.norm(across) * across
        drag += 0.5 * rho * D * cable["tangential_drag"] * np.linalg.norm(along) * along
        return np.concatenate([(1 + T / EA) * t, [0.0, 0.0, w] - (1 + T / EA) * drag])

    end = solve_ivp(slopes, (L, 0.0), [0.0, 0.0, 0.0, *force], rtol=1e-11, atol=1e-9).y[:3, -1]
    return -end


def test_current_4(found):
    """The paper's short cable in a current of 4 m/s.  Must show: the shape of an ODE solver."""
    force = [9000.0, 0.0, 9000.0]
    scene = with_(SHORT, cable__top={"kind": "free", "force": force}, current={"speed": 4.0})
    scene = with_(scene, cable={"elements": 20, "position_degree": 2, "tension_degree": 1})
    record = static(scene)
    end = record.cable_position.values[-1] + [0.0, 0.0, 20.0]
    expected = _in_current(force, 4.0, scene["cable"], 220.212800751986)
    found.below("end off that of the ODE by", np.abs(end - expected).max(), FOURTH, " m")
    found.holds("T > 0", record.attrs["smallest_tension_N"] > 0)
    held = static(with_(scene, cable__top={"kind": "fixed", "position": [4.0, 0.0, 0.0], "force": [0.0, 0.0, 0.0]}))
    found.finite(held)
    found.remark(f"held at (4, 0, 20) m: top tension {float(held.tension_top):.5g} N")
    found.holds("T > 0 when held", held.attrs["smallest_tension_N"] > 0)


def test_below_the_bed(found):
    """A slack cable that hangs 0.99 m below the sea bed.  Must show: flagged before and after a run: without [seabed]
    there is no contact.
    """
    from hard import whole

    scene = with_(SHORT, cable__top={"kind": "fixed", "position": [1.0, 0.0, 0.0]}, time={"end": 0.02, "step": 0.01})
    found.says(said(scene), "below the sea bed")
    found.says(said(scene, whole(scene)), "below the sea bed")

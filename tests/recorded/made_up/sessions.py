"""Sessions: what is driven and loaded, kept, packed and resumed; and what they refuse."""

import numpy as np
from told import MOORED, SHIP, refused, show

from dolfbuoy import Session


def now(s, pulled, body):
    """All that a session tells."""
    print(f"t = {s.t:.6g}")
    show(s.values())
    show({f"shape {name}": value for name, value in s.shape().items()})
    show({f"pull {name}": s.pull(name) for name in pulled.split()})
    show(dict(zip(("pulls: force", "pulls: moment"), s.pulls(body), strict=True)))


def ship():
    """A vessel, an end and a length that are driven; a joint that is loaded; kept, packed and resumed."""
    driven = ["ship", "fore.from", "aft.winch"]

    def go(s, ks):
        for k in ks:
            s.drive("ship", [1.0 + 0.02 * k, 0.01 * k**2, 0.0], [1.0, 0.01 * k, 0.0, 0.25])
            s.drive("fore.from", [12.0, 6.0 - 0.01 * k**2, -10.0 + 0.03 * k])
            s.drive("aft.winch", 16.0 - 0.02 * k)
            s.step(0.05)
        now(s, "fore.from fore.to aft.from aft.to aft.winch", "ship")

    with Session(SHIP, "ship", driven=driven) as s:
        s.load("Y", [20.0, -5.0, 3.0])
        go(s, range(1, 5))
        here = s.save()
        s.advance_to(0.45)  # five steps, in which nothing moves
        now(s, "aft.winch", "ship")
        s.restore(here)
    with Session(resume="ship", driven=driven) as s:
        go(s, range(5, 7))
    with Session(SHIP, driven=driven) as s:
        s.drive("ship", [1.0, 0.2, 0.1], [1.0, 0.0, 0.0, 0.25], [0.0, 0.5, 0.0], [0.0, 0.0, 0.1])
        s.drive("aft.winch", lambda t: 16.0 - t)
        s.drive("fore.from", [12.0, 6.0, -9.9], velocity=[0.0, 0.0, 0.2])
        s.step(0.1)
        now(s, "fore.from", "ship")
        s.drive("aft.winch", 15.8, velocity=-0.5)
        content = s.pack(s.save())
        again = s.unpack(content)
        s.step()
        show({"one": s.simulation.system.u})
        s.restore(again)
        s.drive("aft.winch", 15.8, velocity=-0.5)
        s.step()
        show({"two": s.simulation.system.u})
        refused(
            lambda: s.drive("Y", [0, 0, 0]),
            lambda: s.drive("ship", [0, 0, 0]),
            lambda: s.drive("ship", [0, 0, 0], [1, 0, 0, 0], [0, 0, 0]),
            lambda: s.drive("ship", [0, 0, 0], [0, 0, 0, 0]),
            lambda: s.drive("fore.from", [0, 0, 2e9]),
            lambda: s.drive("fore.from", [0, 0, "z"]),
            lambda: s.drive("fore.from", [0, 0, 0], angular_velocity=[0, 0, 0]),
            lambda: s.drive("aft.winch", 0.0),
            lambda: s.drive("aft.winch", [3.0, 4.0]),
            lambda: s.drive("aft.winch", 3.0, [1, 0, 0, 0]),
            lambda: s.load("fore.to", [0, 0, 1]),
            lambda: s.load("Y", [0, 0, 1], [0, 0, 1]),
            lambda: s.load("Y", [0, 0, 2e99]),
            lambda: s.load("Y", lambda t, y: [1.0]) or s.step(),
            lambda: s.pull("nothing"),
            lambda: s.pull("fore.winch"),
            lambda: s.pulls("Y"),
            lambda: s.required("ship"),
            lambda: s.step(-1.0),
            lambda: s.step(float("inf")),
            lambda: s.advance_to(0.05),
            lambda: s.restore(here),
            lambda: s.unpack(content[1:]),
        )
    still = [[0, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0, 0]]
    wound = SHIP | {"cable": [SHIP["cable"][0] | {"winch": [[0, 16.0], [1, 16.1]]}, SHIP["cable"][1]]}
    welded = SHIP | {"joint": [{"name": "Y", "weld": True}], "take_off": None}
    welded |= {"cable": [c | {"bending_stiffness": 9.0} for c in SHIP["cable"]]}
    welded["cable"] += [welded["cable"][1] | {"name": "on", "from": "Y", "to": [0.0, 0.0, 1.0]}]
    refused(
        lambda: Session(),
        lambda: Session(SHIP, driven="Z"),
        lambda: Session(SHIP, driven="fore.to.winch"),
        lambda: Session(SHIP | {"vessel": [SHIP["vessel"][0] | {"motion": still}]}, driven="ship"),
        lambda: Session(wound, driven="fore.winch"),
        lambda: Session(welded, driven="Y"),
        lambda: Session(resume="ship", driven="ship"),
        lambda: Session(SHIP, "ship"),
        lambda: Session(SHIP | {"gravity": 9.0}, "ship"),
        lambda: Session(resume="."),
    )


def buoy():
    """A buoy that is pushed by numbers and by a function, and one that is driven; what it takes; the water there."""
    with Session(MOORED) as s:
        s.load("buoy", [300.0, -100.0, 50.0], [10.0, 20.0, -30.0])
        s.step()
        s.step(0.02)
        here = s.save()
        s.load("buoy", lambda t, y: ([-500.0 * y.velocity[0], 10.0 * t, 0.0], 40.0 * y.angular_velocity))
        s.advance_to(0.2)
        now(s, "cable.from cable.to", "buoy")
        show(s.state("buoy")._asdict())
        points = np.array([[0.0, 0.0, -1.0], [3.0, 1.0, -4.0], [-8.0, 2.0, -19.0]])
        show({"elevation": s.elevation(points), "water_velocity": s.water_velocity(points)})
        refused(lambda: s.pack(s.save()))
        s.restore(here)
        s.step()
        show(s.state("buoy")._asdict())
    with Session(MOORED, driven="buoy") as s:
        place = s.state("buoy").position
        s.drive("buoy", place + [0.0, 0.0, 0.01], [1.0, 0.01, 0.0, 0.0], [0.0, 0.0, 0.2], [0.2, 0.0, 0.0])
        s.step()
        s.drive("buoy", place + [0.01, 0.0, 0.02], [2.0, 0.04, 0.0, 0.0])
        s.step()
        now(s, "cable.from cable.to", "buoy")
        show(s.required("buoy")._asdict() | s.state("buoy")._asdict())
        refused(lambda: s.load("buoy", [0, 0, 1]), lambda: s.load("cable.to", [0, 0, 1]))


ship()
buoy()

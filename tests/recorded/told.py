"""What scripts of made_up/ share: lines of arrays, sentences of what is refused, a scene."""

from typing import Any

import dynamics_helpers
from fingerprint import of_array

from dolfbuoy import InputError

ROPE = {"length": 16.0, "line_density": 2.0, "axial_stiffness": 1e5, "elements": 3}
#: A ship on a line, and on another by a take-off, as in tests/coupling/test_session.py.
SHIP = {
    "vessel": [
        {
            "name": "ship",
            "position": [1.0, 0.0, 0.0],
            "heading_deg": 30.0,
            "fairleads": {"bow": [3.0, 0.0, -1.0], "stern": [-3.0, 1.0, -1.0]},
        }
    ],
    "joint": [{"name": "Y"}],
    "cable": [
        ROPE | {"name": "fore", "from": [12.0, 6.0, -10.0], "to": "ship.bow"},
        ROPE | {"name": "aft", "from": [-10.0, -6.0, -10.0], "to": "Y"},
    ],
    "take_off": {"from": "Y", "to": "ship.stern", "stiffness": 500.0, "length": 1.0, "damping": 300.0},
    "time": {"end": 0.5, "step": 0.1, "scheme": "bdf2"},
}
#: A buoy on a line of few elements in a regular wave.
MOORED = dynamics_helpers.MOORED | {
    name: dynamics_helpers.MOORED[name] | {key: value}
    for name, key, value in (("cable", "elements", 6), ("waves", "ramp", 0.2), ("time", "step", 0.05))
}


def show(names: dict[str, Any]) -> None:
    """Print a line for each array."""
    for name, value in names.items():
        print(name, of_array(value))


def refused(*calls: Any) -> None:
    """Print the sentences in which calls end."""
    for call in calls:
        try:
            call()
        except InputError as error:
            print(f"refused: {error}")
        else:
            print("not refused")

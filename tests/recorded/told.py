"""What scripts of made_up/ share: lines of arrays, sentences of what is refused, a scene."""

from typing import Any

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
#: A buoy on a line in a regular wave.
MOORED = {
    "sea": {"depth": 20.0},
    "cable": {
        "length": 22.0,
        "line_density": 27.6,
        "diameter": 0.08,
        "axial_stiffness": 2.3e8,
        "elements": 6,
        "added_mass": 0.3,
        "normal_drag": 0.8,
        "tangential_drag": 0.1,
    },
    "buoy": {
        "hull": [[0.0, 2.4], [1.2, 2.4]],
        "mass": 400.0,
        "center_of_mass": 0.5,
        "inertia": [192.0, 288.0],
        "point_masses": [{"mass": 150.0, "height": 2.0}, {"mass": 150.0, "height": 3.0}],
        "added_mass": 0.3,
        "normal_drag": 0.8,
        "axial_drag": 1.0,
        "rotational_damping": 100.0,
    },
    "current": {"speed": 0.5},
    "external_force": {"force": [500.0, 0.0, 0.0]},
    "waves": {"amplitude": 0.8, "period": 5.0, "ramp": 0.2},
    "time": {"end": 2.0, "step": 0.05},
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

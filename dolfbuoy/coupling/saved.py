"""State of a Session at an instant, and copies of what it holds."""

from typing import Any, NamedTuple

import numpy as np

#: What belongs to an instant besides the Simulation.
OWN = ("_series", "_required", "_targets")


class Saved(NamedTuple):
    """State of a Session at an instant, for `restore`."""

    session: int
    state: dict[str, Any]
    assembled: int
    own: dict[str, Any]
    mark: dict[str, Any] | None


def copied(tree: Any) -> Any:
    """A copy of nested dicts and lists of arrays and numbers."""
    if isinstance(tree, dict):
        return {key: copied(item) for key, item in tree.items()}
    if isinstance(tree, list):
        return [copied(item) for item in tree]
    return tree.copy() if isinstance(tree, np.ndarray) else tree

"""Scene keys with a tested effect on a number: `@shows(...)` marks the test that shows it."""

from collections.abc import Iterable

SHOWN: set[str] = set()


def shows(*keys: str):
    """Mark a test as showing the effect of keys."""
    SHOWN.update(keys)
    return lambda test: test


def changed(scene: dict, changes: dict) -> dict:
    """A scene with keys set by their dotted names; None removes a key."""
    from dolfbuoy.scene.reading import merged

    return merged(scene, **changes)


def cases(table: dict[str, object], prefixes: Iterable[str] = ("",)) -> list:
    """(key, new value) of a table, for pytest.mark.parametrize; the keys count as shown."""
    found = [(prefix + key, value) for prefix in prefixes for key, value in table.items()]
    SHOWN.update(key for key, _ in found)
    return found

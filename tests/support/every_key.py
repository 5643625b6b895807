"""Keys of the scene language whose effect on a number is shown: `@shows(...)` on the test that does."""

from collections.abc import Iterable

SHOWN: set[str] = set()


def shows(*keys: str):
    """Mark a test as the one that shows what keys do."""
    SHOWN.update(keys)
    return lambda test: test


def changed(scene: dict, changes: dict) -> dict:
    """A scene with keys by their dotted names set; None removes."""
    from dolfbuoy.scene.reading import merged

    return merged(scene, **changes)


def cases(table: dict[str, object], prefixes: Iterable[str] = ("",)) -> list:
    """(key, new value) of a table, for pytest.mark.parametrize; the keys count as shown."""
    found = [(prefix + key, value) for prefix in prefixes for key, value in table.items()]
    SHOWN.update(key for key, _ in found)
    return found

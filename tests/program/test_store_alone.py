"""The store of results: several files, their contents, and their owners.

Source: lines written and read, counted by hand.
"""

import os

from dolfbuoy.parallel.store import Store, Writer


def test_results_of_several_files(tmp_path):
    """The latest attempt of all of them, of equal ones that of the last file; each file is opened as it is needed."""
    for name, rows in (("a", [("x", 0), ("y", 0)]), ("b", [("x", 0), ("z", 3)]), ("c", [("z", 2), ("y", 1)])):
        writer = Writer(tmp_path / "sub" / f"{name}.jsonl", "one")
        for key, attempt in rows:
            writer.add(key, {"of": f"{name}{key}"}, attempt)
        writer.close()
    store = Store(tmp_path, "one")
    found = [row and row["of"] for row in store.results(["x", "y", "nothing", "z", "x"])]
    assert found == ["bx", "cy", None, "bz", "bx"]
    assert [store.attempt(key) for key in ("x", "y", "z", "w")] == [1, 2, 4, 0]
    assert Store(tmp_path, "two").foreign == 6
    assert (store.foreign, store.damaged) == (0, [])


def test_files_that_are_no_store_are_left_alone(tmp_path):
    """However many there are; an empty one is taken; a file with another name is given one of its own."""
    for name in ("rank-0.jsonl", "rank-0-1.jsonl", "rank-0-2.jsonl"):
        (tmp_path / name).write_text("mine")
    (tmp_path / "rank-0-3.jsonl").write_text("")
    writer = Writer(tmp_path / "rank-0.jsonl", "one")
    writer.add("x", {"a": 1})
    assert Store(tmp_path, "one").result("x") == {"a": 1}  # it is on the disk at once
    writer.close()
    assert (tmp_path / "rank-0-3.jsonl").read_bytes().count(b"\n") == 1
    assert (tmp_path / "rank-0-1.jsonl").read_text() == "mine"
    kept = tmp_path / "kept"
    os.link(tmp_path / "rank-0-3.jsonl", kept)
    writer = Writer(tmp_path / "rank-0-3.jsonl", "one")
    writer.add("y", {"a": 2})
    writer.close()
    assert kept.read_bytes().count(b"\n") == 1
    assert len(Store(tmp_path, "one").entries) == 2

"""Starting libraries, writing files and naming the ways a run can fail, each alone.

Source: the state of process and folder before; the wording promised in README.
"""

import errno
import gc
import importlib
import os
import sys
from contextlib import suppress
from types import SimpleNamespace as Fake

import pytest

from dolfbuoy import errors, writing
from dolfbuoy.errors import InputError, NoResult, NotAccurate, missing, printable

elsewhere = importlib.import_module("dolfbuoy.elsewhere")  # a function hides it

# -- libraries ---------------------------------------------------------------------------------------------------------


class Collector:
    """A garbage collector that tells what is done to it."""

    def __init__(self, enabled, frozen):
        self.calls, self.isenabled, self.get_freeze_count = [], lambda: enabled, lambda: frozen

    def __getattr__(self, name):
        return lambda: self.calls.append(name)


@pytest.mark.parametrize(
    ("enabled", "frozen", "after"),
    [
        (True, 0, ["freeze", "unfreeze", "enable"]),
        (True, 5, ["enable"]),  # else what the host has frozen would thaw
        (False, 0, []),
    ],
)
def test_a_quick_start_leaves_the_collector_as_it_was(monkeypatch, enabled, frozen, after):
    collector = Collector(enabled, frozen)
    monkeypatch.setattr(elsewhere, "gc", collector)
    with suppress(KeyError), elsewhere.quick_start():
        assert collector.calls == ["disable"]
        raise KeyError
    assert collector.calls == ["disable", *after]


def test_a_quick_start_looks_functions_up_when_they_are_called():
    flags, collects = sys.getdlopenflags(), gc.isenabled()
    try:
        sys.setdlopenflags(os.RTLD_NOW | os.RTLD_GLOBAL)
        with elsewhere.quick_start():
            assert sys.getdlopenflags() == os.RTLD_LAZY | os.RTLD_GLOBAL
            assert not gc.isenabled()
        assert sys.getdlopenflags() == os.RTLD_NOW | os.RTLD_GLOBAL
        assert gc.isenabled() == collects
    finally:
        sys.setdlopenflags(flags)


def test_a_library_is_started_at_the_root_and_leaves_nothing_open(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = len(os.listdir("/proc/self/fd"))
    with suppress(KeyError), elsewhere.elsewhere():
        assert os.getcwd() == "/"
        assert not gc.isenabled()
        raise KeyError
    assert os.getcwd() == str(tmp_path)
    assert len(os.listdir("/proc/self/fd")) == before


@pytest.mark.parametrize("fails", [False, True])
def test_netcdf_starts_with_its_first_file(monkeypatch, fails):
    """Which is none, at the root; the library is looked for once."""
    seen = []

    def opened(place):
        seen.append((place, os.getcwd()))
        if fails:
            raise OSError

    library = Fake(Dataset=opened)
    monkeypatch.setitem(vars(elsewhere), "netCDF4", None)
    monkeypatch.setattr(elsewhere, "_check_temporary_folder", lambda: seen.append("checked"))  # of MPI alone
    monkeypatch.setattr(elsewhere, "sys", Fake(modules={}, **_flags()))
    monkeypatch.setattr(elsewhere.importlib, "import_module", lambda name: seen.append(name) or library)
    assert elsewhere.__getattr__("netCDF4") is library
    assert seen == ["netCDF4", ("/", "/")]
    assert elsewhere.netCDF4 is library


@pytest.mark.parametrize(("started", "checked"), [(True, []), (False, ["checked"])])
def test_mpi_is_started_where_it_can_write(monkeypatch, started, checked):
    seen, library = [], Fake()
    monkeypatch.setitem(vars(elsewhere), "MPI", None)
    monkeypatch.setattr(elsewhere, "_check_temporary_folder", lambda: seen.append("checked"))
    monkeypatch.setattr(elsewhere, "sys", Fake(modules={"mpi4py.MPI": library} if started else {}, **_flags()))
    monkeypatch.setattr(elsewhere.importlib, "import_module", lambda name: seen.append(name) or library)
    assert elsewhere.__getattr__("MPI") is library
    assert seen == [*checked, "mpi4py.MPI"]


def _flags():
    return {"getdlopenflags": sys.getdlopenflags, "setdlopenflags": sys.setdlopenflags}


def test_other_names_are_no_library():
    with pytest.raises(AttributeError, match=r"module 'dolfbuoy\.elsewhere' has no attribute 'numpy'"):
        elsewhere.__getattr__("numpy")


def test_the_temporary_folder_of_mpi(tmp_path, monkeypatch):
    """The first that is named; nothing stays in it."""
    good, gone = str(tmp_path), str(tmp_path / "gone")
    for name in ("TMPDIR", "TEMP", "TMP"):
        monkeypatch.delenv(name, raising=False)
    elsewhere._check_temporary_folder()
    for given, wrong in (
        ({"TMPDIR": good, "TEMP": gone, "TMP": gone}, None),
        ({"TMPDIR": "", "TEMP": good, "TMP": gone}, None),
        ({"TMP": gone}, "TMP"),
        ({"TEMP": gone, "TMP": good}, "TEMP"),
    ):
        with monkeypatch.context() as patch:
            for name, folder in given.items():
                patch.setenv(name, folder)
            if wrong is None:
                elsewhere._check_temporary_folder()
            else:
                with pytest.raises(InputError) as error:
                    elsewhere._check_temporary_folder()
                said = (
                    f"{wrong} = {gone!r}: must be a folder in which files can be written (No such file or directory)."
                )
                assert str(error.value) == said
        assert os.listdir(tmp_path) == []


# -- how it ends -------------------------------------------------------------------------------------------------------


def test_what_is_no_character_is_escaped():
    assert printable("é\x1b[31m\n") == r"é\x1b[31m\n"
    assert str(InputError(ValueError("a\tb"))) == r"a\tb"


@pytest.mark.parametrize("kind", [NoResult, NotAccurate])
def test_what_was_computed_goes_with_the_error(kind):
    assert (str(kind("Why.", "a record")), kind("Why.", "a record").record, kind("Why.").record) == (
        "Why.",
        "a record",
        None,
    )


def test_a_package_of_the_system_that_is_missing(monkeypatch):
    """By its own name, by what a compiled module was missing, or as the first that dolfinx itself lists."""
    rest = ": dolfbuoy needs dolfinx, petsc4py, mpi4py and h5py of the system, which pip does not bring; "
    rest += "docker/install.sh installs them, and dolfbuoy doctor says what is there."
    asked = []

    def find(name):
        asked.append(name)
        if name == "h5py":
            raise ModuleNotFoundError(name=name)

    monkeypatch.setattr(errors.importlib, "import_module", find)
    caused = ImportError("numpy fails")
    caused.__cause__ = ImportError("libpetsc.so: gone.", name="petsc4py.PETSc")
    other = ImportError("x")
    other.__cause__ = ValueError("y")
    listed = ImportError("some are missing\n* mpi4py is needed\n* h5py is needed\n  * ufl is not at the beginning")
    for error, said in (
        (ModuleNotFoundError("No module", name="dolfinx.fem"), "dolfinx is not installed"),
        (ImportError("libmpi.so: gone.", name="mpi4py"), "mpi4py cannot be imported (libmpi.so: gone)"),
        (caused, "petsc4py cannot be imported (libpetsc.so: gone)"),
        (listed, "h5py is not installed"),
    ):
        assert str(missing(error)) == said + rest
    assert asked == ["mpi4py", "h5py"]
    assert [missing(error) for error in (other, ImportError("z", name="scipy"), ImportError("z"))] == [None] * 3


# -- files -------------------------------------------------------------------------------------------------------------


def test_a_file_is_replaced_at_once(tmp_path):
    """What a process that was killed has left goes; nothing but the file is there afterwards."""
    path, part = tmp_path / "a.txt", tmp_path / ".a.txt.part"
    path.write_text("old")
    part.symlink_to(tmp_path / "stranger")
    with writing.replacing(str(path)) as fresh:
        assert (fresh, fresh.is_symlink(), fresh.read_bytes()) == (part, False, b"")
        fresh.write_text("new")
        assert path.read_text() == "old"
    assert (os.listdir(tmp_path), path.read_text()) == (["a.txt"], "new")
    mask = os.umask(0)
    try:
        writing.write_text(tmp_path / "b.txt", "é")
    finally:
        os.umask(mask)
    assert ((tmp_path / "b.txt").stat().st_mode & 0o777, (tmp_path / "b.txt").read_bytes()) == (0o666, b"\xc3\xa9")


@pytest.mark.parametrize(
    ("error", "number", "said"),
    [
        (OSError(errno.ENOSPC, "full"), errno.ENOSPC, os.strerror(errno.ENOSPC)),
        (OSError("odd"), None, os.strerror(errno.EIO)),
        (RuntimeError("NetCDF: HDF error"), errno.EIO, "NetCDF: HDF error"),
    ],
)
def test_what_cannot_be_written_leaves_the_file_as_it_was(tmp_path, error, number, said):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(OSError, match=r"a\.txt") as found, writing.replacing(path):
        raise error
    assert (found.value.errno, found.value.strerror, found.value.filename) == (number, said, str(path))
    assert (os.listdir(tmp_path), path.read_text()) == (["a.txt"], "old")


def test_what_is_added_stands_at_the_end(tmp_path):
    mask = os.umask(0)
    try:
        for text in (b"one", b"two"):
            with writing.appending(tmp_path / "a") as file:
                file.write(text)
    finally:
        os.umask(mask)
    assert ((tmp_path / "a").read_bytes(), (tmp_path / "a").stat().st_mode & 0o777) == (b"onetwo", 0o666)
    (tmp_path / "b").symlink_to(tmp_path / "a")
    with pytest.raises(OSError, match="b"):
        writing.appending(tmp_path / "b")


def test_folders_within_each_other_are_made_and_no_link_is_followed(tmp_path):
    for _ in range(2):
        assert writing.made(tmp_path / "x" / "y", "a", "b") == tmp_path / "x" / "y" / "a" / "b"
    assert (tmp_path / "x" / "y" / "a" / "b").is_dir()
    (tmp_path / "x" / "link").symlink_to(tmp_path)
    with pytest.raises(InputError) as error:
        writing.made(tmp_path / "x", "link", "c")
    said = f"{tmp_path / 'x' / 'link'} is a link, and nothing is written through it: "
    assert str(error.value) == f"{said}remove it, or take another folder."
    with pytest.raises(InputError, match="give --out to write there"):
        writing.refuse_link(tmp_path / "x" / "link", writing.GIVEN)


def test_a_file_that_is_there_is_not_replaced(tmp_path):
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    files = [tmp_path / "none", tmp_path / "dangling"]
    writing.refuse_present(files[:1])
    writing.refuse_present(files, overwrite=True)
    with pytest.raises(InputError, match=r"dangling would be replaced: move it away, take another name, or give"):
        writing.refuse_present(files)

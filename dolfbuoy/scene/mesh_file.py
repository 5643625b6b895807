"""Files named by a scene.

A scene may come from an untrusted source.  Files that it names must lie below its own folder and are only read: no
absolute paths, no "..", no links that lead out, and no references from inside a mesh to other places.  On the command
line and in Python, where the user gives the name, any path is allowed.
"""

import itertools
import os.path
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any
from xml.etree import ElementTree

from ..meshes import read_nodes

#: Formats with known kinds of references to other files.
FORMATS = (".vtu", ".vtk", ".msh", ".mesh", ".xdmf", ".xmf")


@dataclass(frozen=True)
class Named:
    """A file named by a scene in a folder."""

    folder: Path
    name: str

    def __repr__(self) -> str:
        return repr(self.name)


def element_lengths(value: Any) -> Any:
    """Replace the name of a line mesh by [[length, 1], ...] of its elements, so that a scene does not need the file.
    Other values of `cable.elements` are unchanged.  Raises ValueError."""
    if isinstance(value, Named):
        value = inside(value.folder, value.name)
        if value.suffix.lower() not in FORMATS:
            raise ValueError(f"must be a mesh file of these formats: {', '.join(FORMATS)}")
        if value.suffix.lower() in (".xdmf", ".xmf"):
            _check_xdmf(value)
    if not isinstance(value, str | Path):
        return value
    if not os.path.isfile(value):
        raise ValueError("file not found")
    nodes = read_nodes(value)
    return [[float(b - a), 1] for a, b in itertools.pairwise(nodes)]


def inside(folder: Path, name: str) -> Path:
    """The file of a relative name; raises ValueError if it lies, or a link leads, outside the folder."""
    parts = PurePosixPath(name).parts
    if "\0" in name or ".." in parts or PurePosixPath(name).is_absolute() or PureWindowsPath(name).anchor:
        raise ValueError("must be a path below the folder of the scene, without '..'")
    try:
        path = (Path(folder) / name).resolve()
        found = path.is_file()
    except (OSError, RuntimeError):  # name too long, circular links
        raise ValueError("file not found") from None
    if not path.is_relative_to(Path(folder).resolve()):
        raise ValueError("must not be a link that leaves the folder of the scene")
    if not found:
        raise ValueError("file not found")
    return path


def _check_xdmf(path: Path) -> None:
    """Raise ValueError unless everything that it refers to lies below its folder."""
    text = path.read_bytes()
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text or b"\0" in text:
        raise ValueError("must not declare a document type or entities")
    try:
        elements = list(ElementTree.fromstring(text).iter())
    except ElementTree.ParseError as error:
        raise ValueError(f"is no XDMF file ({error})") from None
    for element in elements:
        if element.tag.rpartition("}")[2] == "include":
            raise ValueError("must not include other files")
        kind = element.get("Format", "XML").upper()
        if kind == "HDF":
            check_hdf5(inside(path.parent, (element.text or "").strip().partition(":")[0]))
        elif kind != "XML":
            raise ValueError(f"must hold its numbers as text or in an HDF5 file, not as Format {kind!r}")


def check_netcdf(path: Path) -> None:
    """As `check_hdf5` for a netCDF file, which may have an older format without links."""
    with path.open("rb") as file:
        if file.read(4) == b"\x89HDF":
            check_hdf5(path)


def check_hdf5(path: Path) -> None:
    """Raise ValueError if links, or the data of a data set, lead to another file."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            # each object once, not through links; an error holding an object would outlive HDF5 and crash it
            elsewhere = _elsewhere(file) or file.visititems(lambda _, found: _elsewhere(found))
    except (OSError, RuntimeError) as error:
        raise ValueError(f"its HDF5 file cannot be read ({error})") from None
    if elsewhere:
        raise ValueError(f"its HDF5 file must hold its numbers itself, and {elsewhere}")


def _elsewhere(found: Any) -> str | None:
    """Contents of an HDF5 object that lie in another file, in words; None if there are none."""
    import h5py

    if isinstance(found, h5py.Dataset) and (found.external or found.is_virtual):
        return f"those of {found.name!r} are elsewhere"
    if isinstance(found, h5py.Group):
        for name in found:
            if not isinstance(found.get(name, getlink=True), h5py.HardLink):
                return f"{name!r} is a link"
    return None

"""Kernels of FFCx for several cells at once, one cell in each lane of the vector registers.

FFCx generates kernels for one cell, which compilers turn into mostly scalar instructions.  The same text serves several
cells if `double` is replaced by a GNU C vector; tables of basis functions remain scalars.  Only initial values,
conditional expressions and the functions of <math.h> have to be rewritten.  A kernel with anything else is not
converted; nor is one whose results differ from those of the single-cell kernel, checked once after compilation.
"""

import ctypes
import logging
import os
import platform
import re
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from ..core import build
from . import c_code, compat, instructions

#: Functions that kernels may call.
FUNCTIONS = ["sqrt", "fabs", "exp", "log", "cos", "sin", "tan", "acos", "asin", "atan", "cosh", "sinh", "tanh", "erf"]
FUNCTIONS += ["atan2", "pow", "jn", "fmin", "fmax"]

#: Allows x/y as x times the reciprocal of y, and ignores -0: results agree with those of single cells to rounding.
OPTIONS = ("-freciprocal-math", "-fno-signed-zeros", "-Wno-psabi", "-fno-sanitize=undefined")
LIBRARIES = ("-lmvec", "-lm") if platform.machine() == "x86_64" else ("-lm",)
ACCURACY = 1e-12  #: of a tensor, relative to its largest entry

_Function = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 7)


class Sizes(NamedTuple):
    """Counts of numbers per cell that a kernel writes and reads."""

    tensor: int
    coefficients: int
    constants: int
    coordinates: int


def several(kernel: int, sizes: Sizes) -> tuple[int, int] | None:
    """Address of a version for several cells of the kernel at an address, and their number.

    It takes A, w, c and x of the kernel, each number as an aligned vector.  None if FFCx has not kept the text of the
    kernel, or it cannot be converted, or its results differ on this machine.
    """
    file, name = build.place_of(kernel)
    text = Path(file).with_name(Path(file).name.split(".")[0] + ".c")
    return _compiled(text, name, instructions.best(), kernel, sizes) if text.exists() else None


@cache
def _compiled(text, name, chosen, kernel, sizes):
    key = text.stem, name, chosen, [file.read_text() for file in (Path(__file__), build.FOLDER / "simd.c")]
    path = c_code.kept("lanes", key, partial(_make, text, name, chosen, kernel, sizes))
    if path.stat().st_size == 0:
        return None
    return _address(path), chosen.lanes


def _address(path):
    return ctypes.cast(ctypes.CDLL(path).several, ctypes.c_void_p).value


def _make(text, name, chosen, kernel, sizes, path):
    """Compile a kernel for several cells to `path`; an empty file if the single-cell kernel must be used."""
    kernel_text = text_of(text.read_text(), name)
    with TemporaryDirectory(dir=path.parent) as folder:
        trial = Path(folder) / path.name
        if is_known(kernel_text):
            compile_kernel(trial, in_vectors(kernel_text), name, chosen)
            apart = difference(_address(trial), chosen.lanes, kernel, sizes)
            if not apart <= ACCURACY:
                words = "%s for %d cells at once differs from that for one by %.1e on this machine and is not used."
                logging.getLogger("dolfbuoy").warning(words, name, chosen.lanes, apart)
                trial = Path(folder) / "none"  # another file: a loaded one must not be truncated
        if not trial.exists():
            trial.touch()
        os.replace(trial, path)


def compile_kernel(path: Path, kernel_text: str, name: str, chosen: instructions.Instructions, lanes: int = 0) -> None:
    """Compile the text of a kernel, for one cell or in vectors, to a shared library with the function `several`."""
    with TemporaryDirectory(dir=path.parent) as folder:
        file = Path(folder) / "kernel.h"
        file.write_text(f"static {kernel_text}")
        defined = [f'-DKERNEL="{file}"', f"-DNAME={name}", f"-DLANES={lanes or chosen.lanes}"]
        defined += ["-DKERNEL_TAKES_DATA"] if compat.KERNEL_TAKES_DATA else []
        unit = build.Unit(build.FOLDER / "simd.c", [*OPTIONS, *chosen.options, *defined])
        build.shared_library(path, [unit], LIBRARIES)


def text_of(text: str, name: str) -> str:
    """Text of the function with this name in a C file, without comments."""
    text = re.sub(r"//.*", "", text)
    begin = text.index(f"void {name}(")
    body = text.index("{", begin) + 1
    return text[begin : body + _length(text[body:], "{}") + 1] + "\n"


def difference(function: int, lanes: int, kernel: int, sizes: Sizes) -> float:
    """Largest difference of a function for several cells from the single-cell kernel, for random inputs: relative to
    the largest entry of the tensor; inf if nothing can be compared.

    Cells are ignored if results are not finite or are too sensitive to the rounding of inputs for `ACCURACY`.
    """
    worst, rng = -np.inf, np.random.default_rng(1)
    for low, high in ((0.5, 1.5), (-1.0, 1.0), (0.1, 0.7), (-4.0, 4.0)):
        inputs = [rng.uniform(low, high, (size, lanes)) for size in sizes[1:]]
        moved = [array * (1 + np.finfo(float).eps * rng.choice([-1, 1], array.shape)) for array in inputs]
        found = _called(function, sizes.tensor, inputs)
        expected, beside = _by_cells(kernel, sizes.tensor, inputs), _by_cells(kernel, sizes.tensor, moved)
        scale = np.maximum(np.abs(expected).max(axis=0), np.finfo(float).tiny)
        with np.errstate(invalid="ignore"):
            settled = (np.abs(beside - expected) <= 0.1 * ACCURACY * scale).all(axis=0) & np.isfinite(scale)
            apart = (np.abs(found - expected) / scale)[:, settled]
        worst = max(worst, np.where(np.isfinite(apart), apart, np.inf).max(initial=-np.inf))
    return worst if np.isfinite(worst) else np.inf


def _by_cells(kernel, size, inputs):
    """A (numbers, cells) from the single-cell kernel."""
    cells = range(inputs[0].shape[1])
    return np.concatenate([_called(kernel, size, [array[:, [k]] for array in inputs]) for k in cells], axis=1)


def _called(function, size, inputs):
    """A (numbers, cells) from a kernel at an address, for w, c and x of as many cells as it takes."""
    arrays = [c_code.aligned(size * inputs[0].shape[1]), *(c_code.aligned(array.size) for array in inputs)]
    for array, given in zip(arrays[1:], inputs, strict=True):
        array[:] = given.ravel()
    permutation = np.zeros(2, dtype=np.uint8)
    _Function(function)(*(array.ctypes.data for array in arrays), None, permutation.ctypes.data, None)
    return arrays[0].reshape(size, -1)


def is_known(kernel: str) -> bool:
    """True if `in_vectors` can convert everything in the text of a kernel."""
    body = kernel[kernel.index("{") :]
    called = set(re.findall(r"\b([A-Za-z_]\w*)\(", body)) - {"for"}
    return called <= set(FUNCTIONS) and not re.search(r"[!%^~]|->|\b(if|while|switch)\b", body)


def in_vectors(kernel: str) -> str:
    """The text of a kernel, with numbers replaced by vectors."""
    kernel = re.sub(r"(?<!static const )\bdouble\b", "real", re.sub(r"\bbool\b", "choice", kernel))
    kernel = re.sub(rf"\b({'|'.join(FUNCTIONS)})\(", r"v_\1(", kernel).replace(" && ", " & ").replace(" || ", " | ")
    kernel = "\n".join(map(_with_picks, kernel.split("\n")))
    return re.sub(r"^( *(?:(?:const )?real )?\w+(?:\[[^=;]*\])?) = ([^{};]*);$", r"\1 = V(\2);", kernel, flags=re.M)


def _with_picks(line):
    """A line with every `condition ? a : b` replaced by pick(condition, a, b)."""
    while "?" in line:
        at = line.rindex("?")
        begin, end = at - _length(line[at - 1 :: -1], ")(", "="), at + 1 + _length(line[at + 1 :], "()", ";")
        colon = at + 1 + _length(line[at + 1 :], "()", ":")
        parts = line[begin:at], line[at + 1 : colon], line[colon + 1 : end]
        line = f"{line[:begin]}pick({parts[0]}, V({parts[1]}), V({parts[2]})){line[end:]}"
    return line


def _length(text, brackets, end=""):
    """Length of a text up to a character of `end` outside brackets, or to an unmatched closing bracket."""
    depth = 0
    for n, letter in enumerate(text):
        if depth == 0 and (letter in end or letter == brackets[1]):
            return n
        depth += (letter == brackets[0]) - (letter == brackets[1])
    return len(text)

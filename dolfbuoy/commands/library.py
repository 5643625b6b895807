"""`dolfbuoy library`: the shared library for programs in other languages."""

from pathlib import Path
from typing import Annotated

from ..parallel.ranks import rank
from ..writing import made, refuse_present, write_text
from .app import app
from .shared import OverwriteOption, out_option, say


@app.command()
def library(
    folder: Annotated[Path, out_option("lib")] = Path("lib"),
    overwrite: OverwriteOption = False,
) -> None:
    """Shared library and header for C, C++, Fortran, MATLAB.  Example: dolfbuoy library --out lib"""
    from ..coupling.library import FOLDER, HEADER, LIBRARY, build

    if rank() != 0:
        return
    refuse_present([folder / name for name in (LIBRARY, HEADER)], overwrite)
    made(folder)
    build(folder.resolve() / LIBRARY)
    write_text(folder / HEADER, (FOLDER / HEADER).read_text(encoding="utf-8"))
    say(f"{LIBRARY} and {HEADER} in {folder}: cc program.c -I{folder} -L{folder} -ldolfbuoy -Wl,-rpath,{folder}")

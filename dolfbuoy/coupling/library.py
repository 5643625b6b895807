"""The shared library libdolfbuoy, compiled for this Python, which it embeds; it calls `served`.

Python is embedded because with a separate server every step would wait for two processes to wake up, as long as a step
of a short line takes; and a session ends with the program that holds it.  cffi writes the glue code.
"""

import sysconfig
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from ..core.build import Unit, shared_library

FOLDER = Path(__file__).parent
HEADER, LIBRARY = "dolfbuoy.h", "libdolfbuoy.so"

#: Code run by the embedded Python: this Python's packages come before the system's.
START = """
import site, sys
known = list(sys.path)
site.addsitedir({folder!r})
of_system = [path for path in known if path.endswith("-packages")]
sys.path[:] = [*(path for path in sys.path if path not in of_system), *of_system]
from {name} import ffi
from dolfbuoy.coupling.served import serve
serve(ffi)
"""


def build(target: Path, more: Sequence[Path] = (), options: Sequence[str] = ()) -> Path:
    """Compile the library, optionally with more C files, to a path that ends in .so; returns the path.

    Raises InputError without a C compiler or an embeddable Python, and OSError.
    """
    from cffi import FFI, recompiler

    builder, name = FFI(), f"{target.stem}_dolfbuoy"
    text = (FOLDER / HEADER).read_text()
    begin, end = "/* From here on cffi reads too: no preprocessor. */", "/* To here. */"
    builder.embedding_api(text.partition(begin)[2].partition(end)[0])
    known = sysconfig.get_config_var
    builder.embedding_init_code(START.format(folder=sysconfig.get_path("purelib"), name=name))
    with TemporaryDirectory() as folder:
        glue = Path(folder) / "glue.c"
        recompiler.make_c_source(builder, name, '#include "embedded.h"', str(glue))
        places = [
            f"-I{FOLDER}",
            f'-DPYTHON_LIBRARY="{known("INSTSONAME")}"',
            *(f"-isystem{sysconfig.get_path(kind)}" for kind in ("include", "platinclude")),
        ]
        units = [Unit(file, [*places, *options]) for file in (glue, *more)]
        libraries = [f"-L{known('LIBDIR')}", f"-lpython{known('LDVERSION')}", "-ldl"]
        shared_library(target, units, libraries)
    return target

"""PETSc options that a scene may set: a short list of numbers, words and switches.

PETSc's own options can run code (`pc_type = python`) and write files (`snes_view = ascii:FILE`), and a scene may be
untrusted data.  So an option is passed on only if it is listed here, with a value of the listed kind, and only if it
matters to the solvers chosen by the other options.  Monitors print to the screen only.
"""

import math
from typing import Any

from .quantities import Wrong

SWITCH = "true or false"


class Number:
    """Bounds of a number, both included; whole numbers only if the bounds are."""

    def __init__(self, low: float, high: float):
        self.low, self.high, self.whole = low, high, isinstance(low, int)

    def __contains__(self, value: Any) -> bool:
        right = isinstance(value, int if self.whole else int | float) and not isinstance(value, bool)
        return right and bool(self.low <= value <= self.high)

    def __str__(self) -> str:
        return f"a {'whole ' if self.whole else ''}number from {self.low:g} to {self.high:g}"


_FACTOR: dict[str, Number | tuple[str, ...] | str] = {
    "pc_factor_mat_solver_type": ("petsc", "mumps", "superlu", "superlu_dist", "umfpack"),
    "pc_factor_mat_ordering_type": ("natural", "nd", "1wd", "rcm", "qmd"),
    "pc_factor_levels": Number(0, 20),
    "pc_factor_shift_type": ("none", "nonzero", "positive_definite", "inblocks"),
    "pc_factor_shift_amount": Number(1e-300, 1.0),
}
_WITHIN = {f"sub_{key}": allowed for key, allowed in _FACTOR.items()}

#: Option -> its words, the bounds of its number, or SWITCH.
ALLOWED: dict[str, Number | tuple[str, ...] | str] = {
    "snes_max_it": Number(1, 10_000),
    "snes_linesearch_type": ("bt", "basic", "l2", "cp", "nleqerr"),
    "snes_linesearch_max_it": Number(1, 1000),
    "snes_linesearch_order": Number(1, 3),
    "snes_linesearch_damping": Number(1e-6, 1.0),
    "snes_linesearch_minlambda": Number(1e-300, 1.0),
    "snes_monitor": SWITCH,
    "snes_converged_reason": SWITCH,
    "snes_linesearch_monitor": SWITCH,
    "ksp_monitor": SWITCH,
    "ksp_converged_reason": SWITCH,
    "ksp_type": ("richardson", "preonly", "gmres", "fgmres", "bcgs", "tfqmr"),
    "ksp_rtol": Number(1e-16, 1.0),
    "ksp_max_it": Number(1, 100_000),
    "ksp_pc_side": ("left", "right"),
    "ksp_gmres_restart": Number(1, 10_000),
    "pc_type": ("lu", "ilu", "bjacobi", "asm", "jacobi", "none"),
    **_FACTOR,
    "pc_asm_overlap": Number(0, 1000),
    "pc_bjacobi_blocks": Number(1, 100_000),
    "sub_ksp_type": ("preonly", "richardson", "gmres"),
    "sub_pc_type": ("lu", "ilu", "jacobi", "none"),
    **_WITHIN,
    "mat_mumps_icntl_14": Number(0, 10_000),
}
#: Prefix of an option's name -> option that must have one of these values (its default first) for it to matter.
NEEDS = {
    "ksp_gmres_": ("ksp_type", "richardson", ("gmres", "fgmres")),
    "pc_factor_levels": ("pc_type", "lu", ("ilu",)),
    "pc_factor_mat_solver_type": ("pc_type", "lu", ("lu",)),
    "pc_factor_": ("pc_type", "lu", ("lu", "ilu")),
    "pc_asm_": ("pc_type", "lu", ("asm",)),
    "pc_bjacobi_": ("pc_type", "lu", ("bjacobi",)),
    "sub_pc_factor_levels": ("sub_pc_type", "ilu", ("ilu",)),
    "sub_pc_factor_mat_solver_type": ("sub_pc_type", "ilu", ("lu",)),
    "sub_pc_factor_": ("sub_pc_type", "ilu", ("lu", "ilu")),
    "sub_": ("pc_type", "lu", ("bjacobi", "asm")),
    "mat_mumps_": ("pc_factor_mat_solver_type", "petsc", ("mumps",)),
}


def checked(options: dict[str, Any]) -> dict[str, Any]:
    """The options in a form for PETSc.  Raises ValueError with key, value and what is allowed."""
    for key, value in options.items():
        if key not in ALLOWED:
            raise Wrong(key, value, f"is no option that a scene may set; allowed are {', '.join(ALLOWED)}")
        allowed = ALLOWED[key]
        if isinstance(allowed, str):  # SWITCH
            good = isinstance(value, bool)
        else:
            good = value in allowed and not (isinstance(value, float) and math.isnan(value))
        if not good:
            what = allowed if not isinstance(allowed, tuple) else f"one of {', '.join(allowed)}"
            raise Wrong(key, value, f"must be {what}")
    for key in options:
        for beginning, (other, default, values) in NEEDS.items():
            if key.startswith(beginning) and options.get(other, default) not in values:
                raise Wrong(key, options[key], f"has no effect unless {other} is {' or '.join(values)}")
    return {key: value for key, value in options.items() if value is not False}

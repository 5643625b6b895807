"""What a study says: the file NAME.toml beside its module.

help                of its command, with an example
[options]           of its command, in the order of --help: each a table of the fields of Option
[columns], [columns.NAME]   key of the rows -> heading, of the tables that are shown
[words]             sentences with places for numbers
"""

import functools
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

#: Name of a study -> its module, in the order of `dolfbuoy study --help`.
STUDIES = {
    "inf-sup": "stability.inf_sup",
    "explicit-limit": "stability.explicit_limit",
    "convergence": "accuracy.convergence",
    "rising": "stability.rising",
    "slack": "stability.slack",
    "hard-cases": "hard_cases.runner",
    "regularisation": "stability.regularisation",
    "work-precision": "accuracy.work_precision",
    "touchdown": "accuracy.touchdown",
    "effects": "physics.effects",
    "energy": "physics.energy",
    "hull": "physics.hull",
    "endurance": "stability.endurance",
    "step-cost": "accuracy.step_cost",
}

#: Options that are the same in several studies.
USUAL = {
    "scene": {
        "help": "Name of a shipped scene, or path of a TOML file.",
        "metavar": "SCENE",
        "argument": True,
        "required": True,
    },
    "out": {"help": "Folder of the results [default: results/study-NAME].", "kind": "path"},
}
KINDS = {"str": str, "int": int, "float": float, "path": Path}


@dataclass(frozen=True)
class Option:
    """An option of a command, --name with dashes, or its argument; kind: one of KINDS, needed without a default."""

    name: str
    help: str
    default: str | int | float | bool | None = None
    kind: str = "str"
    metavar: str | None = None
    min: float | None = None
    max: float | None = None
    argument: bool = False
    required: bool = False

    @property
    def type(self) -> type:
        """Of its values."""
        return KINDS[self.kind] if self.default is None else type(self.default)


@dataclass(frozen=True)
class Declaration:
    """The contents of such a file."""

    help: str = ""
    options: list[Option] = field(default_factory=list)
    columns: dict = field(default_factory=dict)
    words: dict[str, str] = field(default_factory=dict)
    data: dict = field(default_factory=dict)

    def say(self, sentence: str, **values) -> str:
        """A sentence with its numbers."""
        return self.words[sentence].format(**values)


@functools.cache
def declared(module: str | Path) -> Declaration:
    """What belongs to a module: its file, or a value of STUDIES."""
    path = Path(module) if str(module).endswith(".py") else Path(__file__).parent / module.replace(".", "/")
    text = tomllib.loads(path.with_suffix(".toml").read_text(encoding="utf-8"))
    options = [Option(name, **(USUAL.get(name, {}) | given)) for name, given in text.pop("options", {}).items()]
    return Declaration(options=options, **text)

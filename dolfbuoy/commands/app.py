"""The application of the command line: the commands of every module of this folder, imported when they are needed.

A module adds its commands by `@app.command()`; nothing else has to name it.
"""

import itertools
import pkgutil
import re
from importlib import import_module
from pathlib import Path
from typing import Any, get_args, get_type_hints

import typer
from typer.core import TyperGroup
from typer.main import get_group

from ..errors import InputError
from ..parallel import interruption
from .shared import Interrupted

#: Modules that start the application, and are not looked through for commands.
STARTING = ("entry", "main")


class Checked(TyperGroup):
    """Commands whose options are neither empty nor numbers that nobody means."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name, command, rest = super().resolve_command(ctx, args)
        _check_options(command, rest)
        return name, command, rest


class _Group(Checked):
    """Imports the modules of this folder when a command of theirs is requested: a start pays for its own command only.

    It ends an interruption itself; typer's word for that would be "Aborted".
    """

    def list_commands(self, ctx: Any) -> list[str]:
        self._import(_modules())
        return super().list_commands(ctx)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in self.commands:
            self._import([cmd_name] if cmd_name in _modules() else _with_function(cmd_name))
        if cmd_name not in self.commands:  # misspelt
            self._import(_modules())
        return super().get_command(ctx, cmd_name)

    def _import(self, names: list[str]) -> None:
        for name in names:
            import_module(f".{name}", __package__)
        self.commands.update(get_group(app).commands)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except Interrupted:
            raise
        except BaseException:
            if interruption.received():
                raise Interrupted("Interrupted.") from None
            raise


def _check_options(command: Any, arguments: list[str]) -> None:
    """Refuse an option with nothing in it, mostly a variable of a shell that is not set (a path of no name is the
    folder that one is in), and a number that Python reads but nobody means: 1_0, or digits of another script."""
    types = get_type_hints(command.callback) if command.callback else {}  # none of a group
    numbers = {
        option
        for one in command.params
        if {float, int} & {types.get(one.name), *get_args(types.get(one.name))}
        for option in one.opts
    }
    names = [argument.partition("=")[0] for argument in arguments]
    once = {option for one in command.params if not getattr(one, "multiple", False) for option in one.opts}
    for name in sorted(once & set(names)):
        if name.startswith("--") and names.count(name) > 1:
            raise InputError(f"{name}: must be given once; what it takes several of stands in it with commas.")
    for option, value in itertools.pairwise([*arguments, "-"]):
        name, equals, given = option.partition("=")
        value = given if equals else value
        if name.startswith("--") and not value.strip():
            raise InputError(f"{name} '': must not be empty.")
        if name in numbers and ("_" in value or not value.isascii()):
            raise InputError(f"{name} {value}: must be a number in plain digits, such as 10 or 0.5.")


def _modules() -> list[str]:
    """Names of the modules of this folder that may have commands."""
    folders = import_module(str(__package__)).__path__
    return sorted(module.name for module in pkgutil.iter_modules(folders) if module.name not in STARTING)


def _with_function(command: str) -> list[str]:
    """Names of the modules that define a function of a command's name, found in their text."""
    named, files = re.compile(rf"^def {re.escape(command)}_?\(", re.MULTILINE), Path(__file__).parent.glob("*.py")
    return sorted({file.stem for file in files if named.search(file.read_text("utf-8"))} & {*_modules()})


app = typer.Typer(
    cls=_Group,
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="Simulation of a tethered buoy with FEniCSx.\n\nExample: dolfbuoy run short",
)

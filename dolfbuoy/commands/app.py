"""The application of the command line: the commands of every module of this folder, imported when they are needed.

A module adds its commands by `@app.command()`; nothing else has to name it.
"""

import pkgutil
from importlib import import_module

import typer
from typer.core import TyperGroup
from typer.main import get_group

from ..parallel import interruption
from .shared import Interrupted

#: Modules that start the application, and are not looked through for commands.
STARTING = ("entry", "main")


class _Group(TyperGroup):
    """Imports the modules of this folder when a command of theirs is requested: a start pays for its own command only.

    It ends an interruption itself; typer's word for that would be "Aborted".
    """

    def list_commands(self, ctx):
        self._import(_modules())
        return super().list_commands(ctx)

    def get_command(self, ctx, cmd_name):
        if cmd_name not in self.commands:
            self._import([name for name in _modules() if name == cmd_name])
        if cmd_name not in self.commands:  # in a module with several commands, or misspelt
            self._import(_modules())
        return super().get_command(ctx, cmd_name)

    def _import(self, names):
        for name in names:
            import_module(f".{name}", __package__)
        self.commands |= get_group(app).commands

    def invoke(self, ctx):
        try:
            return super().invoke(ctx)
        except Interrupted:
            raise
        except BaseException:
            if interruption.received():
                raise Interrupted("Interrupted.") from None
            raise


def _modules() -> list[str]:
    """Names of the modules of this folder that may have commands."""
    folders = import_module(__package__).__path__
    return sorted(module.name for module in pkgutil.iter_modules(folders) if module.name not in STARTING)


app = typer.Typer(
    cls=_Group,
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="Simulation of a tethered buoy with FEniCSx.\n\nExample: dolfbuoy run short",
)

"""`dolfbuoy study ...`: a command of every study, made from its declaration."""

import inspect
from typing import Annotated

import typer
from rich.markup import escape

from ..studies.declaration import STUDIES, declared

app = typer.Typer(no_args_is_help=True, help="Studies.  Example: mpirun -n 2 dolfbuoy study convergence")


def _command(name, options):
    """The function from whose signature typer makes a command."""

    def command(**given):
        from ..studies.study import run_command

        if not run_command(name, **given):
            raise typer.Exit(1)

    command.__signature__ = inspect.Signature([_parameter(option) for option in options])
    return command


def _parameter(option):
    how = {"help": option.help and escape(option.help), "metavar": option.metavar, "min": option.min, "max": option.max}
    flag = f"--{option.name.replace('_', '-')}"
    info = typer.Argument(**how) if option.argument else typer.Option(flag, **how)
    default = inspect.Parameter.empty if option.required else option.default
    kind = option.type | None if default is None else option.type
    keyword = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(option.name, keyword, default=default, annotation=Annotated[kind, info])


for _name, _module in STUDIES.items():
    _declared = declared(_module)
    app.command(_name, help=_declared.help)(_command(_name, _declared.options))


def add_to(parent: typer.Typer) -> None:
    """Make them commands below `study` of an application."""
    parent.add_typer(app, name="study")

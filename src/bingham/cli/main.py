"""The command ``bingham``: one module a command, each with a function ``register(app)``.

A command module imports typer at its top and everything heavier inside the command, so that ``--help`` is quick.
"""

from __future__ import annotations

import sys
import warnings
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup

from bingham import __version__
from bingham.errors import BinghamError

__all__ = ["COMMANDS", "app", "main"]

# Modules of this package, in the order in which `bingham --help` lists their commands.
COMMANDS = [
    "track",
    "fit",
    "cluster",
    "tune",
    "simulate",
    "reproduce",
]


class Commands(TyperGroup):
    """Users' mistakes end in one line on stderr and exit code 2, an interruption in 130; neither in a traceback."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command that the user chose."""
        with warnings.catch_warnings():
            warnings.showwarning = show_warning
            try:
                return super().invoke(ctx)
            except BinghamError as error:
                typer.echo(f"bingham: {error}", err=True)
                raise typer.Exit(2) from None
            except KeyboardInterrupt:
                typer.echo("bingham: interrupted; nothing written", err=True)
                raise typer.Exit(130) from None


def show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """Print a warning as one line, without the source line that raised it."""
    sys.stderr.write(f"bingham: warning: {message}\n")


app = typer.Typer(
    name="bingham",
    cls=Commands,
    help="Uncertainty on axes and 3-D orientations: track recordings, fit axes, simulate sensors.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def version(show: bool) -> None:
    """Print the version and stop."""
    if show:
        typer.echo(f"bingham {__version__}")
        raise typer.Exit


@app.callback()
def common(
    show: bool = typer.Option(False, "--version", callback=version, is_eager=True, help="Show the version and exit."),
) -> None:
    """Options before the command."""


for command in COMMANDS:
    import_module(f"bingham.cli.{command}").register(app)


def main() -> None:
    """Run the command line."""
    app(prog_name="bingham")

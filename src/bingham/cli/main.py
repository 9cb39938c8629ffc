"""The command ``bingham``: one module a command, each with a function ``register(app)``.

A command module imports typer at its top and everything heavier inside the command, so that ``--help`` is quick.
"""

from __future__ import annotations

import inspect
import sys
import warnings
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup

from bingham import __version__, atomic
from bingham.cli.ending import Terminated, ending_in_order
from bingham.cli.suggestions import suggest
from bingham.cli.terminal import discard_output, open_streams, say, say_error, unexpected
from bingham.errors import BinghamError

__all__ = ["COMMANDS", "app", "main"]

# Modules of this package, in the order in which `bingham --help` lists their commands.
COMMANDS = [
    "track",
    "fit",
    "cluster",
    "planes",
    "tune",
    "calibrate",
    "simulate",
    "reproduce",
    "formats",
    "doctor",
]


# What typer raises for wrong options and prints itself: click's ClickException, wherever a version keeps it.
WRONG_USE: type[Exception] = typer.BadParameter.__mro__[2]


class Commands(TyperGroup):
    """Users' mistakes end in one line on stderr and exit code 2, an interruption in 130; neither in a traceback."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command that the user chose."""
        atomic.written.clear()
        with warnings.catch_warnings():
            warnings.showwarning = show_warning
            try:
                return super().invoke(ctx)
            except BrokenPipeError:  # whoever reads has seen enough, as `head`
                discard_output()
                raise typer.Exit(0) from None
            except BinghamError as error:
                say_error(str(error))
                raise typer.Exit(2) from None
            except (KeyboardInterrupt, Terminated) as end:
                number = getattr(end, "number", 2)
                say_error(f"{'interrupted' if number == 2 else 'terminated'}; {_written()}")
                raise typer.Exit(128 + number) from None
            except WRONG_USE as error:
                suggest(error)
                raise
            except (typer.Exit, typer.Abort, OSError):
                raise
            except MemoryError:
                say_error("not enough memory; give smaller recordings, or close other programs")
                raise typer.Exit(2) from None
            except Exception as error:
                say_error(unexpected(error))
                raise typer.Exit(2) from None


def show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """Print a warning as one line, without the source line that raised it."""
    say_error(f"warning: {message}")


def _written() -> str:
    """What an interruption leaves behind."""
    if not atomic.written:
        return "nothing written"
    return f"{len(atomic.written)} files are written, the last is {atomic.written[-1]}"


app = typer.Typer(
    name="bingham",
    cls=Commands,
    help="Uncertainty on axes and 3-D orientations: track recordings, fit axes, simulate sensors.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def version(show: bool) -> None:
    """Print the version and stop."""
    if show:
        say(f"bingham {__version__}")
        raise typer.Exit


@app.callback()
def common(
    show: bool = typer.Option(False, "--version", callback=version, is_eager=True, help="Show the version and exit."),
) -> None:
    """Options before the command."""


for command in COMMANDS:
    import_module(f"bingham.cli.{command}").register(app)
# That a path cannot be read is said by what reads it, in a line of its own.
for registered in app.registered_commands:
    for parameter in inspect.signature(registered.callback or common).parameters.values():
        if hasattr(parameter.default, "readable"):
            parameter.default.readable = False


def main() -> None:
    """Run the command line; what happens to standard output is told apart from what happens to files."""
    if closed := open_streams():
        say_error(f"{closed}: closed; redirect it, > /dev/null discards what is printed")
        raise SystemExit(2)
    code: Any = 0
    try:
        with ending_in_order():
            try:
                app(prog_name="bingham")
            except SystemExit as end:
                code = end.code
        sys.stdout.flush()
    except BrokenPipeError:  # whoever reads has seen enough, as `head`
        discard_output()
    except OSError as error:
        discard_output()
        hint = "check permissions" if isinstance(error, PermissionError) else "check the disk or the pipe behind it"
        say_error(f"{error.filename or 'standard output'}: {error.strerror}; {hint}")
        code = 2
    raise SystemExit(code)

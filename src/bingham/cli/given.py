"""Which options a user gave: one that would do nothing is a mistake and not to be passed over."""

from __future__ import annotations

import typer

from bingham.errors import InvalidArgumentError

__all__ = ["given_options", "reject_options"]


def given_options(context: typer.Context) -> dict[str, str]:
    """Return the parameters that stand on the command line, name → option as users write it."""
    return {
        parameter.name: max(parameter.opts, key=len)
        for parameter in context.command.params
        if parameter.name and getattr(context.get_parameter_source(parameter.name), "name", "") == "COMMANDLINE"
    }


def reject_options(given: dict[str, str], names: tuple[str, ...], needs: str, got: str) -> None:
    """Raise an error if one of the named options was given: it needs something else than it got."""
    for name in names:
        if name in given:
            raise InvalidArgumentError(given[name], needs, got, "leave the option out")

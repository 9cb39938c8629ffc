"""Errors and warnings of the library in the words of the command line."""

from __future__ import annotations

import shlex
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from typing import Any

from bingham.errors import BinghamError, Setting, words

__all__ = ["AXES", "in_options", "worded"]

# Arguments of reading axes and clustering them → options.
MIXTURE = {"min_points": "--min-points", "max_concentration": "--max-concentration"}
AXES = {"columns": "--columns", "angles": "--as", **MIXTURE}


@contextmanager
def in_options(options: Mapping[str, str]) -> Generator[None]:
    """Let errors of the block speak of options, as "--unit time=ms"; `options` gives that of each argument."""
    try:
        yield
    except BinghamError as error:
        raise worded(error, options) from None


def worded(said: Any, options: Mapping[str, str]) -> Any:
    """Return an error or a warning with options in the place of arguments; `options` as for `in_options`."""

    def spelled(setting: Setting) -> str:
        return _option(options.get(setting.argument, setting.argument), setting.value)

    if isinstance(said, BinghamError):
        said.argument = options.get(said.argument, said.argument)
        said.expected, said.hint = words(said.expected, spelled), words(said.hint, spelled)
    else:
        said.args = tuple(spelled(part) if isinstance(part, Setting) else part for part in said.args)
    return said


def _option(option: str, value: Any) -> str:
    """Return a setting as a user writes it: an option for each pair of a mapping, its plural for a list."""
    if isinstance(value, dict):
        return " ".join(f"{option} {shlex.quote(f'{name}={of}')}" for name, of in value.items())
    if isinstance(value, list):
        return f"{option.removesuffix('s')}s {','.join(value)}"
    if value is None or value is True:
        return option
    return (option.removesuffix("TOPIC") if option.endswith("TOPIC") else f"{option} ") + shlex.quote(str(value))

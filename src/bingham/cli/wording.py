"""Errors of the library in the words of the command line."""

from __future__ import annotations

import re
from collections.abc import Generator, Mapping
from contextlib import contextmanager

from bingham.errors import BinghamError

__all__ = ["in_options", "worded"]


@contextmanager
def in_options(names: Mapping[str, str]) -> Generator[None]:
    """Let errors of the block speak of options, "--columns", where the library has arguments, "columns=".

    Parameters
    ----------
    names : mapping of str to str
        Argument → option, with what follows it.
    """
    try:
        yield
    except BinghamError as error:
        said = worded(str(error), names)
        if said == str(error):
            raise
        raise BinghamError(said) from None


def worded(text: str, names: Mapping[str, str]) -> str:
    """Return a message with options in the place of arguments; `names` as for `in_options`."""
    for argument, option in names.items():
        text = re.sub(rf"^{argument}: ", f"{option}: ", text)
        text = re.sub(rf"\b{argument}={{'(\w+)': \.\.\.}}", rf"{option} \1=NAME", text)
        text = re.sub(rf"\b{argument}={{'(\w+)': '(\w+)'}}", rf"{option} \1=\2", text)
        text = re.sub(rf"\b{argument}=\[([^]]*)\]", lambda m, option=option: f"{option}s {_list(m[1])}", text)
        text = re.sub(rf"\b{argument}=True", option, text)
        text = re.sub(rf"\b{argument}={{([^}}]*)}}", lambda m, option=option: _pairs(option, m[1]), text)
        text = re.sub(rf"\b{argument}=(?=[\w'])", f"{option} ", text)
        text = re.sub(rf"\b{argument}=", option, text)
        if "_" in argument:  # no word of a sentence
            text = re.sub(rf"(?<![\w/.-]){argument}(?![\w/.-])", option, text)
    return text


def _list(inside: str) -> str:
    """Return what stands in a list as names between commas."""
    return inside.replace(" ", "").replace("'", "")


def _pairs(option: str, inside: str) -> str:
    """Return what stands in a mapping as an option for each pair."""
    pairs = re.findall(r"'(\w+)': (?:'([^']*)'|\.\.\.)", inside)
    quoted = [(name, f'"{value}"' if re.search(r"[\s()]", value) else value or "NAME") for name, value in pairs]
    return " ".join(f"{option} {name}={value}" for name, value in quoted) or option

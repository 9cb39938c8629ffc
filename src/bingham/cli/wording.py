"""Errors of the library in the words of the command line."""

from __future__ import annotations

import re
from collections.abc import Generator, Mapping
from contextlib import contextmanager

from bingham.errors import BinghamError

__all__ = ["in_options"]


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
        text = said = str(error)
        for argument, option in names.items():
            said = re.sub(rf"^{argument}: ", f"{option}: ", said)
            said = re.sub(rf"\b{argument}={{'(\w+)': \.\.\.}}", rf"{option} \1=NAME", said)
            said = re.sub(rf"\b{argument}={{'(\w+)': '(\w+)'}}", rf"{option} \1=\2", said)
            said = re.sub(rf"\b{argument}=", option, said)
        if said == text:
            raise
        raise BinghamError(said) from None

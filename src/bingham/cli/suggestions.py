"""Which options a user may have meant by one that there is not."""

from __future__ import annotations

import re
from collections.abc import Mapping
from difflib import SequenceMatcher
from typing import Any

__all__ = ["like", "suggest"]

# Share of letters in common from which a name is a misspelling of another, letters of a word that says something, and
# how many names are worth reading.
CLOSE = 0.8
SHORTEST = 3
MOST = 3


def like(wrong: str, names: Mapping[str, str]) -> list[str]:
    """Return up to three names that are close to a wrong one; if none is, those that share a word or its beginning.

    Parameters
    ----------
    wrong : str
        What the user wrote.
    names : mapping of str to str
        Names there are → what else they are called.

    Examples
    --------
    >>> like("--mesurement-noise", {"--measurement-noise": "", "--process-noise": "", "--no-csv": ""})
    ['--measurement-noise']
    >>> like("--noise", {"--measurement-noise": "", "--process-noise": "", "--no-csv": ""})
    ['--process-noise', '--measurement-noise']
    >>> like("--zzz", {"--npz": ""})
    []
    """
    wanted = _words(wrong)
    closeness = {name: SequenceMatcher(None, wrong.strip("-"), name.strip("-")).ratio() for name in names}
    ordered = sorted(names, key=lambda name: -closeness[name])
    close = [name for name in ordered if closeness[name] >= CLOSE]
    return (close or [name for name in ordered if _share(wanted, _words(name) | _words(names[name]))])[:MOST]


def suggest(error: Any) -> None:
    """Let an error about an option that does not exist name those that are like it; other errors stay as they are."""
    command = getattr(getattr(error, "ctx", None), "command", None)
    if command is None or not hasattr(error, "possibilities") or not str(error.option_name).startswith("--"):
        return
    names = {
        option: parameter.name or ""
        for parameter in command.params
        for option in [*parameter.opts, *parameter.secondary_opts]
        if option.startswith("--")
    }
    error.possibilities = like(error.option_name, names)


def _words(name: str) -> set[str]:
    return {word for word in re.split(r"[-_]", name.lower()) if len(word) >= SHORTEST}


def _share(some: set[str], others: set[str]) -> bool:
    """Whether a word of the ones is, or begins, one of the others, or the other way round."""
    return any(a.startswith(b) or b.startswith(a) for a in some for b in others)

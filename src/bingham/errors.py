"""Exceptions of the package: argument, expected, got, hint and place are attributes, the text is made of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

__all__ = [
    "AccuracyWarning",
    "BinghamError",
    "ConvergenceError",
    "InvalidArgumentError",
    "MissingExtraError",
    "RecordingError",
    "RecordingWarning",
    "RepairWarning",
    "Setting",
]

# Characters of a value in a message, of a text there (it may hold a path), of a part of a
# message about a file, and numbers of an array.
LONGEST, LONGEST_TEXT, LONGEST_LINE, FIRST = 100, 400, 600, 4


class AccuracyWarning(UserWarning):
    """A result may be less accurate than the documentation promises elsewhere."""


@dataclass(frozen=True)
class Setting:
    """An argument that a message names, and its value if not None: ``units={'time': 'ms'}``, or an option's."""

    argument: str
    value: Any = None

    def __str__(self) -> str:
        return f"{self.argument}={'' if self.value is None else repr(self.value)}"


Words = str | Sequence[str | Setting]


def words(said: Words, spelled: Callable[[Setting], str] = str) -> str:
    """Return a text of its parts, each setting as `spelled`."""
    return said if isinstance(said, str) else "".join(p if isinstance(p, str) else spelled(p) for p in said)


class RecordingWarning(UserWarning):
    """Something in a recording is doubtful, was put right or left out; the message says what and how much.

    Its arguments are the message, or the recording's name and the parts of what is said of it, text and `Setting`.
    """

    def __str__(self) -> str:
        name, *said = self.args or ("",)
        return one_line(f"{name}: {words(said)}") if said else str(name)


class RepairWarning(RecordingWarning):
    """Something in a recording was put right without doubt; the message counts it."""


class BinghamError(Exception):
    """Base class of every exception this package raises on purpose; it can be pickled, for worker processes.

    What an error says is data; its text is made of it, in one place.

    Attributes
    ----------
    argument : str
        Name of the offending argument, option or file; empty where there is none.
    expected : str, or sequence of str and Setting
        What the contract asks for, or what was to be done.
    got : object
        What came instead, as it came.
    hint : str, or sequence of str and Setting
        How to fix the call or the file; arguments that it names are `Setting`.
    place : str
        Line, column, field or row at fault; empty where the whole is.
    """

    argument: str = ""
    expected: Words = ""
    got: Any = None
    hint: Words = ""
    place: str = ""

    def __init__(self, message: str = "", **data: Any) -> None:
        self.message = message
        for name, value in data.items():
            setattr(self, name, value)
        super().__init__(message)

    def __str__(self) -> str:
        what = self.message or f"expected {words(self.expected)}, got {_brief(self.got)}"
        said = ": ".join(part for part in (self.argument, self.place, what) if part)
        return f"{said}; {one_line(words(self.hint))}" if self.hint else said

    def __reduce__(self) -> tuple[Any, ...]:
        # Exception would hand its arguments to the constructors below, which want what the message is made of.
        return _rebuilt, (type(self), self.args), self.__dict__


class InvalidArgumentError(BinghamError, ValueError):
    """An argument does not satisfy its contract; the parameters are the attributes of `BinghamError`."""

    def __init__(self, argument: str, expected: Words, got: Any, hint: Words = "", place: str = "") -> None:
        super().__init__(argument=argument, expected=expected, got=got, hint=hint, place=place)


class ConvergenceError(BinghamError, ArithmeticError):
    """An iteration stopped before its tolerance; `reached` (also `got`) holds the best value so far."""

    def __init__(self, what: str, reached: Any, hint: Words = "") -> None:
        super().__init__(f"{what}; reached {_brief(reached)}", expected="convergence", got=reached, hint=hint)
        self.reached = reached


class RecordingError(BinghamError, ValueError):
    """A recording cannot be read as its format promises.

    Parameters
    ----------
    path : str
        The file; also in ``argument``.
    place : str
        Line, column or field inside the file; empty when the file as a whole is at fault.
    problem : str
        What is wrong there; also in ``got``.
    hint : str, or sequence of str and Setting
        How to fix the file or the call.
    """

    def __init__(self, path: Any, place: str, problem: str, hint: Words = "") -> None:
        place, problem = map(one_line, (place, problem))  # names from files may hold anything
        super().__init__(problem, argument=str(path), place=place, got=problem, hint=hint)
        self.path, self.problem = str(path), problem


class MissingExtraError(BinghamError, ImportError):
    """An optional dependency is absent; the message names the extra that brings it."""

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        message = f"{purpose} needs the package '{package}', which is not installed"
        super().__init__(message, expected=package, hint=f"install it with: pip install 'bingham[{extra}]'")
        self.package, self.extra = package, extra


def _brief(value: Any) -> str:
    """Return a value as one line of bounded length; of arrays the shape and the first numbers."""
    text = " ".join(str(value).split())
    shape, ravel = getattr(value, "shape", ()), getattr(value, "ravel", None)
    if len(text) <= LONGEST or (isinstance(value, str) and len(text) <= LONGEST_TEXT):
        return text
    if isinstance(shape, tuple) and shape and ravel is not None:
        first = ", ".join(f"{x:.6g}" if isinstance(x, float) else str(x) for x in ravel()[:FIRST].tolist())
        return f"shape {shape}: {first}, …"
    if isinstance(value, str):
        return f"{text[:LONGEST_TEXT]}…"
    return f"{text[:LONGEST]}…" if isinstance(value, (list, tuple, dict, int)) else f"a {type(value).__name__}"


def one_line(text: str) -> str:
    """Return a text as one line of bounded length; unchanged if it is one."""
    if len(text) <= LONGEST_LINE and len(text.splitlines()) < 2:
        return text
    text = " ".join(text.split())
    return text if len(text) <= LONGEST_LINE else f"{text[:LONGEST_LINE]}…"


def _rebuilt(kind: type[BinghamError], args: tuple[Any, ...]) -> BinghamError:
    """Return an error with a message but without calling its constructor; for unpickling."""
    error = kind.__new__(kind, *args)
    error.args = args
    return error

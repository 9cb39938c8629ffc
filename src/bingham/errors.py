"""Exceptions of the package; each message names the argument, what was expected, what came and the hint."""

from __future__ import annotations

from typing import Any

__all__ = [
    "AccuracyWarning",
    "BinghamError",
    "ConvergenceError",
    "InvalidArgumentError",
    "MissingExtraError",
    "RecordingError",
    "RecordingWarning",
]

# Characters of a value in a message, of a text there (it may hold a path), and numbers of an array.
LONGEST, LONGEST_TEXT, FIRST = 100, 400, 4


class AccuracyWarning(UserWarning):
    """A result may be less accurate than the documentation promises elsewhere."""


class RecordingWarning(UserWarning):
    """Something in a recording is doubtful, was put right or left out; the message says what and how much."""


class BinghamError(Exception):
    """Base class of every exception this package raises on purpose; it can be pickled, for worker processes."""

    def __reduce__(self) -> tuple[Any, ...]:
        # Exception would hand its message to the constructors below, which want what the message is made of.
        return _rebuilt, (type(self), self.args), self.__dict__


class InvalidArgumentError(BinghamError, ValueError):
    """An argument does not satisfy its contract.

    Parameters
    ----------
    argument : str
        Name of the offending argument.
    expected : str
        What the contract asks for.
    got : object
        What came instead; kept in ``value``, cut short in the message.
    hint : str
        How to fix the call.
    """

    def __init__(self, argument: str, expected: str, got: Any, hint: str = "") -> None:
        self.argument = argument
        self.value = got
        super().__init__(f"{argument}: expected {expected}, got {_brief(got)}" + (f"; {hint}" if hint else ""))


class ConvergenceError(BinghamError, ArithmeticError):
    """An iteration stopped before its tolerance; `reached` holds the best value so far."""

    def __init__(self, what: str, reached: Any, hint: str = "") -> None:
        self.reached = reached
        super().__init__(f"{what}; reached {_brief(reached)}" + (f"; {hint}" if hint else ""))


class RecordingError(BinghamError, ValueError):
    """A recording cannot be read as its format promises.

    Parameters
    ----------
    path : str
        The file.
    place : str
        Line, column or field inside the file; empty when the file as a whole is at fault.
    problem : str
        What is wrong there.
    hint : str
        How to fix the file or the call.
    """

    def __init__(self, path: Any, place: str, problem: str, hint: str = "") -> None:
        self.path = str(path)
        self.place = place
        where = f"{path}: {place}" if place else f"{path}"
        super().__init__(f"{where}: {problem}" + (f"; {hint}" if hint else ""))


class MissingExtraError(BinghamError, ImportError):
    """An optional dependency is absent; the message names the extra that brings it."""

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        super().__init__(
            f"{purpose} needs the package '{package}', which is not installed; "
            f"install it with: pip install 'bingham[{extra}]'"
        )


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


def _rebuilt(kind: type[BinghamError], args: tuple[Any, ...]) -> BinghamError:
    """Return an error with a message but without calling its constructor; for unpickling."""
    error = kind.__new__(kind, *args)
    error.args = args
    return error

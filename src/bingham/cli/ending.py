"""SIGTERM and its like end a command as an interruption does: what is temporary goes, what is complete stays."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager
from queue import SimpleQueue
from types import FrameType
from typing import Any

__all__ = ["Terminated", "ending_in_order"]

SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


class Terminated(BaseException):
    """The process was asked to end, by the signal of this number."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


@contextmanager
def ending_in_order() -> Generator[None]:
    """Raise `KeyboardInterrupt` or `Terminated` in the block at the first such signal; further ones change nothing.

    Python drops exceptions in destructors and callbacks of the garbage collector: a signal that came there comes again.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before: dict[int, Any] = {}
    again: SimpleQueue[int] = SimpleQueue()  # may be used where a signal interrupts it
    over = False

    def end(number: int, frame: FrameType | None) -> None:
        while frame is not None:  # what is raised in the hook is dropped, too
            if frame.f_code is dropped.__code__:
                again.put(number)
                return
            frame = frame.f_back
        for each in before:
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt if number == signal.SIGINT else Terminated(number)

    def dropped(what: sys.UnraisableHookArgs) -> None:
        if not issubclass(what.exc_type, KeyboardInterrupt | Terminated):
            hook(what)
            return
        number = what.exc_value.number if isinstance(what.exc_value, Terminated) else signal.SIGINT
        signal.signal(number, end)
        threading.Thread(target=send, daemon=True).start()
        again.put(number)

    def send() -> None:
        for number in iter(again.get, None):
            time.sleep(0.01)
            if over:
                return
            os.kill(os.getpid(), number)

    for number in SIGNALS:
        if signal.getsignal(number) not in (signal.SIG_IGN, None):
            before[number] = signal.signal(number, end)
    hook, sys.unraisablehook = sys.unraisablehook, dropped
    try:
        yield
    finally:
        over = True
        sys.unraisablehook = hook
        for number, handler in before.items():
            if signal.getsignal(number) != signal.SIG_IGN:  # after the first one the process is about to end
                signal.signal(number, handler)

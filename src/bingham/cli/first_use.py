"""A word to whoever waits for the first compilation of the numerical code."""

from __future__ import annotations

from functools import cache

import typer

__all__ = ["NOTICE", "announce_compilation"]

NOTICE = "bingham: compiling numerical code; it is kept on disk, later runs start at once"


@cache
def announce_compilation() -> None:
    """Say on stderr, once a process, that Numba compiles a kernel because its cache on disk has none yet."""
    from numba.core import event

    class Notice(event.Listener):
        """Speaks at the first compilation; loading from the cache is none."""

        silent = False

        def on_start(self, event: object) -> None:
            if NOTICE and not self.silent:
                self.silent = True
                typer.echo(NOTICE, err=True)

        def on_end(self, event: object) -> None:
            pass

    event.register("numba:compile", Notice())

"""Figures that belong to no window until they are shown: notebooks draw them, `show` opens a window of their own."""

from __future__ import annotations

import sys
from io import BytesIO
from typing import Any, cast

from matplotlib.figure import Figure

__all__ = ["FreeFigure"]


class FreeFigure(Figure):
    """A matplotlib figure outside pyplot: nothing global knows it, and nothing has to close it."""

    def _repr_png_(self) -> bytes:
        file = BytesIO()
        self.savefig(file, format="png", dpi=100)
        return file.getvalue()

    def show(self, warn: bool = True) -> None:
        """Show the figure in the notebook, or in a window; a script waits until that is closed.

        Parameters
        ----------
        warn : bool
            Warn if the backend of matplotlib has no windows.
        """
        ipython = sys.modules.get("IPython")
        shell: Any = None if ipython is None else ipython.get_ipython()
        if shell is not None and getattr(shell, "kernel", None) is not None:
            ipython.display.display(self)  # type: ignore[union-attr]
            return
        if self.canvas.manager is None:
            import matplotlib
            from matplotlib.backends.registry import backend_registry

            backend: Any = backend_registry.load_backend_module(matplotlib.get_backend())
            backend.FigureCanvas.new_manager(self, 1)
        super().show(warn)
        canvas = cast(Any, self.canvas)
        interactive = shell is not None or hasattr(sys, "ps1")
        if canvas.required_interactive_framework is not None and not interactive:
            canvas.manager.start_main_loop()

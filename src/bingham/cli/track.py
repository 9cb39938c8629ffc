"""``bingham track``: recordings in, orientations with uncertainty out."""

from __future__ import annotations

from pathlib import Path

import typer

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command()(track)


def track(
    recordings: list[Path] = typer.Argument(..., metavar="RECORDING...", help="Files or folders of any known format."),
    output: Path = typer.Option(..., "--output", "-o", metavar="FOLDER", help="Where tracks and figures go."),
) -> None:
    """Filter recordings into orientations with uncertainty."""
    from bingham.io import read_recording

    for path in recordings:
        recording = read_recording(path)
        typer.echo(f"{recording.name}: {recording.size} samples, {recording.duration_s:.1f} s")

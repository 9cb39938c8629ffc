"""``bingham reproduce``: run a paper's comparison again and set its figures beside the published ones."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import typer

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command()(reproduce)


def reproduce(
    context: typer.Context,
    study: str = typer.Argument(
        "list", metavar="STUDY", help="Which one; `list` names all of them, with their default numbers of runs."
    ),
    output: Path = typer.Option(
        Path("reproduced"), "--output", "-o", metavar="FOLDER", help="Where results, figures and stored runs go."
    ),
    runs: int | None = typer.Option(
        None, min=1, help="Number of runs; the study's own default, shown by `list`, unless given."
    ),
    seed: int = typer.Option(1, min=0, help="Of the whole study; the same seed gives the same results for any --jobs."),
    jobs: int = typer.Option(1, min=1, help="Processes on this machine."),
    scheduler: str | None = typer.Option(
        None, metavar="ADDRESS", help="Dask scheduler whose workers do the runs, in place of --jobs."
    ),
    recording: Path | None = typer.Option(
        None, metavar="FILE", help="Recorded orientations, for studies that take them."
    ),
    fresh: bool = typer.Option(False, help="Forget stored runs of this study and start again."),
    figures: bool = typer.Option(True, help="Draw figures."),
    all_rows: bool = typer.Option(
        False, "--all-rows", help="Print long tables whole, not only cases and metrics with a published value."
    ),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object instead of the table."),
) -> None:
    """Rerun a published comparison of filters; interrupted, it continues where it stopped."""
    from bingham.cli.first_use import announce_compilation
    from bingham.cli.given import given_options, reject_options
    from bingham.cli.study_table import write_result
    from bingham.cli.wording import in_options
    from bingham.studies import STUDIES, load_study
    from bingham.studies.execute import run_study
    from bingham.studies.store import RunStore

    given = given_options(context)
    if study == "list":
        reject_options(given, tuple(name for name in given if name != "study"), "the name of a study with it", study)
        for name in STUDIES:
            typer.echo(f"{name:18s} {load_study(name).default_runs:5d} runs  {load_study(name).title}")
        return
    with in_options({"study": "STUDY"}):
        chosen = load_study(study)
    if "orientation" not in chosen.options:
        takers = ", ".join(name for name in STUDIES if "orientation" in load_study(name).options)
        reject_options(given, ("recording",), f"a study that takes one ({takers})", study)
    if as_json:
        reject_options(given, ("all_rows",), "a table to print", "--json, which has all rows")
    if scheduler is not None:
        reject_options(given, ("jobs",), "no --scheduler, whose workers do the runs", scheduler)
    _check_folder(output)
    announce_compilation()
    options = {} if recording is None else _recorded(recording)
    stores: list[RunStore] = []

    def open_store(identity: dict[str, Any]) -> RunStore:
        stores.append(RunStore(output / "runs", identity))
        if fresh:
            stores[0].clear()
        return stores[0]

    said = {name: f"--{name}" for name in ("runs", "seed", "jobs", "scheduler", "recording")}
    with in_options(said), _Progress(study) as progress:
        try:
            result = run_study(chosen, runs=runs, seed=seed, jobs=jobs, scheduler=scheduler, store=open_store,
                               progress=progress.update, options=options)  # fmt: skip
        except KeyboardInterrupt:
            progress.stop()
            kept = f"{progress.done} of {progress.total} parts are stored in {stores[0].folder}"
            typer.echo(f"bingham: interrupted; {kept}; the same command continues from there", err=True)
            raise typer.Exit(130) from None
    write_result(result, output, draw_figures=figures, as_json=as_json, all_rows=all_rows)


def _check_folder(output: Path) -> None:
    """Reject, before hours of runs, a place where nothing can be written."""
    from bingham.errors import RecordingError

    # Not `Path.exists`, which raises where a folder above cannot be searched.
    nearest = next(p for p in (output / "runs", output, *output.absolute().parents) if os.path.exists(p))
    if not nearest.is_dir():
        raise RecordingError(nearest, "", "a file, where a folder is to be written", "give another name to --output")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise RecordingError(output, "", "cannot be written", "check permissions, or give another name to --output")


def _recorded(path: Path) -> dict[str, Any]:
    from bingham.errors import RecordingError
    from bingham.io import read_recording
    from bingham.recording import OrientationRecording

    recording = read_recording(path)
    if not isinstance(recording, OrientationRecording):
        raise RecordingError(path, "", "holds inertial samples, where orientations are needed", "give a trajectory")
    return {"name": recording.name, "time": recording.time, "orientation": recording.orientation}


class _Progress:
    """A bar on stderr, where there is a terminal."""

    def __init__(self, title: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        console = Console(stderr=True)
        columns = (TextColumn(title), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        self._bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
        self._task = self._bar.add_task(title, total=None)
        self.done = self.total = 0

    def __enter__(self) -> _Progress:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Leave the terminal as it was."""
        self._bar.stop()

    def update(self, done: int, total: int) -> None:
        """Show how much is done."""
        self.done, self.total = done, total
        self._bar.update(self._task, completed=done, total=total)

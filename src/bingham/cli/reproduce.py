"""``bingham reproduce``: run a paper's comparison again and set its figures beside the published ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from bingham.studies.study import StudyResult

__all__ = ["register"]

# What the names of the metrics do not say themselves.
MEANINGS = {
    "coverage_95": "share of the true values within the filter's 95 % region",
    "kl": "Kullback–Leibler divergence between the approximation and the true law, nat",
    "us_per_step": "microseconds for one step of prediction and update",
    "wins": "number of runs in which the filter has the smaller error",
}


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command()(reproduce)


def reproduce(
    study: str = typer.Argument(..., metavar="STUDY", help="Which one; `bingham reproduce list` names them all."),
    output: Path = typer.Option(
        Path("reproduced"), "--output", "-o", metavar="FOLDER", help="Where results, figures and stored runs go."
    ),
    runs: int | None = typer.Option(None, min=1, help="Number of runs; the published number unless given."),
    seed: int = typer.Option(1, min=0, help="Of the whole study; the same seed gives the same results for any --jobs."),
    jobs: int = typer.Option(1, min=1, help="Processes on this machine."),
    scheduler: str | None = typer.Option(None, metavar="ADDRESS", help="Dask scheduler whose workers do the runs."),
    recording: Path | None = typer.Option(
        None, metavar="FILE", help="Recorded orientations, for studies that take them."
    ),
    fresh: bool = typer.Option(False, help="Forget stored runs of this study and start again."),
    figures: bool = typer.Option(True, help="Draw figures."),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object instead of the table."),
) -> None:
    """Rerun a published comparison of filters; interrupted, it continues where it stopped."""
    from bingham.cli.first_use import announce_compilation
    from bingham.cli.wording import in_options
    from bingham.studies import STUDIES, load_study
    from bingham.studies.execute import run_study
    from bingham.studies.store import RunStore

    if study == "list":
        for name in STUDIES:
            typer.echo(f"{name:18s} {load_study(name).title}")
        return
    with in_options({"study": "STUDY"}):
        chosen = load_study(study)
    announce_compilation()
    options = {} if recording is None else _recorded(recording)
    stores: list[RunStore] = []

    def open_store(identity: dict[str, Any]) -> RunStore:
        stores.append(RunStore(output / "runs", identity))
        if fresh:
            stores[0].clear()
        return stores[0]

    said = {"runs": "--runs", "jobs": "--jobs", "scheduler": "--scheduler", "recording": "--recording"}
    with in_options(said), _Progress(study, quiet=as_json) as progress:
        try:
            result = run_study(chosen, runs=runs, seed=seed, jobs=jobs, scheduler=scheduler, store=open_store,
                               progress=progress.update, options=options)  # fmt: skip
        except KeyboardInterrupt:
            progress.stop()
            kept = f"{progress.done} of {progress.total} parts are stored in {stores[0].folder}"
            typer.echo(f"bingham: interrupted; {kept}; the same command continues from there", err=True)
            raise typer.Exit(130) from None
    _write(result, output, draw_figures=figures, as_json=as_json)


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

    def __init__(self, title: str, *, quiet: bool) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        console = Console(stderr=True)
        columns = (TextColumn(title), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        hidden = quiet or not console.is_terminal
        self._bar = Progress(*columns, console=console, transient=True, disable=hidden)
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


def _write(result: StudyResult, output: Path, *, draw_figures: bool, as_json: bool) -> None:
    from bingham.io.atomic import replaced

    output.mkdir(parents=True, exist_ok=True)
    paths: list[Path] = []
    if draw_figures:
        from bingham.plot.studies import draw

        for name, figure in draw(result).items():
            path = output / f"{result.study}-{name}.png"
            with replaced(path) as temporary:
                figure.savefig(temporary, dpi=150)
            paths.append(path)
    report = result.as_dict() | {"figures": [str(path) for path in paths]}
    with replaced(output / f"{result.study}.json") as temporary:
        temporary.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    with replaced(output / f"{result.study}.csv") as temporary:
        temporary.write_text(_csv(result), encoding="utf-8")
    if as_json:
        typer.echo(json.dumps(report))
        return
    _print_table(result)
    typer.echo(f"table and figures in {output}/")


def _csv(result: StudyResult) -> str:
    import csv
    import io

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["case", "filter", "metric", "value", "stderr", "paper"])
    writer.writerows([r.case, r.filter, r.metric, r.value, r.stderr, r.paper] for r in result.table)
    return text.getvalue()


def _print_table(result: StudyResult) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{result.study}: {result.runs} runs, seed {result.seed}")
    table.add_column("case", overflow="fold", min_width=20)
    for name in ("filter", "metric"):
        table.add_column(name, no_wrap=True)
    for name in ("value", "± s.e.", "paper"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in result.table:
        stderr = "" if row.stderr is None else _number(row.stderr, 2)
        paper = "" if row.paper is None else _number(row.paper, 4)
        table.add_row(row.case, row.filter, row.metric, _number(row.value, 4), stderr, paper)
    console = Console()
    # Lines that wrap badly in a narrow pipe are worse than long ones.
    console.width = console.width if console.is_terminal else 130
    console.print(table)
    for metric in sorted({row.metric for row in result.table} & set(MEANINGS)):
        console.print(f"{metric}: {MEANINGS[metric]}", style="dim", highlight=False)


def _number(x: float, digits: int) -> str:
    """Return x with so many significant digits, or as a whole number where that has more."""
    return f"{x:.0f}" if abs(x) >= 10.0 ** (digits - 1) else f"{x:.{digits}g}"

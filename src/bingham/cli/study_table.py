"""What `bingham reproduce` leaves behind: table and figures in files, and the table on the terminal."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from bingham.studies.study import Row, StudyResult

__all__ = ["shown_rows", "write_result"]

# What the names of the metrics do not say themselves.
MEANINGS = {
    "calibration_ks": "largest distance of the credible levels of the truth from uniform ones, 0 if it is right",
    "coverage_95": "share of the true values within the filter's 95 % region",
    "kl": "Kullback–Leibler divergence between the approximation and the true distribution, nat",
    "nees": "mean normalised estimation error over the degrees of freedom, 1 if it is right",
    "spin_coverage_95": "coverage_95 of the spin",
    "us_per_step": "microseconds for one step of prediction and update",
    "wins": "number of runs in which the filter has the smaller error",
}

# A longer table is not read on a terminal.
MOST_ROWS = 60


def write_result(result: StudyResult, output: Path, *, draw_figures: bool, as_json: bool, all_rows: bool) -> None:
    """Write table and figures into a folder, and print the table or what counts of it, or one JSON object."""
    from bingham.atomic import replaced

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
    rows = result.table if all_rows else shown_rows(result.table, result.headline)
    _print_table(result, rows)
    if len(rows) < len(result.table):
        typer.echo(
            f"{len(rows)} of {len(result.table)} rows, those of cases and metrics with a published value; "
            f"all are in {output / result.study}.csv, --all-rows prints them"
        )
    typer.echo(f"table and figures in {output}/")


def shown_rows(table: Sequence[Row], headline: Sequence[str] = ()) -> list[Row]:
    """Return the rows to print: of a long table those whose case and metric have a published value, and headlines."""
    published = {(row.case, row.metric) for row in table if row.paper is not None}
    if len(table) <= MOST_ROWS or not published:
        return list(table)
    return [row for row in table if (row.case, row.metric) in published or row.metric in headline]


def _csv(result: StudyResult) -> str:
    import csv
    import io

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["case", "filter", "metric", "value", "stderr", "paper"])
    writer.writerows([r.case, r.filter, r.metric, r.value, r.stderr, r.paper] for r in result.table)
    return text.getvalue()


def _print_table(result: StudyResult, rows: Sequence[Row]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{result.study}: {result.runs} runs, seed {result.seed}")
    table.add_column("case", overflow="fold", min_width=20)
    for name in ("filter", "metric"):
        table.add_column(name, no_wrap=True)
    for name in ("value", "± s.e.", "paper"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        stderr = "" if row.stderr is None else _number(row.stderr, 2)
        paper = "" if row.paper is None else _number(row.paper, 4)
        table.add_row(row.case, row.filter, row.metric, _number(row.value, 4), stderr, paper)
    console = Console()
    # Lines that wrap badly in a narrow pipe are worse than long ones.
    console.width = console.width if console.is_terminal else 130
    console.print(table)
    for metric in sorted({row.metric for row in rows} & set(MEANINGS)):
        console.print(f"{metric}: {MEANINGS[metric]}", style="dim", highlight=False)


def _number(x: float, digits: int) -> str:
    """Return x with so many significant digits, or as an integer where that has more."""
    return f"{x:.0f}" if abs(x) >= 10.0 ** (digits - 1) else f"{x:.{digits}g}"

"""Numbers on the studies' pages, from the results files beside them.

``{{STUDY | case | filter | metric | format}}`` gives a value ± its standard error; the format, as ``.3f``, may have a
leading ``%`` for percent. ``{{table STUDY | case | filter, … | metric format, …}}`` gives filters by metrics, and
``{{rows STUDY | case | what a row is | metric; format; heading | …}}`` all filters of a case, those whose first metric
is there.
"""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path

RESULTS = Path(__file__).parent / "studies" / "results"
PLACE = re.compile(r"\{\{(table |rows )?([a-z0-9-]+) \| (.*?)\}\}", re.DOTALL)


@cache
def rows_of(study: str) -> dict[tuple[str, str, str], dict]:
    """Return the rows of a study's results file by case, filter and metric."""
    table = json.loads((RESULTS / f"{study}.json").read_text(encoding="utf-8"))["table"]
    return {(row["case"], row["filter"], row["metric"]): row for row in table}


def shown(row: dict, form: str) -> str:
    """Return value ± standard error."""
    scale, form = (100.0, form[1:]) if form.startswith("%") else (1.0, form)
    text = f"{scale * row['value']:{form}}".replace("-", "−")
    return text if row["stderr"] is None else f"{text} ± {scale * row['stderr']:{form}}"


def all_rows(rows: dict[tuple[str, str, str], dict], case: str, what: str, *columns: str) -> str:
    """Return a table of all filters of a case."""
    wanted = [[part.strip() for part in column.split(";")] for column in columns]
    names = [name for (c, name, metric) in rows if c == case and metric == wanted[0][0]]
    if not names:
        raise KeyError((case, wanted[0][0]))
    lines = [".. list-table::", "   :header-rows: 1", "", f"   * - {what}", *(f"     - {w[2]}" for w in wanted)]
    for name in names:
        cells = (rows.get((case, name, metric)) for metric, _, _ in wanted)
        lines += [f"   * - {name.replace(';', ',')}"]
        lines += [f"     - {'' if row is None else shown(row, w[1])}" for row, w in zip(cells, wanted, strict=True)]
    return "\n".join(lines)


def fill_results(text: str) -> str:
    """Return a page with its places filled; a place without a row is an error."""

    def filled(match: re.Match[str]) -> str:
        rows = rows_of(match[2])
        parts = [part.strip() for part in match[3].split("|")]
        if not match[1]:
            case, name, metric, form = parts
            return shown(rows[case, name, metric], form)
        if match[1] == "rows ":
            return all_rows(rows, *parts)
        case, names, columns = parts
        metrics = [column.split() for column in columns.split(",")]
        lines = [".. list-table::", "   :header-rows: 1", "", "   * - filter"]
        lines += [
            f"     - {metric.replace('_', ' ')}{', %' if form.startswith('%') else ''}" for metric, form in metrics
        ]
        for name in (name.strip() for name in names.split(",")):
            lines.append(f"   * - {name}")
            cells = (rows.get((case, name, metric)) for metric, _ in metrics)
            lines += [
                f"     - {'' if row is None else shown(row, f)}" for row, (_, f) in zip(cells, metrics, strict=True)
            ]
        return "\n".join(lines)

    return PLACE.sub(filled, text)

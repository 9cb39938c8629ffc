"""Parts of pages that the program itself tells: commands and their options, studies' results."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parent / "studies" / "results"


def tables() -> dict[str, str]:
    """Return what readers know, as tables: formats, loggers, angles, columns of text files."""
    from bingham.io.angles import ANGLES
    from bingham.io.columns import COLUMNS
    from bingham.io.formats import FORMATS
    from bingham.io.presets import PRESETS
    from bingham.io.units import UNITS

    def code(words: Any) -> str:
        return " ".join(f"``{word}``" for word in words)

    formats = [(f.title, f.expects, ", ".join(f"`bingham.io.{n}`" for n in f.functions)) for f in FORMATS.values()]
    return {
        "formats": _table(("format", "what is expected", "functions"), (16, 54, 30), formats),
        "loggers": _table(("name", "files"), (24, 76), [(f"``{p.name}``", p.title) for p in PRESETS]),
        "angles": _table(
            ("``--as``", "columns", "what it is"),
            (24, 30, 46),
            [(f"``{k.name}``", code(k.columns), k.title) for k in ANGLES.values()],
        ),
        "columns": _table(
            ("quantity", "columns", "units, the first unless told"),
            (20, 34, 46),
            [(q, code(c), code(UNITS.get(q, {})) or "none") for q, c in COLUMNS.items()],
        ),
    }


def _table(head: tuple[str, ...], widths: tuple[int, ...], rows: Any) -> str:
    lines = [".. list-table::", "   :header-rows: 1", f"   :widths: {' '.join(map(str, widths))}", ""]
    for row in (head, *rows):
        lines += [f"   {'*' if not k else ' '} - {cell}" for k, cell in enumerate(row)]
    return "\n".join(lines)


def commands() -> str:
    """Return a section for each command of the program: description, arguments and options with their defaults."""
    from typer.main import get_command

    from bingham.cli.main import app

    return "\n".join(_command(name, command) for name, command in get_command(app).commands.items())


def _command(name: str, command: Any) -> str:
    title = f"bingham {name}"
    lines = [f".. _bingham-{name}:", "", title, "-" * len(title), "", f".. program:: {title}", ""]
    lines += [_plain(command.help or ""), ""]
    lines += ["::", "", f"    {title} {_usage(command)}", ""]
    context = command.make_context(name, [], resilient_parsing=True)
    for parameter in command.params:
        if parameter.name in ("help", "install_completion", "show_completion"):
            continue
        lines += [f".. option:: {_signature(parameter, context)}", "", f"    {_about(parameter)}", ""]
    if epilog := re.sub(r"(?m)^\s*Examples:\s*$", "", command.epilog or "").strip():
        lines += ["Examples::", "", *(f"    {line.strip()}" for line in epilog.splitlines() if line.strip()), ""]
    return "\n".join(lines)


def _usage(command: Any) -> str:
    words = [p.metavar or p.name.upper() for p in command.params if p.param_type_name == "argument"]
    return " ".join([*words, "[OPTIONS]"])


def _signature(parameter: Any, context: Any) -> str:
    if parameter.param_type_name == "argument":
        return (parameter.metavar or parameter.name.upper()).rstrip(".")
    if parameter.secondary_opts or parameter.is_flag:
        return ", ".join([*parameter.opts, *parameter.secondary_opts])
    shown = getattr(parameter, "display_type", None) or parameter.make_metavar
    what = parameter.metavar or shown(context)
    return ", ".join(f"{option} {what}" for option in parameter.opts)


def _about(parameter: Any) -> str:
    text = _plain(getattr(parameter, "help", "") or "")
    default = parameter.default
    told = default not in (None, "", False, True, [], ()) and not callable(default) and parameter.name != "output"
    value = getattr(default, "value", default)
    return f"{text} Default: {value}." if told and parameter.param_type_name == "option" else text or "See above."


def _plain(text: str) -> str:
    """Return help as reStructuredText: stars and bars are no marks there."""
    return re.sub(r"([*|\\])", r"\\\1", text.strip().replace("`", "``"))


def study_table(name: str) -> str:
    """Return the stored results of a study, docs/studies/results/NAME.json, as a table."""
    rows = json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))["table"]
    out = [".. list-table::", "   :header-rows: 1", ""]
    head = ("case", "filter", "metric", "value", "± standard error", "published")
    for row in [
        head,
        *([r["case"], r["filter"], r["metric"], *map(_number, (r["value"], r["stderr"], r["paper"]))] for r in rows),
    ]:
        out += [f"   {'*' if k == 0 else ' '} - {cell}" for k, cell in enumerate(row)]
    return "\n".join(out)


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"

"""Many recordings: found in folders and by patterns, tracked in processes or on a cluster, done ones passed over."""

from __future__ import annotations

import csv
import glob
import hashlib
import io
import json
import os
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bingham.errors import BinghamError, RecordingError

if TYPE_CHECKING:
    from bingham.cli.settings import Settings

__all__ = ["SUMMARY", "expanded", "named", "track_many"]

SUMMARY = "summary.csv"
# What bingham writes itself and no folder of recordings means.
OUTPUTS = (".track.csv", ".track.npz", ".track.parquet", ".track.bag", ".track", ".tum.txt", ".png", SUMMARY)
# What loggers of telephones (Sensor Logger, phyphox) put beside the files of the sensors.
OF_TELEPHONES = ("annotation.csv", "metadata.csv", "meta")
# Figures of one run that would differ in the next; they are printed, not kept.
TIMINGS = ("wall_s", "us_per_sample")
# The summary is written this often, s: what a killed process may have to do again.
SAVE_EVERY_S = 1.0


def expanded(arguments: Sequence[str]) -> list[Path]:
    """Return the recordings that files, folders and patterns name, each once.

    Raises
    ------
    RecordingError
        If a folder or pattern names none.
    """
    found: dict[str, Path] = {}
    for text in arguments:
        path = Path(text)
        paths = [path]
        try:
            path.stat()
        except FileNotFoundError:
            pass
        except (OSError, ValueError) as error:
            problem = getattr(error, "strerror", None) or str(error)
            raise RecordingError(path, "", f"cannot be read: {problem}", "check path and permissions") from None
        if not path.exists() and glob.has_magic(text):
            paths = [Path(name) for name in sorted(glob.glob(text, recursive=True))]
            if not paths:
                raise RecordingError(text, "", "no file has such a name", "put the pattern in quotes, check it")
        elif path.is_dir() and not _is_recording(path):
            paths = list(_inside(path))
            if not paths:
                hint = "give a file, or a folder with recordings, of a ROS 2 bag or of an EuRoC sequence"
                raise RecordingError(path, "", "no recording in this folder", hint)
        for each in paths:
            found.setdefault(os.path.realpath(each), each)
    return list(found.values())


def _inside(folder: Path) -> Iterator[Path]:
    from bingham.io.together import is_split

    beside = OF_TELEPHONES if is_split(folder) else ()
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or path.name.endswith(OUTPUTS) or path.name.lower() in beside:
            continue
        if _is_recording(path):
            yield path
        elif path.is_dir():
            yield from _inside(path)


def _is_recording(path: Path) -> bool:
    from bingham.io import detect_format

    try:
        detect_format(path)
    except (BinghamError, OSError):
        return False
    return True


def named(paths: Sequence[Path]) -> dict[str, Path]:
    """Return recordings by name: the file's own, with folders before it where several are called the same."""
    from bingham.cli.reading import name_of

    names = {path: name_of(path) for path in paths}
    for depth in range(1, 1 + max((len(path.absolute().parts) for path in paths), default=0)):
        count = Counter(name.casefold() for name in names.values())
        if len(count) == len(paths):
            break
        for path, name in names.items():
            if count[name.casefold()] > 1:
                above = path.absolute().parts[-1 - depth : -1]
                names[path] = "-".join([*(part.strip("/\\:") for part in above), name_of(path)])
    else:
        names = {path: f"{name}-{k + 1}" for k, (path, name) in enumerate(names.items())}
    return {name: path for path, name in names.items()}


def track_many(
    recordings: Mapping[str, Path],
    output: Path,
    settings: Settings,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    fail_fast: bool = False,
    fresh: bool = False,
    show: Any = lambda *_: None,
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Track recordings, each one's files written as it is finished; return rows, and errors by name.

    Parameters
    ----------
    recordings : mapping
        Name → file.
    output : Path
        Folder for files and summary.
    settings : Settings
        What to do with each.
    jobs, scheduler
        Processes here, or the address of a Dask scheduler.
    fail_fast : bool
        End at the first error, and raise it.
    fresh : bool
        Track what is done already, too.
    show : callable
        Called with how many are done and the name of the last one.
    """
    from bingham.studies.execute import finished_chunks
    from bingham.studies.study import Chunk

    before = {} if fresh else _read_summary(output)
    entries: dict[str, dict[str, Any]] = {name: before[name] for name in recordings if name in before}
    rows: dict[str, dict[str, Any]] = {}
    errors: dict[str, str] = {}
    tasks = [
        Chunk(
            name,
            track_task,
            {"path": path, "name": name, "folder": output, "settings": settings, "before": before.get(name)},
        )
        for name, path in recordings.items()
    ]
    saved = time.monotonic()
    show(0, "")
    try:
        for name, outcome in finished_chunks(tasks, jobs=jobs, scheduler=scheduler):
            if "error" in outcome:
                if fail_fast:
                    raise BinghamError(outcome["error"])
                errors[name] = outcome["error"]
                entries[name] = {"recording": name, "file": str(recordings[name]), "status": outcome["error"]}
            else:
                rows[name] = outcome["row"]
                entries[name] = _entry(outcome["row"], outcome["stamp"])
            show(len(rows) + len(errors), name)
            if time.monotonic() - saved > SAVE_EVERY_S and not fail_fast:
                _write_summary(output, [entries[name] for name in recordings if name in entries])
                saved = time.monotonic()
    finally:
        if entries and not fail_fast:
            _write_summary(output, [entries[name] for name in recordings if name in entries])
    if fail_fast:
        _write_summary(output, [entries[name] for name in recordings if name in entries])
    return [rows[name] for name in recordings if name in rows], {n: errors[n] for n in recordings if n in errors}


def track_task(
    path: Path, name: str, folder: Path, settings: Settings, before: dict[str, Any] | None
) -> dict[str, Any]:
    """Track one recording in whatever process; return its row and stamp, or the error as text."""
    from bingham.cli.terminal import unexpected
    from bingham.cli.tracking import track_one

    try:
        stamp = _stamp(path, settings)
        if before is not None and before["stamp"] == stamp and (row := _done(folder, before["row"])) is not None:
            return {"row": row, "stamp": stamp}
        return {"row": track_one(path, name, folder, settings), "stamp": stamp}
    except BinghamError as error:
        text = str(error)
        return {"error": text if str(path) in text else f"{path}: {text}"}
    except (OSError, MemoryError) as error:
        return {"error": f"{path}: {error.strerror if isinstance(error, OSError) else 'not enough memory'}"}
    except Exception as error:
        return {"error": f"{path}: {unexpected(error)}"}


def _stamp(path: Path, settings: Settings) -> str:
    """Return what decides about the files of a track: version, options and the recording's bytes."""
    from bingham import __version__

    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    beside = settings.reading.get("beside", {})
    digest = hashlib.sha256(repr((__version__, settings._replace(reading=settings.reading | {"beside": {}}))).encode())
    for file in [*files, *beside.get(str(path), [])]:
        with Path(file).open("rb") as content:
            digest.update(hashlib.file_digest(content, "sha256").digest())
    return digest.hexdigest()


def _done(folder: Path, text: str) -> dict[str, Any] | None:
    """Return the row of an earlier run if all its files are there."""
    try:
        row = json.loads(text)
        row["files"] = [str(folder / Path(name).name) for name in row["files"]]
    except (ValueError, KeyError, TypeError):
        return None
    there = all(os.path.exists(name) for name in row["files"])
    return row | {"unchanged": True, "wall_s": 0.0, "us_per_sample": None} if there else None


def _entry(row: dict[str, Any], stamp: str) -> dict[str, Any]:
    """Return a line of the summary: nested figures as ``outer.inner``, and what a later run has to know."""
    flat: dict[str, Any] = {}

    def put(prefix: str, value: Any) -> None:
        if isinstance(value, dict):
            for key, part in value.items():
                put(f"{prefix}.{key}" if prefix else key, part)
        else:
            flat[prefix] = " | ".join(map(str, value)) if isinstance(value, list) else value

    kept = {key: value for key, value in row.items() if key not in (*TIMINGS, "unchanged", "files")}
    put("", kept)
    files = [Path(name).name for name in row["files"]]
    return flat | {"status": "done", "files": " | ".join(files), "stamp": stamp,
                   "row": json.dumps(kept | {"files": files}, ensure_ascii=False)}  # fmt: skip


def _write_summary(output: Path, entries: list[dict[str, Any]]) -> None:
    from bingham.atomic import disk_errors, replaced

    names = list(dict.fromkeys(name for entry in entries for name in entry if name not in ("stamp", "row")))
    text = io.StringIO()
    writer = csv.DictWriter(text, [*names, "stamp", "row"], restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(entries)
    with disk_errors(output):
        output.mkdir(parents=True, exist_ok=True)
    with replaced(output / SUMMARY) as path:
        path.write_text(text.getvalue(), encoding="utf-8", errors="surrogateescape")


def _read_summary(output: Path) -> dict[str, dict[str, Any]]:
    """Return the lines of a summary by recording; of a damaged one, those that can be read."""
    found: dict[str, dict[str, Any]] = {}
    try:
        with (output / SUMMARY).open(encoding="utf-8", errors="surrogateescape", newline="") as file:
            for entry in csv.DictReader(file):
                if entry.get("recording") and entry.get("stamp") and entry.get("row"):
                    found[entry["recording"]] = dict(entry)
    except (OSError, ValueError, csv.Error):
        pass
    return found

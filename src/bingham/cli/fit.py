"""``bingham fit``: the Bingham distribution of a file of axes or quaternions."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from bingham.cli.signs import GEOGRAPHIC, printed
from bingham.errors import InvalidArgumentError, RecordingError, RecordingWarning

if TYPE_CHECKING:
    from bingham.distributions.bingham import Bingham
    from bingham.io import Axes

__all__ = ["describe", "register"]

EXAMPLES = """
Examples:

    bingham fit lineations.csv

    bingham fit poles.csv --columns n,e,d -o fits

    bingham fit orientations.txt --json | jq .concentrations

    bingham fit grains.ang --symmetry 432
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command(epilog=EXAMPLES)(fit)


def fit(
    file: Path = typer.Argument(
        ...,
        metavar="FILE",
        help="Text, one unit vector a row: n e d, x y z, qw qx qy qz, x y or any d; or angles; .ang, .ctf maps.",
        show_default=False,
    ),
    columns: str | None = typer.Option(None, metavar="A,B,...", help="Names of the components in the file, in order."),
    as_angles: str | None = typer.Option(
        None, "--as", metavar="KIND", help="The columns are angles, as strike-dip or bunge: see bingham formats."
    ),
    symmetry: str | None = typer.Option(
        None, metavar="GROUP", help="Crystal symmetry of orientations, as 432 or m-3m; outliers are told apart."
    ),
    output: Path | None = typer.Option(None, "--output", "-o", metavar="FOLDER", help="Draw a figure into it."),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object on standard output."),
) -> None:
    """Fit a Bingham distribution to axes (signs do not matter) or quaternions, by maximum likelihood.

    Prints concentrations and principal axes with standard errors, mode, entropy and the 95 % credible angle; for
    columns n, e, d also what structural geologists report: eigenvalues, Woodcock's and Vollmer's shape, mean axis,
    best-fit plane and fold axis with their confidence regions, and tests.
    """  # fmt: skip
    from bingham.atomic import staged
    from bingham.cli.first_use import announce_compilation
    from bingham.cli.fit_crystal import fit_crystals, is_map, read_map, symmetry_hint
    from bingham.cli.wording import AXES, in_options
    from bingham.io import read_axes

    stated: str | None = None
    if is_map(file):
        if columns is not None or as_angles is not None:
            option = "--columns" if columns is not None else "--as"
            raise InvalidArgumentError(option, "a table, not a map of orientations", str(file), "leave it out")
        axes, stated = read_map(file)
    else:
        with in_options(AXES):
            names = None if columns is None else [name.strip() for name in columns.split(",")]
            axes = read_axes(file, columns=names, angles=as_angles)
    announce_compilation()
    if symmetry is not None:
        if axes.values.shape[1] != 4:
            raise InvalidArgumentError("--symmetry", "orientations, d = 4", f"{file}, d = {axes.values.shape[1]}")
        with in_options({"group": "--symmetry"}):
            crystals = fit_crystals(axes.values, symmetry)
        distribution, extra = crystals.distribution, crystals.row
        axes = axes._replace(values=crystals.members)
    else:
        distribution, extra = _fitted(file, axes.values), {}
    row = describe(axes, distribution) | extra
    if axes.values.shape[1] == 4 and symmetry is None and (hint := symmetry_hint(axes.values, stated)) is not None:
        warnings.warn(f"{file}: {hint}", RecordingWarning, stacklevel=1)
    if output is not None:
        from bingham.plot.axes import plot_fit
        from bingham.plot.stereonet import plot_fabric

        with staged(output) as folder:
            name = f"{axes.name}.fit.png"
            if "fabric" in row:
                figure = plot_fabric(axes.values, title=axes.name)
            else:
                figure = plot_fit(axes.values, distribution, names=axes.columns, title=axes.name)
            figure.savefig(folder / name, dpi=150)
        row["files"] = [str(output / name)]
    if as_json:
        typer.echo(json.dumps(row, indent=2, ensure_ascii=False))
    else:
        print_fit(row)


def _fitted(file: Path, values: Any) -> Bingham:
    from bingham.distributions.bingham import Bingham

    try:
        return Bingham.fit(values)
    except InvalidArgumentError as error:
        size, dim = values.shape
        if size < dim:
            raise RecordingError(file, f"{size} rows", f"too few for dimension {dim}", f"give {dim} or more") from None
        if error.argument != "x":
            raise
        raise RecordingError(
            file,
            f"{size} rows",
            "on a smaller sphere: along some axis they do not scatter at all, and its concentration has no bound",
            f"set one by: bingham cluster {file} --components 1 --no-background --max-concentration Z",
        ) from None


def describe(axes: Axes, distribution: Bingham) -> dict[str, Any]:
    """Return what there is to say about a fit; angles in degrees where the name says so.

    Axes that the data leave open have infinite errors; JSON knows no such number, so they become None.
    """
    import numpy as np

    from bingham.cli.fit_fabric import describe_fabric, opening
    from bingham.inference import confidence_ellipse

    size, dim = axes.values.shape
    errors = distribution.standard_errors(size)
    # A semi-axis of 90° leaves the mode open that way, as a sample of no more axes than dimensions does all around.
    region = confidence_ellipse(axes.values).semi_axes.tolist() if size > dim else [np.pi / 2] * (dim - 1)
    with np.errstate(over="ignore"):
        turns = np.degrees(errors.axes)
    angle = float(np.degrees(distribution.credible_angle(0.95)))
    row: dict[str, Any] = {
        "file": axes.name,
        "columns": list(axes.columns),
        "samples": size,
        "dim": dim,
        "concentrations": distribution.z.tolist(),
        "concentration_errors": errors.concentrations.tolist(),
        "axes": printed(distribution.M.T, axes.columns),
        "axis_errors_deg": [[x if np.isfinite(x) else None for x in line] for line in turns.tolist()],
        "moments": distribution.axis_moments.tolist(),
        "mode": printed(distribution.mode, axes.columns),
        "mode_confidence_95_deg": opening(region),
        "entropy": float(distribution.entropy()),
        "log_likelihood": float(np.sum(distribution.logpdf(axes.values))),
        "credible_angle_95_deg": angle,
    }
    if dim == 4:
        row["credible_rotation_95_deg"] = min(2 * angle, 180.0)
    if axes.angles:
        row |= in_angles(axes.angles, distribution)
    if tuple(name.lower() for name in axes.columns) == GEOGRAPHIC:
        row["mode_trend_plunge_deg"] = trend_plunge(distribution.M[:, 2])
        row["plane_pole_trend_plunge_deg"] = trend_plunge(distribution.M[:, 0])
        if size > dim:
            row["fabric"] = describe_fabric(axes.values)
    return row


def in_angles(kind: str, distribution: Bingham) -> dict[str, Any]:
    """Return mode and principal axes as angles of the kind that the file has."""
    from bingham.io.angles import angle_kind, to_angles

    return {
        "angles": kind,
        "angle_names": list(angle_kind(kind).columns),
        "mode_angles": to_angles(kind, distribution.mode)[0].tolist(),
        "axis_angles": to_angles(kind, distribution.M.T).tolist(),
    }


def trend_plunge(axis: Any) -> list[float]:
    """Return azimuth of an axis (north, east, down) clockwise from north, and dip of its lower end, degrees."""
    import numpy as np

    north, east, down = axis if axis[2] >= 0 else -axis
    return [
        float(np.degrees(np.arctan2(east, north)) % 360),
        float(np.degrees(np.arctan2(down, np.hypot(north, east)))),
    ]


def print_fit(row: dict[str, Any]) -> None:
    """Print a fit for people."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    console.print(f"[bold]{row['file']}[/]: {row['samples']} samples, d = {row['dim']}", highlight=False)
    table = Table(box=None, header_style="bold", pad_edge=False)
    rotations = row["dim"] == 4
    factor = 2.0 if rotations else 1.0  # a step on the sphere of quaternions is half the rotation
    error = "± to the mode\n(rotation)" if rotations else "± to the mode"
    for heading in ("concentration", "± s.e.", "share", f"axis ({' '.join(row['columns'])})", error):
        table.add_column(heading, justify="right")
    turns = [line[-1] for line in row["axis_errors_deg"]]
    lines = zip(row["concentrations"], row["concentration_errors"], row["moments"], row["axes"], turns, strict=True)
    for k, (z, error, share, axis, turn) in enumerate(lines):
        last = k == row["dim"] - 1
        table.add_row(
            f"{z:.5g}",
            "" if last else f"{error:.2g}",
            f"{share:.4f}" if share >= 1e-3 else f"{share:.2g}",
            "  ".join(f"{x:+.4f}" for x in axis),
            "mode" if last else _degrees(turn, factor),
        )
    console.print(table, highlight=False)
    rotation = f" (rotation by {row['credible_rotation_95_deg']:.2f}°)" if rotations else ""
    confidence = " × ".join(_degrees(x, factor) for x in row["mode_confidence_95_deg"])
    for name, value in (
        ("95 % of axes within", f"{row['credible_angle_95_deg']:.2f}°{rotation} of the mode"),
        ("95 % confidence of the mode", f"rotation by {confidence}" if rotations else confidence),
        ("entropy", f"{row['entropy']:.4f} nat"),
        ("log-likelihood", f"{row['log_likelihood']:.2f}"),
    ):
        console.print(f"{name:<28}{value}", highlight=False)
    if "angles" in row:
        said = ", ".join(f"{x} {v:.2f}" for x, v in zip(row["angle_names"], row["mode_angles"], strict=True))
        console.print(f"{'mode':<28}{said}", highlight=False)
    if "fabric" in row:
        from bingham.cli.fit_fabric import fabric_lines

        for name, text in fabric_lines(row["fabric"]):
            console.print(f"{name:<28}{text}", highlight=False)
    if "symmetry" in row:
        said = f"{row['symmetry']}, {row['outliers']} points are outliers, {100 * row['outlier_share']:.1f} %"
        console.print(f"{'symmetry':<28}{said}", highlight=False)
    for name, key in (("mode", "mode_trend_plunge_deg"), ("pole of the best plane", "plane_pole_trend_plunge_deg")):
        if key in row and "fabric" not in row:
            trend, plunge = row[key]
            console.print(f"{name:<28}trend {trend:05.1f}°, plunge {plunge:.1f}°", highlight=False)
    for name in row.get("files", []):
        console.print(f"{'figure':<28}{name}", highlight=False)


def _degrees(value: float | None, factor: float) -> str:
    """Return an error of an axis, times a factor; one that reaches all around says nothing of where it points."""
    return "open" if value is None or value >= 90.0 else f"{factor * value:.2f}°"

"""``bingham cluster``: the Bingham mixture of a file of axes or quaternions."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from bingham.cli.signs import printed
from bingham.errors import ConvergenceError, InvalidArgumentError, RecordingError

if TYPE_CHECKING:
    from bingham.distributions.mixture import BinghamMixture
    from bingham.io import Axes

__all__ = ["describe", "register"]

EXAMPLES = """
Examples:

    bingham cluster poles.csv

    bingham cluster normals.csv --components 1-6 -o clusters

    bingham cluster turns.csv --components 3 --json | jq .components[].mode
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command(epilog=EXAMPLES)(cluster)


def cluster(
    file: Path = typer.Argument(
        ...,
        metavar="FILE",
        help="Text, one unit vector a row: n e d, x y z, qw qx qy qz, x y or any d.",
        show_default=False,
    ),
    components: str = typer.Option("1-8", metavar="K or A-B", help="Number of clusters, or a range to choose from."),
    method: str = typer.Option("em", help="em: maximum likelihood; sac: sample consensus, faster and rougher."),
    background: bool = typer.Option(True, help="Allow for outliers by a uniform component."),
    min_points: int | None = typer.Option(None, min=1, help="Minimum number of points of a cluster."),
    min_density: float | None = typer.Option(
        None, help="sac: density of a point that belongs to a cluster; the uniform one unless given."
    ),
    signed: bool = typer.Option(
        False, "--signed", help="Signs matter, as of surface normals: a cluster is split into its two sides."
    ),
    max_concentration: float = typer.Option(1e6, help="Ceiling of the concentrations; lower it for rounded data."),
    restarts: int = typer.Option(10, min=1, help="Random starts for each number of clusters."),
    seed: int = typer.Option(0, min=0, help="The same seed gives the same clusters."),
    columns: str | None = typer.Option(None, metavar="A,B,...", help="Names of the components in the file, in order."),
    as_angles: str | None = typer.Option(
        None, "--as", metavar="KIND", help="The columns are angles, as strike-dip or bunge: see bingham formats."
    ),
    output: Path | None = typer.Option(None, "--output", "-o", metavar="FOLDER", help="Figure and labels go there."),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object on standard output."),
) -> None:
    """Group axes (signs do not matter) or quaternions into a mixture of Bingham distributions.

    The number of clusters is the one with the lowest BIC. Prints weight, concentrations and mode of each cluster.
    """  # fmt: skip
    from bingham.atomic import staged
    from bingham.cli.first_use import announce_compilation
    from bingham.cli.wording import AXES, in_options, worded
    from bingham.distributions.mixture import BinghamMixture
    from bingham.io import read_axes

    if method not in ("em", "sac"):
        raise InvalidArgumentError("--method", "em or sac", method)
    if min_density is not None and (method != "sac" or not 0.0 < min_density < float("inf")):
        raise InvalidArgumentError("--min-density", "a density > 0, with --method sac", min_density)
    sizes = _sizes(components)
    with in_options(AXES):
        axes = read_axes(
            file, columns=None if columns is None else [name.strip() for name in columns.split(",")], angles=as_angles
        )
    minimum = axes.values.shape[1] * (axes.values.shape[1] + 1) // 2 if min_points is None else min_points
    if minimum > len(axes.values):
        raise InvalidArgumentError("--min-points", f"at most {len(axes.values)}, the number of rows", minimum)
    if method == "em" and sizes[0] * minimum > len(axes.values):
        got = f"{sizes[0]} clusters of at least {minimum} points (--min-points) for {len(axes.values)} rows"
        raise InvalidArgumentError("--components", f"at most {len(axes.values) // minimum}", got)
    announce_compilation()
    tried: list[dict[str, Any]] = []
    with _Progress(len(sizes), quiet=as_json) as bar:

        def done(size: int, fitted: BinghamMixture | None) -> None:
            tried.append({"components": size, "bic": None if fitted is None else fitted.bic(axes.values)})
            bar.advance()

        try:
            mixture = BinghamMixture.fit(axes.values, sizes, method=method, background=background, restarts=restarts,
                                         max_concentration=max_concentration, min_points=min_points,
                                         min_density=min_density, rng=seed, progress=done)  # fmt: skip
        except (InvalidArgumentError, ConvergenceError) as error:
            raise RecordingError(file, f"{len(axes.values)} rows", str(worded(error, AXES))) from None
    label = mixture.predict(axes.values)
    row: dict[str, Any] = describe(axes, mixture, label) | {"method": method, "tried": tried, "signed": signed}
    if signed:
        row["components"], label = _sides(axes, mixture, row["components"], minimum)
        row["outliers"] = int((label < 0).sum())
    if output is not None:
        row["files"] = [str(output / name) for name in (f"{axes.name}.clusters.csv", f"{axes.name}.clusters.png")]
        with staged(output) as folder:
            text = "cluster\n" + "".join(f"{k + 1 if k >= 0 else 0}\n" for k in label)
            (folder / f"{axes.name}.clusters.csv").write_text(text, encoding="utf-8")
            if mixture.dim <= 4:
                from bingham.plot.mixture import plot_mixture

                figure = plot_mixture(axes.values, mixture, names=axes.columns, title=axes.name)
                figure.savefig(folder / f"{axes.name}.clusters.png", dpi=150)
            else:
                row["files"] = row["files"][:1]
    if as_json:
        typer.echo(json.dumps(row, indent=2, ensure_ascii=False))
    else:
        _print(row)


def _sizes(text: str) -> list[int]:
    first, dash, last = text.partition("-")
    if not first.strip().isdecimal() or (dash and not last.strip().isdecimal()):
        raise InvalidArgumentError("--components", "a number such as 3 or a range such as 1-8", repr(text))
    low, high = int(first), int(last) if dash else int(first)
    if not 1 <= low <= high:
        raise InvalidArgumentError("--components", "at least 1, the smaller number first", repr(text))
    return list(range(low, high + 1))


def _sides(
    axes: Axes, mixture: BinghamMixture, components: list[dict[str, Any]], minimum: int
) -> tuple[list[dict[str, Any]], Any]:
    """Return the clusters with the sides of their axes apart, heaviest first, and the labels (n,).

    A Bingham distribution on the half around a signed mode is twice as dense: two halves never overlap, so counting
    sides is their maximum-likelihood fit. Sides of fewer than ``minimum`` points are outliers.
    """
    import numpy as np

    owner = mixture.predict(axes.values)
    behind = np.sum(axes.values * mixture.components.mode[owner], axis=1) < 0.0
    found: list[tuple[int, Any, dict[str, Any]]] = []
    for k, component in enumerate(components):
        for side in (False, True):
            members = (owner == k) & (behind == side)
            count = int(members.sum())
            if count >= minimum:
                mode = (-1.0 if side else 1.0) * mixture.components.mode[k]
                weight = component["weight"] * count / max(component["count"], 1)
                found.append((count, members, component | {"weight": weight, "count": count, "mode": mode.tolist()}))
    found.sort(key=lambda part: -part[0])
    label = np.full(len(owner), -1)
    for index, (_, members, _) in enumerate(found):
        label[members] = index
    return [component for _, _, component in found], label


def describe(axes: Axes, mixture: BinghamMixture, label: Any) -> dict[str, Any]:
    """Return what there is to say about a mixture; the heaviest cluster first would break the labels, so as fitted."""
    import numpy as np

    distributions = mixture.components
    angles = np.degrees(distributions.credible_angle(0.95))
    return {
        "file": axes.name,
        "columns": list(axes.columns),
        "samples": len(axes.values),
        "dim": mixture.dim,
        "components": [
            {
                "weight": float(mixture.weights[k]),
                "count": int(np.sum(label == k)),
                "concentrations": distributions.z[k].tolist(),
                "axes": printed(distributions.M[k].T, axes.columns),
                "mode": printed(distributions.mode[k], axes.columns),
                "credible_angle_95_deg": float(angles[k]),
            }
            | ({"credible_rotation_95_deg": min(2.0 * float(angles[k]), 180.0)} if mixture.dim == 4 else {})
            for k in range(mixture.size)
        ],
        "background": mixture.background,
        "outliers": int(np.sum(label < 0)),
        "log_likelihood": float(np.sum(mixture.logpdf(axes.values))),
        "bic": mixture.bic(axes.values),
        "aic": mixture.aic(axes.values),
    }


def _print(row: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console()
    console.width = max(console.width, 200)  # a row too long for a terminal reads better broken there than by cells
    rotations = row["dim"] == 4
    console.print(f"[bold]{row['file']}[/]: {row['samples']} samples, d = {row['dim']}", highlight=False)
    table = Table(box=None, header_style="bold", pad_edge=False)
    mode_of = f"mode ({' '.join(row['columns'])})"
    for heading in ("no.", "weight", "points", "concentrations", mode_of, "95 %\nwithin"):
        table.add_column(heading, justify="right", vertical="bottom")
    for k, part in enumerate(row["components"], 1):
        spectrum = " ".join(f"{z:.0f}" if z < -100.0 else f"{z:.3g}" for z in part["concentrations"][:-1])
        mode = " ".join(f"{x:+.3f}" for x in part["mode"])
        angle = f"{part['credible_rotation_95_deg' if rotations else 'credible_angle_95_deg']:.1f}°"
        table.add_row(str(k), f"{part['weight']:.3f}", str(part["count"]), spectrum, mode, angle)
    if row["background"] > 0.0:
        table.add_row("0", f"{row['background']:.3f}", str(row["outliers"]), "outliers", "", "")
    console.print(table, highlight=False)
    if rotations:
        console.print("95 % within: angle of the rotation from the mode to the sample", style="dim", highlight=False)
    for name, key in (("log-likelihood", "log_likelihood"), ("BIC", "bic"), ("AIC", "aic")):
        console.print(f"{name:<16}{row[key]:.2f}", highlight=False)
    sizes = [trial["components"] for trial in row.get("tried", [])]
    if len(sizes) > 1 and len(row["components"]) == max(sizes):
        most = max(sizes)
        console.print(f"{most} clusters, the largest number tried, suit best; try more: --components {most}-{2 * most}",
                      highlight=False)  # fmt: skip
    for name in row.get("files", []):
        console.print(f"{'file':<16}{name}", highlight=False)


class _Progress:
    """A bar on stderr, where there is a terminal: one step a number of clusters."""

    def __init__(self, total: int, *, quiet: bool) -> None:
        from rich.console import Console
        from rich.progress import Progress

        console = Console(stderr=True)
        self._bar = Progress(console=console, transient=True, disable=quiet or not console.is_terminal)
        self._task = self._bar.add_task("numbers of clusters", total=total)

    def __enter__(self) -> _Progress:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def advance(self) -> None:
        """One more number of clusters is done."""
        self._bar.advance(self._task)

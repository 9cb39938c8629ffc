"""Plane directions laid over the scene that they were found in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.plot.mixture import COMPONENT_COLOURS
from bingham.plot.style import new_figure
from bingham.surfaces.segmentation import PlaneDirections

__all__ = ["plot_segmentation"]


def plot_segmentation(
    depth: ArrayLike, label: NDArray[np.int64], found: PlaneDirections, *, wrong: NDArray[np.bool_] | None = None
) -> Any:
    """Draw a depth image (H, W) in m, 0 or NaN = no data, with the label (H, W) of every pixel's direction in colour.

    `wrong` (H, W) marks pixels whose label is known to be wrong, in a third panel.
    """
    image = np.array(depth, dtype=np.float64)
    image[~(image > 0.0)] = np.nan
    figure = new_figure(4.6 * (2 if wrong is None else 3), 4.4)
    panels = figure.subplots(1, 2 if wrong is None else 3)
    shown = panels[0].imshow(image, cmap="cividis")
    figure.colorbar(shown, ax=panels[0], label="depth [m]", shrink=0.6)
    panels[0].set_title("depth", fontsize=10)
    near, far = np.nanpercentile(image, [2.0, 98.0])
    shade = 1.0 - 0.55 * np.clip((np.nan_to_num(image, nan=far) - near) / (far - near), 0.0, 1.0)
    palette = np.array([[int(c[i : i + 2], 16) / 255.0 for i in (1, 3, 5)] for c in COMPONENT_COLOURS])
    overlay = np.where((label >= 0)[..., None], palette[label % len(palette)], 0.25) * shade[..., None]
    overlay[np.isnan(image)] = 1.0
    panels[1].imshow(overlay)
    for k, direction in enumerate(found.directions):
        name = "(" + ", ".join(f"{c:+.2f}" for c in direction) + f")  {found.weights[k]:.0%}"
        panels[1].plot([], [], "s", color=palette[k % len(palette)], label=name)
    panels[1].set_title("directions of planes (camera frame) and their shares", fontsize=10)
    figure.legend(loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    if wrong is not None:
        panels[2].imshow(np.where(np.isnan(image), 0.5, 1.0 - wrong), cmap="gray", vmin=0.0, vmax=1.0)
        share = 1.0 - float(wrong[~np.isnan(image)].mean())
        panels[2].set_title(f"wrong pixels in black: {share:.1%} are right", fontsize=10)
    for axes in panels:
        axes.set_axis_off()
    return figure

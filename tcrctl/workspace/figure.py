"""End positions from the side and from above, coloured by tilt."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tcrctl.workspace.workspace import Workspace


def draw(found: Workspace) -> Figure:
    """Draw a workspace.

    Args:
        found: The workspace.
    """
    made = Figure(figsize=(7.0, 3.4), layout="constrained")
    side, above = made.subplots(1, 2)
    offset, order = 1e3 * found.offset, np.argsort(found.tilt)
    colours = np.degrees(found.tilt)[order]
    image: Any = None
    for axes, (i, j), names in ((side, (0, 2), "xz"), (above, (0, 1), "xy")):
        image = axes.scatter(
            offset[order, i], offset[order, j], c=colours, s=3, cmap="cividis", rasterized=True
        )
        axes.set_xlabel(f"{names[0]} [mm]")
        axes.set_ylabel(f"{names[1]} [mm]")
        axes.set_aspect("equal")
        axes.grid(visible=True, color="#dddddd", lw=0.5)
    made.colorbar(image, ax=[side, above], label="tilt [deg]")
    side.set_title(f"{found.robot}: end beside its place at rest", fontsize=9, loc="left")
    return made

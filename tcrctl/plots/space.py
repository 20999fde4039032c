"""What the figures in space share: the robot's body, arrows, and axes of equal scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from tcrctl.analysis.structure import Structure
from tcrctl.plots import style
from tcrctl.robot.module import apexes, rings
from tcrctl.signals import Array

#: How far apart the nodes of a ring are on the circle; only the ring's outline is drawn with it.
_CIRCLE: Final = 2.0 * np.pi * np.arange(37) / 36


def draw_body(axes: Any, nodes: Array, structure: Structure | None) -> None:
    """Draw a robot.

    Args:
        axes: Three-dimensional axes.
        nodes: Node positions (n_nodes, 3), in the unit of the axes.
        structure: Its springs and cables; only rings and rods are drawn without it.
    """
    for ring, apex in zip(rings(nodes), apexes(nodes), strict=True):
        axes.plot(*ring_outline(ring).T, color=style.GREY, lw=0.9)
        for node in ring:
            axes.plot(*np.stack([node, apex]).T, color=style.GREY, lw=0.6)
    if structure is not None:
        for ends in structure.springs:
            axes.plot(*nodes[ends].T, color=style.GREEN, lw=0.6)
        for cable in structure.cables:
            axes.plot(*cable.points(nodes).T, color=style.VERMILION, lw=0.6)


def ring_outline(corners: Array) -> Array:
    """Return points (37, 3) on the circle through three nodes (3, 3) of a ring."""
    centre = corners.mean(axis=0)
    arm, other = corners[0] - centre, corners[1] - corners[2]
    across = other * np.linalg.norm(arm) / np.linalg.norm(other)
    circle: Array = centre + np.outer(np.cos(_CIRCLE), arm) + np.outer(np.sin(_CIRCLE), across)
    return circle


def equal_scale(axes: Any, points: Sequence[Array], margin: float, zoom: float = 0.85) -> None:
    """Let one unit be as long on all axes, so that everything in ``points`` (n, 3) is inside.

    Args:
        axes: Three-dimensional axes.
        points: What must be inside.
        margin: Room around it.
        zoom: Size of the box in its place; labels need the rest.
    """
    together = np.concatenate([p[np.isfinite(p).all(axis=1)] for p in points])
    low, high = together.min(axis=0) - margin, together.max(axis=0) + margin
    wide = np.maximum(high - low, 0.25 * np.max(high - low))  # a flat path still needs room for its labels
    middle = (low + high) / 2.0
    axes.set(
        **{f"{name}lim": (m - w / 2.0, m + w / 2.0) for name, m, w in zip("xyz", middle, wide, strict=True)}
    )
    axes.set_box_aspect(wide, zoom=zoom)
    for name, w in zip("xyz", wide, strict=True):
        axes.locator_params(axis=name, nbins=3 + round(3 * w / np.max(wide)))
        axes.tick_params(axis=name, pad=1)


def name_axes(axes: Any) -> None:
    """Write x, y, z and their unit."""
    axes.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]")


def arrows(axes: Any, tails: Array, directions: Array, length: float, **look: Any) -> None:
    """Draw arrows of equal length.

    Args:
        axes: Three-dimensional axes.
        tails: Where they begin (n, 3).
        directions: Unit vectors (n, 3).
        length: Their length.
        look: Colour, width, label.
    """
    axes.quiver(*tails.T, *(length * directions).T, arrow_length_ratio=0.25, **look)

"""Which part of a path is drawing, and which is on the way to the next stroke."""

from __future__ import annotations

import json
from importlib import import_module
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.analysis.history import History
from tcrctl.log.file_names import RESOLVED
from tcrctl.log.run_files import RunFiles
from tcrctl.signals import Array

#: A wanted position no farther from a stroke is on it [m]: rounded corners leave it by as much.
_NEAR: Final = 2.5e-3
_SPACING: Final = 5e-4


def pen_down(history: History) -> NDArray[np.bool_]:
    """Tell at which steps the wanted end is on a stroke of its drawing.

    Args:
        history: The run.

    Returns:
        (n,); all True for what is no drawing in strokes.
    """
    everything = np.ones(len(history.t), bool)
    spec: Any = RunFiles(history.log).data(RESOLVED)
    trajectory = spec.get("trajectory") if isinstance(spec, dict) else None
    if not isinstance(trajectory, dict) or trajectory.get("kind") != "strokes":
        return everything
    strokes = _strokes(trajectory)
    if strokes is None:
        return everything
    spatial: Any = import_module("scipy.spatial")  # slow to import, and most runs draw nothing
    known = np.isfinite(history.wanted_position).all(axis=1)
    down = np.zeros(len(history.t), bool)
    offset = 1e-3 * np.array(trajectory["plane"]["offset_mm"], float)
    placed = history.wanted_position[0] + offset + strokes
    down[known] = spatial.KDTree(placed).query(history.wanted_position[known])[0] <= _NEAR
    return down if down.any() else everything


def _strokes(trajectory: dict[str, Any]) -> Array | None:
    """Return points on all strokes from the origin of the drawing (n, 3) [m]; None if they make no sense."""
    from pydantic import TypeAdapter, ValidationError

    from tcrctl.trajectory.plane_curve import stroke_pieces
    from tcrctl.trajectory.settings import StrokesSettings

    try:
        settings = TypeAdapter(StrokesSettings).validate_json(json.dumps(trajectory))
    except (ValidationError, ValueError):
        return None
    pieces = [piece for stroke in settings.strokes for piece in stroke_pieces(stroke)]
    points = [
        piece.point(s)
        for piece in pieces
        for s in np.linspace(0.0, piece.length, 2 + int(piece.length / _SPACING))
    ]
    flat = np.array(points)
    axes = np.array([settings.plane.x_axis, settings.plane.y_axis])
    placed: Array = flat.real[:, None] * axes[0] + flat.imag[:, None] * axes[1]
    return placed

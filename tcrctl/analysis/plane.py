"""From where the path of an end is best seen as a drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from tcrctl.analysis.history import History
from tcrctl.log.file_names import RESOLVED
from tcrctl.log.run_files import RunFiles
from tcrctl.signals import Array

#: A path no larger than this is a point [m].
POINT: Final = 1e-3
_NAMES: Final = {(0, 1): "from above", (0, 2): "from the front", (1, 2): "from the side"}


@dataclass(frozen=True, slots=True)
class Plane:
    """A plane that pictures are drawn in.

    Attributes:
        right: Unit vector to the right (3,).
        up: Unit vector upwards (3,).
        name: How it is looked at.
        labels: What stands at both axes.
    """

    right: Array
    up: Array
    name: str
    labels: tuple[str, str]

    def flat(self, points: Array) -> Array:
        """Return the coordinates (n, 2) of points (n, 3)."""
        seen: Array = points @ np.stack((self.right, self.up), axis=1)
        return seen


def plane_of(histories: Sequence[History], *more: Array) -> Plane:
    """Return the plane of the drawing that was asked for, or the view in which the paths are largest.

    Args:
        histories: The runs.
        more: Other points that shall be seen well (n, 3) [m].
    """
    asked = _drawing_plane(histories[0])
    if asked is not None:
        return asked
    points = np.concatenate([*(history.wanted_position for history in histories), *more])
    points = points[np.isfinite(points).all(axis=1)]
    extent = np.ptp(points, axis=0) if len(points) else np.zeros(3)
    if np.max(extent) < POINT:
        return _along(0, 1)
    a, b = sorted(np.argsort(-extent, kind="stable")[:2].tolist())
    return _along(a, b)


def _along(a: int, b: int) -> Plane:
    axes = np.eye(3)
    return Plane(axes[a], axes[b], _NAMES[a, b], ("xyz"[a], "xyz"[b]))


def _drawing_plane(history: History) -> Plane | None:
    """Return the plane that the experiment draws in, if it does; None also if it is that of two axes."""
    spec: Any = RunFiles(history.log).data(RESOLVED)
    try:
        plane = spec["trajectory"]["plane"]
        right, up = np.array(plane["x_axis"], float), np.array(plane["y_axis"], float)
    except (KeyError, TypeError, ValueError):
        return None
    if right.shape != (3,) or up.shape != (3,) or abs(right @ up) > POINT:
        return None
    for a, b in _NAMES:
        if np.array_equal(right, np.eye(3)[a]) and np.array_equal(up, np.eye(3)[b]):
            return _along(a, b)
    return Plane(right, up, "along the normal of the drawing", ("to the right", "up"))

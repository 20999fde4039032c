"""Time series thinned out and packed, so that a page of ten minutes is small.

Arrays are little-endian and base64: float32 for series, 16-bit integers for shapes (about 0.02 mm each).
"""

from __future__ import annotations

import base64
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.signals import Array

MOST_POINTS: Final = 4000
"""Points per curve; of more, the smallest and the largest of every bundle are kept."""


def every(count: int, most: int) -> NDArray[np.int64]:
    """Return at most ``most`` of ``count`` rows, equally far apart, first and last among them."""
    return np.unique(np.round(np.linspace(0, count - 1, min(count, most))).astype(np.int64))


def _bundles(count: int) -> tuple[int, int]:
    """Return the number of bundles and points in each, so that two per bundle are at most ``MOST_POINTS``."""
    size = -(-2 * count // MOST_POINTS)
    return count // size, size


def bundled(values: Array) -> Array:
    """Thin out a curve so that no peak is lost.

    Args:
        values: (n,), may hold NaN.

    Returns:
        ``values`` if they are few; else smallest and largest of every bundle, in the order in which they come. A
        rest smaller than a bundle at the end is left out.
    """
    if len(values) <= MOST_POINTS:
        return values
    count, size = _bundles(len(values))
    rows = values[: count * size].reshape(count, size)
    known = np.where(np.isfinite(rows), rows, 0.0)
    ends = np.sort(np.stack([known.argmin(axis=1), known.argmax(axis=1)], axis=1), axis=1)
    return np.take_along_axis(rows, ends, axis=1).ravel()


def bundled_times(t: Array) -> Array:
    """Return times (k,) of the points that :func:`bundled` keeps: the first and the middle of every bundle."""
    if len(t) <= MOST_POINTS:
        return t
    count, size = _bundles(len(t))
    rows = t[: count * size].reshape(count, size)
    return rows[:, [0, size // 2]].ravel()


def bundled_marks(marks: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return marks (k,) of the points that :func:`bundled` keeps: set where any point of the bundle is marked."""
    if len(marks) <= MOST_POINTS:
        return marks
    count, size = _bundles(len(marks))
    return np.repeat(marks[: count * size].reshape(count, size).any(axis=1), 2)


def packed(values: Array) -> str:
    """Pack numbers as float32."""
    return raw(np.ascontiguousarray(values, dtype="<f4"))


def raw(values: NDArray[Any]) -> str:
    """Pack an array as it is."""
    return base64.b64encode(values.tobytes()).decode("ascii")

"""How far an end is from where it was wanted."""

from __future__ import annotations

import numpy as np

from tcrctl.signals import Array


def distance(position: Array, wanted: Array) -> Array:
    """Return the distance of positions (n, 3) [m] from those wanted (n, 3) [m], (n,) [m]."""
    found: Array = np.linalg.norm(position - wanted, axis=1)
    return found


def angle(normal: Array, wanted: Array) -> Array:
    """Return the angle between unit vectors (n, 3) and those wanted (n, 3), (n,) [rad]; NaN where one is.

    Exact to the last digits also for the smallest angles, where the arc cosine is not.
    """
    apart, together = normal - wanted, normal + wanted
    found: Array = 2.0 * np.arctan2(np.linalg.norm(apart, axis=1), np.linalg.norm(together, axis=1))
    return found

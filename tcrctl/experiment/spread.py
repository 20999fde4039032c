"""The few numbers that stand for many: whatever says ``max``, ``rms`` or ``p99`` of a run takes them from here."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def spread(values: NDArray[np.float64], *names: str) -> dict[str, float] | None:
    """Return numbers about the magnitudes of values.

    Args:
        values: (n,), in any unit.
        names: Which ones: ``max``, ``min``, ``rms``, ``mean``, ``p50``, ``p99``.

    Returns:
        The numbers by name, in the unit of the values, NaN if any value is; None if there are none but NaN.
    """
    if not values.size or np.isnan(values).all():
        return None
    size = np.abs(values)
    found = {
        "max": np.max(size),
        "min": np.min(size),
        "rms": np.sqrt(np.mean(size**2)),
        "mean": np.mean(size),
        "p50": np.quantile(size, 0.5),
        "p99": np.quantile(size, 0.99),
    }
    return {name: float(found[name]) for name in names}

"""When the steps of a run really began: their own time leaves out what a paced run has missed.

A step that begins later than a period moves all after it (see :class:`tcrctl.loop.pacing.RealTime`), so

    begun[k] = t[k] + lateness[k] + sum of the latenesses before k that were longer than a period.

A stopped process, a stalled tick and a computer that does not keep up appear in it as what they are.
"""

from __future__ import annotations

import numpy as np

from tcrctl.signals import Array


def missed(lateness: Array, period: Array) -> Array:
    """Return by how much every step has moved those after it (n,) [s].

    Args:
        lateness: How late every step began (n,) [s].
        period: Control period of every step (n,) [s].
    """
    return np.asarray(np.where(lateness > period, lateness, 0.0))


def begun(t: Array, lateness: Array, period: Array) -> Array:
    """Return when every step began, on the clock that paced it (n,) [s]; arguments as in ``missed``.

    Args:
        t: Time of every step (n,) [s].
        lateness: How late it began (n,) [s].
        period: Its control period (n,) [s].
    """
    moved = missed(lateness, period)
    return np.asarray(t + lateness + np.cumsum(moved) - moved)


def beyond(lateness: Array, busy: Array, period: Array) -> float:
    """Return how much longer a run took than its periods [s]: what was missed, and the rest of the last step.

    Args:
        lateness: How late every step began (n,) [s].
        busy: How long it took (n,) [s].
        period: Its control period (n,) [s].
    """
    if not len(lateness):
        return 0.0
    return float(np.sum(missed(lateness, period)) + max(0.0, busy[-1] - period[-1]))

"""What the lag and the dead time of the drives make of a prediction.

A drive follows its set-point s(t - θ) with a position loop of time constant τ. So the answer R to a unit ramp of
the cable becomes R_L(t - θ), R_L' = (R - R_L) / τ, and what is on its way already moves the robot by

    p (R - R_L) / τ  +  w (R_L(t) - R_L(t - θ)) / θ

with p the set-point of a dead time ago minus the cable taken in, and w what was sent since, spread evenly. R is
taken for straight between instants.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from tcrctl.numerics.kernel import part
from tcrctl.signals import Array


class DriveLag(NamedTuple):
    """Numbers of the drives.

    Attributes:
        lag: τ [s]; 0 for none.
        dead_time: θ [s].
    """

    lag: float
    dead_time: float


@part(error_model="numpy")
def _follow(change: Array, step: float, lag: float, out: Array) -> None:
    """Fill R_L (n, rows, m) from R (n, rows, m + 1), which begins with 0 one step before."""
    keep = math.exp(-step / lag)
    for r in range(out.shape[1]):
        for c in range(out.shape[2]):
            last, held = 0.0, 0.0
            for n in range(out.shape[0]):
                rise = lag * (change[n, r, c] - last) / step
                held = change[n, r, c] - rise + keep * (held - last + rise)
                last = change[n, r, c]
                out[n, r, c] = held


@part(error_model="numpy")
def _late(values: Array, n: int, r: int, c: int, steps: float) -> float:
    """Interpolate the value ``steps`` instants before instant n; 0 before the first."""
    at = n + 1 - steps
    if at <= 0.0:
        return 0.0
    i = int(at)
    part = at - i
    before = values[i - 1, r, c] if i > 0 else 0.0
    after = values[i, r, c] if i < values.shape[0] else before
    return float(before + part * (after - before))


@part(error_model="numpy")
def with_lag(change: Array, step: float, drives: DriveLag, behind: Array, queue: Array) -> None:
    """Change responses of cables into those of set-points.

    Args:
        change: Responses (n, rows, m + 1) of robot.response, changed.
        step: Distance of the instants [s].
        drives: Lag and dead time.
        behind: p (m,) [m].
        queue: w (m,) [m].
    """
    prompt = drives.lag == 0.0 and drives.dead_time == 0.0
    for way in behind:
        prompt = prompt and way == 0.0
    if prompt:
        return
    n_steps, rows, m = change.shape[0], change.shape[1], change.shape[2] - 1
    slow = change[:, :, :m].copy()
    if drives.lag > 0.0:
        _follow(change, step, drives.lag, slow)
    soon = max(drives.lag, 0.5 * step)
    back = slow
    if soon > drives.lag:
        back = slow.copy()
        _follow(change, step, soon, back)
    late = drives.dead_time / step
    for n in range(n_steps):
        for r in range(rows):
            for c in range(m):
                change[n, r, m] += behind[c] * (change[n, r, c] - back[n, r, c]) / soon
                if drives.dead_time > 0.0:
                    since = slow[n, r, c] - _late(slow, n, r, c, late)
                    change[n, r, m] += queue[c] * since / drives.dead_time
    for r in range(rows):
        for c in range(m):
            for n in range(n_steps - 1, -1, -1):
                change[n, r, c] = _late(slow, n, r, c, late)

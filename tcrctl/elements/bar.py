"""Two-node bar: rods and ring sides (bilateral), springs (tension only).

Positional finite element: with end positions r_i, r_j, length l = |r_j - r_i| and direction
e = (r_j - r_i) / l, the bar's tension and its force on node j are

    T = k (l - l0) + c dl/dt,    k = EA / l0,    f_j = T e  (resisting, hence +T e in the residual)

A tension-only bar has T = max(0, ...). An implicit rule gives dl/dt = w (l - l_before); then T is the
derivative of the scalar T² / (2 (k + c w)) and the tangent for a change of r_j - r_i is
(k + c w) e e' + T / l (I - e e').  Source: [TCR] Sec. III.A and its reference [30].
"""

from __future__ import annotations

import numpy as np

from tcrctl.numerics.kernel import part
from tcrctl.signals import Array

#: Columns of the bar parameters (n_bars, 4): l0 [m], EA / l0 [N/m], damping [N s/m], 1 if tension only.
REST, STIFFNESS, DAMPING, TENSION_ONLY = range(4)


@part(error_model="numpy")
def direction(q: Array, i: int, j: int) -> tuple[float, float, float, float]:
    """Return the length [m] and unit vector of the line from node i to node j in ``q`` (3 n_nodes,)."""
    dx = q[3 * j] - q[3 * i]
    dy = q[3 * j + 1] - q[3 * i + 1]
    dz = q[3 * j + 2] - q[3 * i + 2]
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    return length, dx / length, dy / length, dz / length


@part(error_model="numpy")
def tension(length: float, w: float, before: float, bars: Array, b: int) -> float:
    """Return the tension T [N] of bar ``b`` at ``length`` [m] with dl/dt = w (length - before)."""
    T = bars[b, STIFFNESS] * (length - bars[b, REST]) + bars[b, DAMPING] * w * (length - before)
    if T < 0.0 and bars[b, TENSION_ONLY] != 0.0:
        return 0.0
    return float(T)


@part(error_model="numpy")
def lengths_and_rates(q: Array, v: Array, nodes: np.ndarray, length: Array, rate: Array) -> None:
    """Fill lengths [m] and dl/dt [m/s] (n_bars,) of the bars between ``nodes`` (n_bars, 2)."""
    for b in range(nodes.shape[0]):
        i, j = nodes[b, 0], nodes[b, 1]
        length[b], ex, ey, ez = direction(q, i, j)
        rate[b] = (
            (v[3 * j] - v[3 * i]) * ex
            + (v[3 * j + 1] - v[3 * i + 1]) * ey
            + (v[3 * j + 2] - v[3 * i + 2]) * ez
        )

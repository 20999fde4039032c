"""Inputs over the horizon are piecewise constant: where the pieces begin, and what they add up to."""

from __future__ import annotations

import numpy as np
from numba import njit

from tcrctl.signals import Array


def block_edges(instants: int, blocks: int) -> Array:
    """First instant of every block and the end (blocks + 1,): lengths grow about twofold, at least 1."""
    edges = [0]
    for b in range(1, blocks):
        wanted = round(instants * (2**b - 1) / (2**blocks - 1))
        edges.append(min(max(edges[-1] + 1, wanted), instants - (blocks - b)))
    return np.array([*edges, instants], dtype=np.int64)


@njit(cache=True, error_model="numpy")
def superpose(change: Array, now: Array, edges: Array) -> tuple[Array, Array]:
    """Outputs for piecewise constant speeds from the responses to ramps that begin now.

    Args:
        change: Responses (n, rows, m + 1) of robot.response.
        now: Outputs at the state (rows,).
        edges: Instants at which the blocks begin, and the end (blocks + 1,).

    Returns:
        free (n, rows) and gain (n, rows, blocks * m).
    """
    n, rows, m = change.shape[0], change.shape[1], change.shape[2] - 1
    free, gain = np.empty((n, rows)), np.zeros((n, rows, (edges.shape[0] - 1) * m))
    for i in range(n):
        for r in range(rows):
            free[i, r] = now[r] + change[i, r, m]
        for b in range(edges.shape[0] - 1):
            begun, ended = i - edges[b], i - edges[b + 1]
            if begun >= 0:
                for r in range(rows):
                    for c in range(m):
                        gain[i, r, b * m + c] = change[begun, r, c]
                        if ended >= 0:
                            gain[i, r, b * m + c] -= change[ended, r, c]
    return free, gain

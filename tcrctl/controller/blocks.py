"""Inputs over the horizon are piecewise constant: where the pieces begin, and what they add up to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.numerics.kernel import part
from tcrctl.signals import Array


class Grid(NamedTuple):
    """When a prediction looks, and when its inputs change.

    Attributes:
        ahead: Prediction instants after the step, equally spaced (n,) [s].
        edges: Instants at which the input blocks begin, and the end (blocks + 1,).
    """

    ahead: Array
    edges: Array

    @property
    def blocks(self) -> int:
        """Number of input blocks."""
        return int(self.edges.shape[0]) - 1


def make_grid(instants: int, blocks: int, horizon: float) -> Grid:
    """Divide a ``horizon`` [s] into equal instants and growing blocks."""
    ahead: Array = np.arange(1.0, instants + 1.0) * (horizon / instants)
    return Grid(ahead, block_edges(instants, blocks))


def block_edges(instants: int, blocks: int) -> Array:
    """Return the first instant of every block and the end (blocks + 1,): lengths grow about twofold, at least 1."""
    edges = [0]
    for b in range(1, blocks):
        wanted = round(instants * (2**b - 1) / (2**blocks - 1))
        edges.append(min(max(edges[-1] + 1, wanted), instants - (blocks - b)))
    return np.array([*edges, instants], dtype=np.int64)


@part(error_model="numpy")
def superpose(change: Array, now: Array, edges: Array) -> tuple[Array, Array]:
    """Find outputs for piecewise constant speeds from the responses to ramps that begin now.

    Args:
        change: Responses (n, rows, m + 1) of robot.response.
        now: Outputs at the state (rows,).
        edges: Instants at which the blocks begin, and the end (blocks + 1,).

    Returns:
        free (n, rows) and gain (n, rows, blocks * m).
    """
    n = change.shape[0]
    rows = change.shape[1]
    m = change.shape[2] - 1
    free, gain = np.empty((n, rows)), np.zeros((n, rows, (edges.shape[0] - 1) * m))
    for i in range(n):
        for r in range(rows):
            free[i, r] = now[r] + change[i, r, m]
        for b in range(edges.shape[0] - 1):
            begun, ended = i - edges[b], i - edges[b + 1]
            if ended >= 0:
                for r in range(rows):
                    for c in range(m):
                        gain[i, r, b * m + c] = change[begun, r, c] - change[ended, r, c]
            elif begun >= 0:
                for r in range(rows):
                    for c in range(m):
                        gain[i, r, b * m + c] = change[begun, r, c]
    return free, gain

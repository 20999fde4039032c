"""Tangent stiffness: the block-banded part K of the derivative of the residual, from its elements.

K is block banded in the storage of ``numerics.block_banded``, where only the upper triangle counts. A line
between two points with axial stiffness k and tension T gives s = k e e' + T / l (I - e e') for a change of
their difference; a hole spreads it on its ring's nodes by its weights. The rank-1 terms of the cables,
k_c g_c g_c', are not in K; see ``linear``.
"""

from __future__ import annotations

import numpy as np

from tcrctl.elements import bar, sliding_cable
from tcrctl.elements.rubbing_cable import Stretches
from tcrctl.numerics.kernel import part
from tcrctl.robot.module import FIXED, NODES, SIZE
from tcrctl.signals import Array


@part(error_model="numpy")
def _fill_line(s: Array, axial: float, lateral: float, ex: float, ey: float, ez: float) -> None:
    """Fill s = axial e e' + lateral (I - e e') as (xx, xy, xz, yy, yz, zz)."""
    d = axial - lateral
    s[0] = d * ex * ex + lateral
    s[1] = d * ex * ey
    s[2] = d * ex * ez
    s[3] = d * ey * ey + lateral
    s[4] = d * ey * ez
    s[5] = d * ez * ez + lateral


@part(error_model="numpy")
def _add_pair(K: Array, i: int, j: int, f: float, s: Array) -> None:
    """Add f s at node pair (i, j), and by symmetry (j, i), to the upper triangle of K."""
    if i < FIXED or j < FIXED:
        return
    if i > j:
        i, j = j, i
    block = K[i // NODES - 1, j // NODES - i // NODES]
    a, b = 3 * (i % NODES), 3 * (j % NODES)
    block[a, b] += f * s[0]
    block[a, b + 1] += f * s[1]
    block[a, b + 2] += f * s[2]
    block[a + 1, b] += f * s[1]
    block[a + 1, b + 1] += f * s[3]
    block[a + 1, b + 2] += f * s[4]
    block[a + 2, b] += f * s[2]
    block[a + 2, b + 1] += f * s[4]
    block[a + 2, b + 2] += f * s[5]


@part(error_model="numpy")
def start(K: Array, mass: Array, inertia: float, spring: Array) -> None:
    """Set K to inertia M + S; mass (n_modules, 12, 12) [kg], inertia [1/s2], spring (3 n_nodes,) [N/m]."""
    for j in range(K.shape[0]):
        for a in range(SIZE):
            for b in range(SIZE):
                K[j, 0, a, b] = inertia * mass[j, a, b]
            K[j, 0, a, a] += spring[SIZE * (j + 1) + a]
        for d in range(1, K.shape[1]):
            for a in range(SIZE):
                for b in range(SIZE):
                    K[j, d, a, b] = 0.0


@part(error_model="numpy")
def add_bars(K: Array, q: Array, nodes: np.ndarray, bars: Array, w: float, before: Array) -> None:
    """Add all bars that are not slack; arguments as in ``elements.bar``."""
    s = np.empty(6)
    for b in range(bars.shape[0]):
        i, j = nodes[b, 0], nodes[b, 1]
        length, ex, ey, ez = bar.direction(q, i, j)
        T = bar.tension(length, w, before[b], bars, b)
        if T == 0.0 and bars[b, bar.TENSION_ONLY] != 0.0:
            continue
        _fill_line(s, bars[b, bar.STIFFNESS] + bars[b, bar.DAMPING] * w, T / length, ex, ey, ez)
        _add_pair(K, i, i, 1.0, s)
        _add_pair(K, j, j, 1.0, s)
        _add_pair(K, i, j, -1.0, s)


@part(error_model="numpy")
def _add_holes(
    K: Array, nodes: np.ndarray, weights: Array, hole: int, other: int, f: float, s: Array
) -> None:
    """Add f s between the two holes, spread on the ring nodes that carry them."""
    for a in range(3):
        if weights[hole, a] != 0.0:
            for b in range(a if hole == other else 0, 3):
                if weights[other, b] != 0.0:
                    _add_pair(K, nodes[hole, a], nodes[other, b], f * weights[hole, a] * weights[other, b], s)


@part(error_model="numpy")
def add_cables(
    K: Array, q: Array, first_hole: np.ndarray, nodes: np.ndarray, weights: Array, tension: Array
) -> None:
    """Add T ∂²l/∂q² of every taut cable; tensions (m,) [N], the rest as in ``elements.sliding_cable``."""
    s = np.empty(6)
    for c in range(tension.shape[0]):
        if tension[c] > 0.0:
            for hole in range(first_hole[c], first_hole[c + 1] - 1):
                length, ex, ey, ez = sliding_cable.segment(q, nodes, weights, hole)
                _fill_line(s, 0.0, tension[c] / length, ex, ey, ez)
                _add_holes(K, nodes, weights, hole, hole, 1.0, s)
                _add_holes(K, nodes, weights, hole + 1, hole + 1, 1.0, s)
                _add_holes(K, nodes, weights, hole, hole + 1, -1.0, s)


@part(error_model="numpy")
def add_stretches(K: Array, first_hole: np.ndarray, nodes: np.ndarray, weights: Array, s: Stretches) -> None:
    """Add every stretch of cables that rub: its tension across, and along it the stiffness of a group of one."""
    block = np.empty(6)
    for c in range(first_hole.shape[0] - 1):
        for hole in range(first_hole[c] + 1, first_hole[c + 1]):
            lateral = s.tension[hole] / s.length[hole]
            if lateral == 0.0 and s.axial[hole] == 0.0:
                continue
            ex, ey, ez = s.direction[hole, 0], s.direction[hole, 1], s.direction[hole, 2]
            _fill_line(block, s.axial[hole], lateral, ex, ey, ez)
            _add_holes(K, nodes, weights, hole - 1, hole - 1, 1.0, block)
            _add_holes(K, nodes, weights, hole, hole, 1.0, block)
            _add_holes(K, nodes, weights, hole - 1, hole, -1.0, block)

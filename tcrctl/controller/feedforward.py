"""Drive speeds that the reference itself needs: their changes are no effort of the feedback and cost nothing.

W in (30) keeps the loop stable where the model's slow modes are not the plant's, but it also holds the drives back
where the reference asks for other speeds, and the end would lag. So the changes of speed are weighed against those
of the speeds w_b with which a robot at rest in every instant would follow the reference:

    Σ_b |u_b - u_{b-1}|²_W   becomes   Σ_b |(u_b - w_b) - (u_{b-1} - w_{b-1})|²_W
    w_b = (S'Q S + ε I)^-1 S'Q ẏ_b,     S = ∂y/∂d at rest,   ẏ_b = mean velocity of the reference in block b

ε leaves alone what the pose does not need. The loop about the reference is the same with and without w.
"""

from __future__ import annotations

import numpy as np

from tcrctl.numerics import block_banded
from tcrctl.numerics.kernel import part
from tcrctl.signals import Array, Reference

#: ε as a part of the mean diagonal of S'QS.
DAMPING = 1e-4
#: Added to ε so that drives without any authority, all cables slack, stand still [s2/m2].
SLACK = 1e-6


@part(error_model="numpy")
def needed_speeds(gain: Array, output: Array, poses: Array, edges: Array, spacing: float) -> Array:
    """Return the speeds w (blocks, m) [m/s] with which the end, always at rest, follows the reference.

    Args:
        gain: S, position and normal by the drives at rest (6, m).
        output: Q for position [1/m2] and normal, and more that is not read (6 or more,).
        poses: Wanted position [m] and normal now and at the instants (n + 1, 6).
        edges: Instants at which the blocks begin, and the end (blocks + 1,).
        spacing: Time between instants [s].
    """
    m, blocks = gain.shape[1], edges.shape[0] - 1
    weighted = np.empty((m, 6))
    for c in range(m):
        for r in range(6):
            weighted[c, r] = gain[r, c] * output[r]
    H = np.dot(weighted, gain)
    ridge = DAMPING * np.trace(H) / m + SLACK
    for c in range(m):
        H[c, c] += ridge
    moved = np.empty((6, blocks))
    for b in range(blocks):
        time = spacing * (edges[b + 1] - edges[b])
        for r in range(6):
            moved[r, b] = (poses[int(edges[b + 1]), r] - poses[int(edges[b]), r]) / time
    needed = np.dot(weighted, moved)
    block_banded.factor_diagonal(H)  # positive: the ridge sees to it
    block_banded.solve_transposed(H, needed)
    block_banded.solve_upper(H, needed)
    speeds: Array = needed.T.copy()
    return speeds


@part(error_model="numpy")
def wanted_changes(previous: Array, needed_before: Array, needed: Array) -> Array:
    """Return changes of speed that cost nothing, block by block (blocks * m,) [m/s]; the first from standstill.

    Args:
        previous: Input of the last step (m,) [m/s].
        needed_before: w of that step's first block (m,) [m/s].
        needed: w now (blocks, m) [m/s].
    """
    blocks, m = needed.shape
    changes = np.empty(blocks * m)
    for c in range(m):
        changes[c] = previous[c] + needed[0, c] - needed_before[c]
        for b in range(1, blocks):
            changes[b * m + c] = needed[b, c] - needed[b - 1, c]
    return changes


def reference_poses(reference: Reference) -> Array:
    """Return position and normal now and at the instants (n + 1, 6); a normal that is not wanted stands still."""
    poses = np.zeros((reference.ahead_position.shape[0] + 1, 6))
    poses[0, :3], poses[1:, :3] = reference.position, reference.ahead_position
    if reference.normal is not None and reference.ahead_normal is not None:
        poses[0, 3:], poses[1:, 3:] = reference.normal, reference.ahead_normal
    return poses

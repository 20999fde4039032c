"""Creep of cables: standard linear solid, elongation that comes late.

Beside its elastic elongation T / k a cable has one more per branch, u_i, which follows its tension with a delay:

    τ_i du_i/dt = r_i T / k - u_i

In rest it has already come, so that the robot starts where its rest lengths say; only changes count. It is a change
of unstretched lengths between internal steps, exact for a tension that is constant during the step. Source: [FL75].
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tcrctl.numerics.kernel import kernel
from tcrctl.plant.reality_settings import CreepBranch
from tcrctl.signals import Array


@kernel(error_model="numpy")
def _grow(late: Array, strength: Array, share: Array, elastic: Array) -> Array:
    """Move late elongations (n_branches, n) by their share of the way; return the sum of their changes (n,) [m]."""
    grown = np.zeros(elastic.shape[0])
    for i in range(late.shape[0]):
        for c in range(elastic.shape[0]):
            change = share[i] * (strength[i] * elastic[c] - late[i, c])
            late[i, c] += change
            grown[c] += change
    return grown


class Creep:
    """Late elongations of all cables, or of all their stretches.

    Attributes:
        late: Elongation of every branch (n_branches, n) [m].
    """

    def __init__(self, branches: Sequence[CreepBranch], elastic: Array) -> None:
        """Be at rest with elastic elongations T / k (n,) [m]."""
        self._strength = np.array([branch.strength for branch in branches])
        self._time = np.array([branch.time_s for branch in branches])
        self.late = np.outer(self._strength, elastic)

    def grow(self, elastic: Array, h: float) -> Array:
        """Return by how much unstretched lengths grow (n,) [m] in ``h`` [s] under elongations T / k (n,) [m]."""
        return _grow(self.late, self._strength, -np.expm1(-h / self._time), elastic)

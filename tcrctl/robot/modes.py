"""Natural frequencies and mode shapes of the undamped robot about a static equilibrium.

Small motions obey M δ̈ + (K + G'C G) δ = 0 with the stiffness k_c of every cable that is taut; a slack one adds
nothing. Dense and meant for offline use.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.numerics import block_banded
from tcrctl.robot.equations import assemble, make_workspace
from tcrctl.robot.equilibrium import Equilibrium, static_load
from tcrctl.robot.model import Model
from tcrctl.robot.module import FIXED
from tcrctl.signals import Array


class Modes(NamedTuple):
    """The lowest modes, slowest first.

    Attributes:
        frequency: Natural frequencies (count,) [Hz].
        shape: Mode shapes over the free coordinates, V'MV = I (n_free, count) [1/sqrt(kg)].
    """

    frequency: Array
    shape: Array


def mass_matrix(model: Model) -> Array:
    """Return the dense mass matrix of the free coordinates (n_free, n_free) [kg]."""
    from scipy.linalg import block_diag

    M: Array = block_diag(*model.mass)
    return M


def modes(model: Model, equilibrium: Equilibrium, drive: Array, external: Array, count: int) -> Modes:
    """Return the lowest modes about a stable equilibrium.

    Args:
        model: Robot arrays.
        equilibrium: Static equilibrium of the model.
        drive: Drive lengths that belong to it (m,) [m].
        external: External force that belongs to it, gravity included (3 n_nodes,) [N].
        count: Number of modes wanted, at most n_free.
    """
    from scipy.linalg import eigh

    ws = make_workspace(model)
    assemble(model, equilibrium.q, drive, static_load(model, external), ws, np.bool_(True))
    G = ws.G[:, 3 * FIXED :]
    stiffness = block_banded.to_dense(ws.K) + G.T @ (ws.axial[:, None] * G)
    square, shape = eigh(stiffness, mass_matrix(model), subset_by_index=[0, count - 1])
    return Modes(np.sqrt(square) / (2.0 * np.pi), shape)

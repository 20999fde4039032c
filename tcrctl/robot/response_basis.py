"""The basis of the linearised response: lowest modes and static answers to the drives, followed from step to step.

One orthogonal iteration V <- A^-1 M V [GVL13, Sec. 8.2.4] per step; the last m columns are the answers A^-1 G'C.
What A V is need not be computed again: with B what was solved for and T what made the answers orthonormal,

    V = A^-1 B T,    V'AV = (V'B) T,    G V = C^-1 (last m columns of V'B)'
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.elements.sliding_cable import STIFFNESS
from tcrctl.numerics.copies import copy_rows
from tcrctl.numerics.kernel import kernel, part
from tcrctl.numerics.orthonormal import orthonormalise
from tcrctl.robot import linear
from tcrctl.robot.equations import Workspace
from tcrctl.robot.model import Model
from tcrctl.robot.module import FIXED, SIZE
from tcrctl.signals import Array


class Reduced(NamedTuple):
    """The robot on a basis V (n_free, r), V'MV = I.

    Attributes:
        weighted: M V (n_free, r) [kg].
        stiffness: V'AV (r, r) [1/s2].
        lengths: G V (m, r), how cables lengthen.
    """

    weighted: Array
    stiffness: Array
    lengths: Array


@part(error_model="numpy")
def mass_columns(mass: Array, X: Array, out: Array) -> None:
    """Set out = M X for columns X (n_free, r)."""
    for i in range(mass.shape[0]):
        np.dot(mass[i], X[SIZE * i : SIZE * (i + 1)], out[SIZE * i : SIZE * (i + 1)])


@part(error_model="numpy")
def count_as_taut(model: Model, ws: Workspace) -> None:
    """Count all cables as two-sided in a workspace that is coupled for those that are taut."""
    slack = False
    for c in range(ws.axial.shape[0]):
        slack = slack or ws.axial[c] != model.cables[c, STIFFNESS]
        ws.axial[c] = model.cables[c, STIFFNESS]
    if slack:
        linear.couple(ws, ws.r)


@kernel(error_model="numpy")
def refine_basis(model: Model, ws: Workspace, V: Array) -> Reduced:
    """Iterate the modes in V once; its last m columns become the static answers to the drives.

    Args:
        model: Robot arrays.
        ws: K, U, G at a stable equilibrium, coupled (:func:`count_as_taut`).
        V: Basis (n_free, modes + m), changed.
    """
    m, modes = ws.axial.shape[0], V.shape[1] - ws.axial.shape[0]
    B, weighted = np.empty(V.shape), np.empty(V.shape)
    mass_columns(model.mass, V, B)
    for k in range(V.shape[0]):
        for c in range(m):
            B[k, modes + c] = ws.axial[c] * ws.G[c, 3 * FIXED + k]
    copy_rows(B, V)
    linear.solve_many(ws, V)
    mass_columns(model.mass, V, weighted)
    T = orthonormalise(V, weighted)
    work = np.dot(V.T, B)
    lengths = np.empty((m, V.shape[1]))
    for c in range(m):
        for i in range(V.shape[1]):
            lengths[c, i] = work[i, modes + c] / ws.axial[c]
    return Reduced(weighted, np.dot(work, T), lengths)


def start_basis(model: Model, ws: Workspace, modes: int, iterations: int = 30) -> Array:
    """Return the basis (n_free, modes + m) at the stable equilibrium that ``ws`` (K, U, G) belongs to.

    Starts from a fixed pseudo-random block; 30 orthogonal iterations separate modes a factor 2 apart in
    frequency to 1e-18.
    """
    size, m = ws.r.shape[0], model.cables.shape[0]
    V = np.random.default_rng(0).standard_normal((size, min(modes, size - m) + m))
    ws.axial[:] = model.cables[:, STIFFNESS]
    linear.couple(ws, ws.r)
    for _ in range(iterations):
        refine_basis(model, ws, V)
    return V

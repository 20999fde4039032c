"""Assembly: internal forces, tangent and potential of the whole robot from its elements.

The equation of motion (9), actuation node eliminated, is  M q̈ + Σ_c λ_c ∂l_c/∂q + f_in(q, q̇) - f_ext = 0.
Every implicit rule turns it into equations for the positions q alone,

    r(q) = c M (q - q̃) + f_elements(q) + S (q - q_s) - f_ext = 0                                  (*)

c and q̃ come from the integration rule (c = 0 in statics), S are virtual springs that an estimator ties to
measured nodes. Element damping needs dl/dt, which every rule gives as w (l - l_before): w = 0 in statics,
1/h with l_before = l_k (backward Euler), 2/h with l_before = l_k + h/2 dl_k/dt (trapezoid, used with
generalized-alpha). So r is always the gradient of one scalar, the incremental potential, and its tangent
is symmetric: K + Σ_c k_c g_c g_c', K block banded, one rank-1 term per taut cable.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from tcrctl.elements import bar, sliding_cable
from tcrctl.robot import tangent
from tcrctl.robot.model import Model
from tcrctl.robot.module import FIXED, SIZE
from tcrctl.signals import Array

#: Rows of ``Load.nodal``.
Q_FREE, FORCE, SPRING, SPRING_AT = range(4)


class Load(NamedTuple):
    """What (*) holds beside the elements, for one solve.

    Attributes:
        inertia: c of (*) [1/s2].
        w: d(dl/dt)/dl of the rule [1/s].
        nodal: Rows q̃ [m], f_ext with gravity [N], diagonal of S [N/m], q_s [m] (4, 3 n_nodes).
        bar_before: l_before of the bars (n_bars,) [m].
        cable_before: (l + d)_before of the cables (m,) [m].
    """

    inertia: float
    w: float
    nodal: Array
    bar_before: Array
    cable_before: Array


class Workspace(NamedTuple):
    """Arrays that assembly and solves fill; allocated once by :func:`make_workspace`.

    Attributes:
        K: Block-banded part of the tangent (n_modules, w + 1, 12, 12) [N/m].
        U: Its Cholesky factor, same shape.
        r: Residual of (*) for the free coordinates (12 n_modules,) [N].
        G: ∂l/∂q (m, 3 n_nodes).
        tension: λ (m,) [N].
        axial: k_c = ∂λ/∂(l + d) of taut cables, 0 of slack ones (m,) [N/m].
        length: Path lengths l (m,) [m].
        columns: Cable columns and right-hand side of ``linear.couple`` (12 n_modules, m + 1).
        small: Its factor of the cable coupling (m, m).
    """

    K: Array
    U: Array
    r: Array
    G: Array
    tension: Array
    axial: Array
    length: Array
    columns: Array
    small: Array


def make_workspace(model: Model) -> Workspace:
    """Allocate the arrays for ``model``."""
    n, m = model.mass.shape[0], model.cables.shape[0]
    shape = (n, model.bandwidth + 1, SIZE, SIZE)
    return Workspace(
        K=np.zeros(shape),
        U=np.zeros(shape),
        r=np.zeros(SIZE * n),
        G=np.zeros((m, SIZE * (n + 1))),
        tension=np.zeros(m),
        axial=np.zeros(m),
        length=np.zeros(m),
        columns=np.zeros((SIZE * n, m + 1)),
        small=np.zeros((m, m)),
    )


@njit(cache=True, error_model="numpy")
def _add_force(r: Array, node: int, x: float, y: float, z: float) -> None:
    """Add a force to the residual of a free node."""
    if node >= FIXED:
        first = 3 * (node - FIXED)
        r[first] += x
        r[first + 1] += y
        r[first + 2] += z


@njit(cache=True, error_model="numpy")
def _add_bars(q: Array, nodes: np.ndarray, bars: Array, w: float, before: Array, r: Array) -> float:
    """Add all bars to r; return their potential [J]."""
    energy = 0.0
    for b in range(bars.shape[0]):
        i, j = nodes[b, 0], nodes[b, 1]
        length, ex, ey, ez = bar.direction(q, i, j)
        T = bar.tension(length, w, before[b], bars, b)
        energy += 0.5 * T * T / (bars[b, bar.STIFFNESS] + bars[b, bar.DAMPING] * w)
        _add_force(r, j, T * ex, T * ey, T * ez)
        _add_force(r, i, -T * ex, -T * ey, -T * ez)
    return energy


@njit(cache=True, error_model="numpy")
def _add_cables(model: Model, q: Array, drive: Array, load: Load, ws: Workspace) -> float:
    """Add all cables to r, fill G, tension, axial, length; return their potential [J]."""
    cables = model.cables
    sliding_cable.path_gradients(
        q, model.first_hole, model.hole_nodes, model.hole_weights, cables, ws.length, ws.G
    )
    energy = 0.0
    for c in range(cables.shape[0]):
        T = sliding_cable.tension(ws.length[c] + drive[c], load.w, load.cable_before[c], cables, c)
        axial = cables[c, sliding_cable.STIFFNESS] + cables[c, sliding_cable.DAMPING] * load.w
        ws.tension[c] = T
        ws.axial[c] = axial if T > 0.0 else 0.0
        energy += 0.5 * T * T / axial
        for k in range(ws.r.shape[0]):
            ws.r[k] += T * ws.G[c, 3 * FIXED + k]
    return energy


@njit(cache=True, error_model="numpy")
def _start(q: Array, mass: Array, inertia: float, nodal: Array, r: Array) -> float:
    """Start r with inertia, virtual springs and external forces of (*); return their potential [J]."""
    energy = 0.0
    for k in range(r.shape[0]):
        i, a, g = k // SIZE, k % SIZE, 3 * FIXED + k
        force = 0.0
        if inertia != 0.0:
            for b in range(SIZE):
                force += mass[i, a, b] * (q[g - a + b] - nodal[Q_FREE, g - a + b])
            force *= inertia
            energy += 0.5 * force * (q[g] - nodal[Q_FREE, g])
        spring = nodal[SPRING, g] * (q[g] - nodal[SPRING_AT, g])
        energy += 0.5 * spring * (q[g] - nodal[SPRING_AT, g]) - nodal[FORCE, g] * q[g]
        r[k] = force + spring - nodal[FORCE, g]
    return energy


@njit(cache=True, error_model="numpy")
def residual(model: Model, q: Array, drive: Array, load: Load, ws: Workspace) -> float:
    """Fill ``ws`` with residual, cable gradients, lengths and tensions at ``q``.

    Args:
        model: Robot arrays.
        q: Node positions (3 n_nodes,) [m].
        drive: Drive lengths d (m,) [m].
        load: Integration rule, virtual springs and external forces.
        ws: Output arrays.

    Returns:
        The incremental potential [J] whose gradient is r.
    """
    energy = _start(q, model.mass, load.inertia, load.nodal, ws.r)
    energy += _add_bars(q, model.bar_nodes, model.bars, load.w, load.bar_before, ws.r)
    return energy + _add_cables(model, q, drive, load, ws)


@njit(cache=True, error_model="numpy")
def fill_tangent(model: Model, q: Array, load: Load, ws: Workspace) -> None:
    """Fill ``ws.K`` at ``q``, where :func:`residual` has been evaluated last."""
    tangent.start(ws.K, model.mass, load.inertia, load.nodal[SPRING])
    tangent.add_bars(ws.K, q, model.bar_nodes, model.bars, load.w, load.bar_before)
    tangent.add_cables(ws.K, q, model.first_hole, model.hole_nodes, model.hole_weights, ws.tension)


@njit(cache=True, error_model="numpy")
def assemble(
    model: Model, q: Array, drive: Array, load: Load, ws: Workspace, with_tangent: bool | np.bool_
) -> float:
    """Evaluate :func:`residual` and, if wanted, :func:`fill_tangent`; returns the potential [J]."""
    energy = residual(model, q, drive, load, ws)
    if with_tangent:
        fill_tangent(model, q, load, ws)
    return energy

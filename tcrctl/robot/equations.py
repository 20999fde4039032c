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

from typing import Any, NamedTuple

import numpy as np

from tcrctl.elements import bar, rubbing_cable, sliding_cable
from tcrctl.elements.rubbing_cable import Slip, Stretches
from tcrctl.numerics.block_banded import padded
from tcrctl.numerics.kernel import kernel, part
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
        cable_before: (l + d)_before of the cables (m,) [m]; not read where cables rub.
        slip: Where the cables' material lies in their holes; None: without friction it slips freely.
    """

    inertia: float
    w: float
    nodal: Array
    bar_before: Array
    cable_before: Array
    slip: Slip | None


class Workspace(NamedTuple):
    """Arrays that assembly and solves fill; allocated once by :func:`make_workspace`.

    Attributes:
        K: Block-banded part of the tangent (n_modules, w + 1, 12, 12) [N/m].
        U: Its Cholesky factor, same shape.
        r: Residual of (*) for the free coordinates (n_free,) [N].
        G: ∂l/∂q (m, 3 n_nodes); of groups of stretches where cables rub.
        tension: λ (m,) [N]; that at the drives where cables rub.
        axial: k_c = ∂λ/∂(l + d) of taut cables, 0 of slack ones (m,) [N/m].
        length: Path lengths l (m,) [m].
        columns: Cable columns and right-hand side of ``linear.couple``, then zeros (n_free, padded(m + 1)).
        small: Its factor of the cable coupling (m, m).
        stretches: Of cables that rub; None without friction.
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
    stretches: Stretches | None


def _stretches(model: Model, rows: int) -> Stretches:
    """Allocate the arrays of cables that rub, ``rows`` groups of stretches at most."""
    holes, size = model.hole_nodes.shape[0], SIZE * model.mass.shape[0]
    return Stretches(
        length=np.zeros(holes),
        direction=np.zeros((holes, 3)),
        tension=np.zeros(holes),
        axial=np.zeros(holes),
        stiffness=np.ones(holes),
        wanted=np.zeros(holes),
        alone=np.zeros(holes),
        knots=np.zeros((2, 4 * holes + 4)),
        groups=np.zeros(1, dtype=np.int64),
        columns=np.zeros(size * padded(rows + 1)),
        small=np.zeros(rows * rows),
    )


def make_workspace(model: Model, *, rubbing: bool = False) -> Workspace:
    """Allocate the arrays for ``model``; ``rubbing``: for loads with slip."""
    n, m = model.mass.shape[0], model.cables.shape[0]
    if rubbing:
        m = max(m, model.hole_nodes.shape[0] // 2)
    shape = (n, model.bandwidth + 1, SIZE, SIZE)
    return Workspace(
        K=np.zeros(shape),
        U=np.zeros(shape),
        r=np.zeros(SIZE * n),
        G=np.zeros((m, SIZE * (n + 1))),
        tension=np.zeros(model.cables.shape[0]),
        axial=np.zeros(m),
        length=np.zeros(model.cables.shape[0]),
        columns=np.zeros((SIZE * n, padded(m + 1))),
        small=np.zeros((m, m)),
        stretches=_stretches(model, m) if rubbing else None,
    )


@part(error_model="numpy")
def _add_force(r: Array, node: int, x: float, y: float, z: float) -> None:
    """Add a force to the residual of a free node."""
    if node >= FIXED:
        first = 3 * (node - FIXED)
        r[first] += x
        r[first + 1] += y
        r[first + 2] += z


@part(error_model="numpy")
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


@part(error_model="numpy")
def _pull(r: Array, nodes: np.ndarray, weights: Array, hole: int, T: float, e: Array) -> None:
    """Add tension T along e, the direction of the stretch before, at ``hole`` to the residual."""
    for i in range(3):
        f = T * weights[hole, i]
        if f != 0.0:
            _add_force(r, nodes[hole, i], f * e[0], f * e[1], f * e[2])


@part(error_model="numpy")
def _group_row(model: Model, s: Stretches, start: int, end: int, row: Array) -> None:
    """Fill ``row`` (3 n_nodes,) with the gradient of the length of stretches ``start`` .. ``end``."""
    for k in range(row.shape[0]):
        row[k] = 0.0
    for stretch in range(start, end + 1):
        for side in range(2):
            sign, hole = 2.0 * side - 1.0, stretch - 1 + side
            for i in range(3):
                f, node = sign * model.hole_weights[hole, i], 3 * model.hole_nodes[hole, i]
                for a in range(3):
                    row[node + a] += f * s.direction[stretch, a]


@part(error_model="numpy")
def _add_groups(model: Model, c: int, ws: Workspace, s: Stretches) -> None:
    """Add the groups of cable ``c``: one stretch goes into the banded part, several share a row."""
    first, end = model.first_hole[c], model.first_hole[c + 1] - 1
    while end > first:
        start = rubbing_cable.group_start(s, first, end)
        axial, inside = rubbing_cable.group_stiffness(s, start, end), max(start, first + 1)
        if inside == end:
            s.axial[end] = axial
        elif axial > 0.0:
            row = s.groups[0]
            s.groups[0] += 1
            ws.axial[row] = axial
            _group_row(model, s, inside, end, ws.G[row])
        end = start - 1


@part(error_model="numpy")
def _add_rubbing(model: Model, q: Array, drive: Array, slip: Slip, s: Stretches, ws: Workspace) -> float:
    """Add cables that rub in their holes to r, fill their stretches and groups; return their potential [J]."""
    cables, first = model.cables, model.first_hole
    rubbing_cable.measure(q, drive, first, model.hole_nodes, model.hole_weights, cables, s)
    energy = rubbing_cable.tensions(slip, cables, first, s)
    s.groups[0] = 0
    for c in range(drive.shape[0]):
        ws.tension[c], ws.length[c] = s.tension[first[c]], cables[c, sliding_cable.LEAD]
        for hole in range(first[c] + 1, first[c + 1]):
            ws.length[c] += s.length[hole]
            s.axial[hole] = 0.0
            _pull(ws.r, model.hole_nodes, model.hole_weights, hole, s.tension[hole], s.direction[hole])
            _pull(ws.r, model.hole_nodes, model.hole_weights, hole - 1, -s.tension[hole], s.direction[hole])
        _add_groups(model, c, ws, s)
    return energy


@part(error_model="numpy")
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


@part(error_model="numpy")
def _add_all_cables(
    model: Model,
    q: Array,
    drive: Array,
    load: Load,
    slip: Slip | None,
    stretches: Any,
    ws: Workspace,
) -> float:
    """Add the cables, with or without friction in their holes (then both are None): which, is compiled in."""
    if slip is None:
        return _add_cables(model, q, drive, load, ws)
    return _add_rubbing(model, q, drive, slip, stretches, ws)


@part(error_model="numpy")
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


@kernel(error_model="numpy")
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
    return energy + _add_all_cables(model, q, drive, load, load.slip, ws.stretches, ws)


@part(error_model="numpy")
def _add_cable_tangent(model: Model, q: Array, stretches: Stretches | None, ws: Workspace) -> None:
    """Add the banded part of the cables' tangent."""
    nodes, weights = model.hole_nodes, model.hole_weights
    if stretches is None:
        tangent.add_cables(ws.K, q, model.first_hole, nodes, weights, ws.tension)
    else:
        tangent.add_stretches(ws.K, model.first_hole, nodes, weights, stretches)


@part(error_model="numpy")
def fill_tangent(model: Model, q: Array, load: Load, ws: Workspace) -> None:
    """Fill ``ws.K`` at ``q``, where :func:`residual` has been evaluated last."""
    tangent.start(ws.K, model.mass, load.inertia, load.nodal[SPRING])
    tangent.add_bars(ws.K, q, model.bar_nodes, model.bars, load.w, load.bar_before)
    _add_cable_tangent(model, q, ws.stretches, ws)


@kernel(error_model="numpy")
def assemble(
    model: Model, q: Array, drive: Array, load: Load, ws: Workspace, with_tangent: bool | np.bool_
) -> float:
    """Evaluate :func:`residual` and, if wanted, :func:`fill_tangent`; returns the potential [J]."""
    energy = residual(model, q, drive, load, ws)
    if with_tangent:
        fill_tangent(model, q, load, ws)
    return energy

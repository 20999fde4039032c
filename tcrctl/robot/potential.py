"""Minimise the incremental potential: statics, time steps, prediction and estimator all end here.

The residual (*) of ``equations`` is the gradient of one scalar: inertia + elastic + gravity + dissipated
work. Newton's direction with a positive definite tangent is a descent direction of it, and an Armijo line
search makes every iteration go down, however stiff the rods and however far they rotate. The tangent is only
assembled where a step or a verdict on stability needs it. Source: [NW06] Alg. 3.1 and Sec. 3.4.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.numerics.kernel import kernel, part
from tcrctl.robot import linear
from tcrctl.robot.equations import Load, Workspace, fill_tangent, residual
from tcrctl.robot.model import Model
from tcrctl.robot.module import FIXED
from tcrctl.signals import Array

ARMIJO = 1e-4
#: Largest nodal displacement of one Newton step [m]: a third of a module, so that rods cannot turn over.
LONGEST_STEP = 0.02
SHORTEST_FRACTION = 1e-6
#: Rounding of the potential relative to its size; a step that changes it less than this is judged by r alone.
ROUNDING = 1e-12


class Outcome(NamedTuple):
    """Proof of a solve.

    Attributes:
        converged: Largest nodal force is within the tolerance and, if demanded, the tangent is stable.
        iterations: Newton iterations.
        residual: Largest component of r [N].
        shift: Last diagonal shift that the tangent needed [N/m]; 0 for a stable solution.
    """

    converged: bool
    iterations: int
    residual: float
    shift: float


@part(error_model="numpy")
def _largest(x: Array) -> float:
    """Return the largest magnitude in x; NaN if there is one."""
    out = 0.0
    for value in x:
        if not abs(value) <= out:
            out = abs(value)
    return out


@part(error_model="numpy")
def _search(
    model: Model, q: Array, drive: Array, load: Load, ws: Workspace, p: Array, start: float
) -> tuple[bool, float]:
    """Move ``q`` along ``p`` (n_free,) until Armijo's rule holds; returns (found, potential there)."""
    slope = 0.0
    for i in range(p.shape[0]):
        slope += ws.r[i] * p[i]
    before, longest = _largest(ws.r), _largest(p)
    fraction = min(1.0, LONGEST_STEP / longest) if longest > 0.0 else 1.0
    origin = q.copy()
    while fraction > SHORTEST_FRACTION:
        for i in range(p.shape[0]):
            q[3 * FIXED + i] = origin[3 * FIXED + i] + fraction * p[i]
        energy = residual(model, q, drive, load, ws)
        small = abs(fraction * slope) < ROUNDING * (1.0 + abs(start))
        if energy <= start + ARMIJO * fraction * slope or (small and _largest(ws.r) < before):
            return True, energy
        fraction *= 0.5
    for i in range(q.shape[0]):
        q[i] = origin[i]
    return False, start


@kernel(error_model="numpy")
def minimise(
    model: Model,
    q: Array,
    drive: Array,
    load: Load,
    ws: Workspace,
    tolerance: float,
    limit: int | np.int64,
    stable: bool | np.bool_,
) -> Outcome:
    """Move ``q`` (in place) to a minimum of the incremental potential.

    Args:
        model: Robot arrays.
        q: Node positions, start and result (3 n_nodes,) [m].
        drive: Drive lengths (m,) [m].
        load: Integration rule, virtual springs, external forces.
        ws: Workspace; holds r, G, λ at the result, and K if ``stable``.
        tolerance: Largest nodal force accepted [N].
        limit: Newton iterations allowed. Kernels pass it and the next as ``np.int64`` and ``np.bool_``: a
            literal would make numba compile a second copy.
        stable: Also factor the tangent at the result into ``ws.U`` and demand that it is positive definite.

    Returns:
        An :class:`Outcome`.
    """
    shift = 0.0
    largest = np.inf
    iteration = 0
    p = np.empty(ws.r.shape[0])
    energy = residual(model, q, drive, load, ws)
    for iteration in range(limit + 1):
        largest = _largest(ws.r)
        done = largest <= tolerance
        if not done or stable:
            fill_tangent(model, q, load, ws)
            shift = linear.factor_shifted(ws.K, ws.U)
        if done:
            return Outcome(shift == 0.0 or not stable, iteration, largest, shift)
        if shift < 0.0 or iteration == limit:
            break
        linear.solve(linear.in_use(ws, ws.stretches), ws.r, p)
        for i in range(p.shape[0]):
            p[i] = -p[i]
        found, energy = _search(model, q, drive, load, ws, p, energy)
        if not found:
            break
    return Outcome(False, iteration, largest, shift)

"""Minimise the incremental potential: statics, time steps, prediction and estimator all end here.

The residual (*) of ``equations`` is the gradient of one scalar: inertia + elastic + gravity + dissipated work.
Newton's direction with a positive definite tangent is a descent direction of it, and an Armijo line search
makes every iteration go down, however stiff the rods and however far they rotate.
Source: [NW06] Alg. 3.1 and Sec. 3.4. Flags are passed as ``np.bool_`` because a literal True or False would make
numba compile a second copy of the callee.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from tcrctl.robot import linear
from tcrctl.robot.equations import Load, Workspace, assemble
from tcrctl.robot.model import FIXED, Model
from tcrctl.signals import Array

ARMIJO = 1e-4
#: Largest nodal displacement of one Newton step [m]: about a third of a module, so that rods cannot turn over.
LONGEST_STEP = 0.02
SHORTEST_FRACTION = 1e-6
#: Rounding of the potential relative to its size; a step that changes it less than this is judged by r alone.
ROUNDING = 1e-12


class Outcome(NamedTuple):
    """Proof of a solve.

    Attributes:
        converged: Largest nodal force is within the tolerance and, if it was looked at, the tangent is stable.
        iterations: Newton iterations.
        residual: Largest component of r [N].
        shift: Last diagonal shift that the tangent needed [N/m]; 0 for a stable solution.
    """

    converged: bool
    iterations: int
    residual: float
    shift: float


@njit(cache=True, error_model="numpy")
def _largest(x: Array) -> float:
    """Largest magnitude in x; NaN if there is one."""
    out = 0.0
    for value in x:
        if not abs(value) <= out:
            out = abs(value)
    return out


@njit(cache=True, error_model="numpy")
def _search(
    model: Model, q: Array, drive: Array, load: Load, ws: Workspace, p: Array, start: float
) -> tuple[bool, float]:
    """Move ``q`` along ``p`` (12 n_modules,) until Armijo's rule holds; returns (found, potential there).

    The first trial assembles the tangent too, because it is nearly always accepted.
    """
    slope = 0.0
    for i in range(p.shape[0]):
        slope += ws.r[i] * p[i]
    residual, longest = _largest(ws.r), _largest(p)
    fraction = min(1.0, LONGEST_STEP / longest) if longest > 0.0 else 1.0
    origin = q.copy()
    first = np.bool_(True)
    while fraction > SHORTEST_FRACTION:
        for i in range(p.shape[0]):
            q[3 * FIXED + i] = origin[3 * FIXED + i] + fraction * p[i]
        energy = assemble(model, q, drive, load, ws, first)
        small = abs(fraction * slope) < ROUNDING * (1.0 + abs(start))
        if energy <= start + ARMIJO * fraction * slope or (small and _largest(ws.r) < residual):
            if not first:
                assemble(model, q, drive, load, ws, np.bool_(True))
            return True, energy
        first = np.bool_(False)
        fraction *= 0.5
    q[:] = origin
    return False, start


@njit(cache=True, error_model="numpy")
def minimise(
    model: Model, q: Array, drive: Array, load: Load, ws: Workspace, tolerance: float, limit: int, stable: bool
) -> Outcome:
    """Move ``q`` (in place) to a minimum of the incremental potential.

    Args:
        model: Robot arrays.
        q: Node positions, start and result (3 n_nodes,) [m].
        drive: Drive lengths (m,) [m].
        load: Integration rule, virtual springs, external forces.
        ws: Workspace; holds r, K, G, λ at the result.
        tolerance: Largest nodal force accepted [N].
        limit: Newton iterations allowed.
        stable: Also factor the tangent at the result into ``ws.U`` and demand that it is positive definite.

    Returns:
        An :class:`Outcome`.
    """
    shift = 0.0
    p = np.empty(ws.r.shape[0])
    energy = assemble(model, q, drive, load, ws, np.bool_(True))
    for iteration in range(limit + 1):
        residual = _largest(ws.r)
        done = residual <= tolerance
        if not done or stable:
            shift = linear.factor_shifted(ws.K, ws.U)
        if done:
            return Outcome(shift == 0.0 or not stable, iteration, residual, shift)
        if shift < 0.0 or iteration == limit:
            break
        linear.solve(ws, ws.r, p)
        for i in range(p.shape[0]):
            p[i] = -p[i]
        found, energy = _search(model, q, drive, load, ws, p, energy)
        if not found:
            break
    return Outcome(False, iteration, _largest(ws.r), shift)

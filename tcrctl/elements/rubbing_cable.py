"""A cable that rubs in its holes: capstan law with real sticking, in the form of one convex problem per step.

The cable is a chain of stretches: stretch i ends at hole i (stretch 0 is the lead, from the actuator to the base
ring), and material may slip through every hole but the last, which is the anchor. With the elongation e_i of a
stretch at slips that have not moved, and the slips s_i of one internal step, a cable's incremental potential is

    min_s  Σ_i k_i/2 (e_i + s_i - s_(i-1))₊²  +  Σ_i F_i |s_i|,     F_i = min(T_i, T_(i+1)) (exp(μ θ_i) - 1) + drag

F_i is lagged: it belongs to the tensions T and wrap angles θ of the last step, which makes the problem convex, and
dissipation F_i |s_i| never negative. Its dual is a separable quadratic in the tensions under
|T_i - T_(i+1)| <= F_i, T >= 0, solved exactly by one pass along the chain (dynamic programming on piecewise linear
derivatives): holes whose bound is not active *stick*, s_i = 0 to the last bit. Stretches between sticking holes
form groups whose tensions move together, in series: 1 / k = Σ 1 / k_i. Source of the capstan law: [SC26].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.elements import sliding_cable
from tcrctl.numerics.kernel import kernel, part
from tcrctl.signals import Array

#: Columns of the friction of a hole (n_holes, 3): coefficient μ, least wrap angle [rad], drag [N].
COEFFICIENT, LEAST_WRAP, DRAG = range(3)


class Slip(NamedTuple):
    """Where the material of all cables lies, and what holds it there; changed in place, all arrays (n_holes,).

    Attributes:
        holes: Friction of every hole (n_holes, 3), columns as above; anchors are not read.
        stiffness: k_i = EA / rest length of the stretch that ends at hole i [N/m].
        rest: Its unstretched length [m].
        tension: Its tension T_i [N].
        cap: F_i, largest difference of tension across hole i [N].
        before: Elongations at the start of the internal step [m], for the damper.
        rate: 1 element: w of backward Euler, dl/dt = w (e - before) [1/s]; 0 in statics.
    """

    holes: Array
    stiffness: Array
    rest: Array
    tension: Array
    cap: Array
    before: Array
    rate: Array


class Stretches(NamedTuple):
    """What one evaluation finds of every stretch; arrays (n_holes,) unless said.

    Attributes:
        length: Lengths [m]; leads with the drive length.
        direction: Unit vectors from hole i - 1 to hole i (n_holes, 3).
        tension: T_i [N].
        axial: Stiffness of a group that holds one stretch between two rings [N/m]; 0 of all others.
        stiffness: k_i with the damper of the rule [N/m].
        wanted: Tensions that the stretches would have if all holes stuck, may be negative [N].
        alone: T_i at which the chain up to i would rest if it ended there [N].
        knots: Derivative of the chain's cost by its last tension: places [N] and values [m] of its corners
            (2, 4 n + 4).
        groups: 1 element: rows of G in use.
        columns: Memory of the columns of a solve, flat.
        small: Memory of its coupling, flat.
    """

    length: Array
    direction: Array
    tension: Array
    axial: Array
    stiffness: Array
    wanted: Array
    alone: Array
    knots: Array
    groups: np.ndarray
    columns: Array
    small: Array


#: Stands for the infinite slope with which slackness ends the range of tensions at 0 [m].
WALL = 1e6


@part(error_model="numpy")
def _first_positive(y: Array, n: int) -> int:
    """Return the index of the first of n increasing values that is not negative; n if all are."""
    for i in range(n):
        if y[i] >= 0.0:
            return i
    return n


@part(error_model="numpy")
def _root(x: Array, y: Array, n: int, right: float) -> float:
    """Find the zero of the increasing function through n corners (x, y); y[0] < 0, slope ``right`` at the end."""
    i = _first_positive(y, n)
    if i == n:
        return float(x[n - 1] - y[n - 1] / right)
    return float(x[i - 1] - y[i - 1] * (x[i] - x[i - 1]) / (y[i] - y[i - 1]))


@part(error_model="numpy")
def _widen(x: Array, y: Array, n: int, z: float, F: float) -> int:
    """Put a hole that holds up to F behind the chain: the function moves down by F below its root z, up above."""
    i = _first_positive(y, n)
    for k in range(n - 1, i - 1, -1):
        x[k + 2], y[k + 2] = x[k] + F, y[k]
    for k in range(i):
        x[k] -= F
    x[i], y[i] = z - F, 0.0
    x[i + 1], y[i + 1] = z + F, 0.0
    return n + 2


@part(error_model="numpy")
def _only_taut(x: Array, y: Array, n: int, right: float) -> int:
    """Let the function end at tension 0 with a wall; returns the new number of corners."""
    i = 0
    while i < n and x[i] <= 0.0:
        i += 1
    if i == n:
        at = y[n - 1] - right * x[n - 1]
    elif i == 0:
        at = y[0]  # cannot be: the wall of the last stretch lies at or below -F
    else:
        at = y[i - 1] - x[i - 1] * (y[i] - y[i - 1]) / (x[i] - x[i - 1])
    shift = 2 - i
    if shift > 0:
        for k in range(n - 1, i - 1, -1):
            x[k + shift], y[k + shift] = x[k], y[k]
    else:
        for k in range(i, n):
            x[k + shift], y[k + shift] = x[k], y[k]
    x[0], y[0], x[1], y[1] = 0.0, -WALL, 0.0, at
    return n + shift


@part(error_model="numpy")
def solve_chain(s: Stretches, cap: Array, first: int, last: int) -> None:
    """Solve one cable, stretches ``first`` .. ``last``: fills tension and alone from wanted and stiffness."""
    x, y = s.knots[0], s.knots[1]
    x[0], y[0], x[1], y[1] = 0.0, -WALL, 0.0, -s.wanted[first] / s.stiffness[first]
    n, right = 2, 1.0 / s.stiffness[first]
    for hole in range(first, last + 1):
        s.alone[hole] = _root(x, y, n, right)
        if hole < last:
            n = _widen(x, y, n, s.alone[hole], cap[hole])
            n = _only_taut(x, y, n, right)
            k = s.stiffness[hole + 1]
            for i in range(n):
                y[i] += (x[i] - s.wanted[hole + 1]) / k
            right += 1.0 / k
    s.tension[last] = s.alone[last]
    for hole in range(last - 1, first - 1, -1):
        T, F = s.tension[hole + 1], cap[hole]
        s.tension[hole] = min(max(s.alone[hole], T - F), T + F)


@part(error_model="numpy")
def measure_leads(drive: Array, first_hole: np.ndarray, cables: Array, s: Stretches) -> None:
    """Fill the lengths of the leads, from the actuators to the base ring."""
    for c in range(drive.shape[0]):
        s.length[first_hole[c]] = cables[c, sliding_cable.LEAD] + drive[c]


@kernel(error_model="numpy")
def measure(
    q: Array,
    drive: Array,
    first_hole: np.ndarray,
    nodes: np.ndarray,
    weights: Array,
    cables: Array,
    s: Stretches,
) -> None:
    """Fill lengths and directions of all stretches; arguments as in ``sliding_cable``."""
    measure_leads(drive, first_hole, cables, s)
    for c in range(drive.shape[0]):
        for hole in range(first_hole[c] + 1, first_hole[c + 1]):
            length, ex, ey, ez = sliding_cable.segment(q, nodes, weights, hole - 1)
            s.length[hole] = length
            s.direction[hole, 0], s.direction[hole, 1], s.direction[hole, 2] = ex, ey, ez


@part(error_model="numpy")
def tensions(slip: Slip, cables: Array, first_hole: np.ndarray, s: Stretches) -> float:
    """Fill tensions of all stretches from their lengths; returns the incremental potential of all cables [J].

    Args:
        slip: State at the start of the internal step.
        cables: Parameters (m, 4), columns as in ``sliding_cable``; the damper acts on every stretch with c / k.
        first_hole: First hole of every cable, and the end (m + 1,).
        s: Lengths in, tensions out.
    """
    energy = 0.0
    for c in range(cables.shape[0]):
        first, last = first_hole[c], first_hole[c + 1] - 1
        b = slip.rate[0] * cables[c, sliding_cable.DAMPING] / cables[c, sliding_cable.STIFFNESS]
        for hole in range(first, last + 1):
            s.stiffness[hole] = slip.stiffness[hole] * (1.0 + b)
            elongation = s.length[hole] - slip.rest[hole] - b * slip.before[hole] / (1.0 + b)
            s.wanted[hole] = s.stiffness[hole] * elongation
        solve_chain(s, slip.cap, first, last)
        for hole in range(first, last + 1):
            T = s.tension[hole]
            energy += T * (s.wanted[hole] - 0.5 * T) / s.stiffness[hole]
    return energy


@part(error_model="numpy")
def group_start(s: Stretches, first: int, stretch: int) -> int:
    """Return the first stretch of the group that ends with ``stretch``: holes between them slip."""
    while stretch > first and s.tension[stretch - 1] != s.alone[stretch - 1]:
        stretch -= 1
    return stretch


@part(error_model="numpy")
def group_stiffness(s: Stretches, start: int, end: int) -> float:
    """Return stiffness of stretches ``start`` .. ``end`` in series [N/m]; 0 if slackness holds their tension."""
    if s.alone[end] <= 0.0:
        return 0.0
    compliance = 0.0
    for stretch in range(start, end + 1):
        compliance += 1.0 / s.stiffness[stretch]
    return float(1.0 / compliance)


@part(error_model="numpy")
def largest_friction(hole: Array, along: float, tension: float) -> float:
    """Return F [N], what a hole holds at most, by the capstan law [SC26].

    Args:
        hole: Its friction (3,), columns as above.
        along: Cosine of the angle between the stretches before and behind it.
        tension: The smaller one of their tensions [N].
    """
    wrap = max(np.arccos(min(along, 1.0)), hole[LEAST_WRAP])
    return float(hole[DRAG] + tension * np.expm1(hole[COEFFICIENT] * wrap))


@part(error_model="numpy")
def begin(slip: Slip, h: float, lead: Array, first_hole: np.ndarray, s: Stretches) -> None:
    """Start an internal step of size ``h`` [s]: elongations before it, and the caps of the holes there.

    Args:
        slip: State; its before, cap and rate are filled.
        h: Internal step [s].
        lead: Unit vector from the actuators to the base ring (3,).
        first_hole: First hole of every cable, and the end (m + 1,).
        s: Lengths and directions at the start of the internal step.
    """
    slip.rate[0] = 1.0 / h
    for c in range(first_hole.shape[0] - 1):
        first, last = first_hole[c], first_hole[c + 1] - 1
        for k in range(first, last + 1):
            slip.before[k] = s.length[k] - slip.rest[k]
            if k < last:
                along = 0.0
                for i in range(3):
                    along += (lead[i] if k == first else s.direction[k, i]) * s.direction[k + 1, i]
                smaller = min(slip.tension[k], slip.tension[k + 1])
                slip.cap[k] = largest_friction(slip.holes[k], along, smaller)


@part(error_model="numpy")
def finish(slip: Slip, cables: Array, first_hole: np.ndarray, s: Stretches) -> float:
    """Move the material through the holes to the end of an internal step; returns the work of friction Σ F |s| [J].

    A hole that sticks lets nothing through; a slack stretch takes what comes if it can.
    """
    work = 0.0
    for c in range(cables.shape[0]):
        first, last = first_hole[c], first_hole[c + 1] - 1
        b = slip.rate[0] * cables[c, sliding_cable.DAMPING] / cables[c, sliding_cable.STIFFNESS]
        moved = 0.0
        for k in range(first, last + 1):
            before, T = moved, s.tension[k]
            free = s.length[k] - slip.rest[k]
            elongation = T / s.stiffness[k] + b * slip.before[k] / (1.0 + b)
            sticks = T > 0.0 and s.alone[k] == T
            loose = T == 0.0 and free - before <= elongation
            moved = 0.0 if k == last or sticks or loose else before + elongation - free
            work += slip.cap[k] * abs(moved) if k < last else 0.0
            slip.rest[k] -= moved - before
            slip.tension[k] = T
    return work

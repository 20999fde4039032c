"""One generalized-alpha step of the robot's DAE (9), with sub-steps where Newton needs them.

(16) is solved for q_{k+1} by minimising the incremental potential; λ follows from the eliminated constraint
(17). Velocities and accelerations are affine in q_{k+1} by (12)-(14). Elongation rates in the dampers use the
trapezoidal rule, which keeps the second order and the symmetric tangent.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcrctl.elements import bar, rubbing_cable, sliding_cable
from tcrctl.elements.rubbing_cable import Slip
from tcrctl.numerics.generalized_alpha import coefficients
from tcrctl.numerics.kernel import kernel, part
from tcrctl.robot.equations import FORCE, Q_FREE, Load, Workspace
from tcrctl.robot.model import Model
from tcrctl.robot.module import SIZE
from tcrctl.robot.potential import Outcome, minimise
from tcrctl.signals import Array

#: Largest nodal force left by an internal step [N]; the weight of one module is 0.1 N.
TOLERANCE = 1e-6
MAX_ITERATIONS = 12
#: An internal step is cut in half at most this often.
MAX_HALVINGS = 8
#: For the sake of precision it is cut at most this often.
PRECISE_HALVINGS = 5
#: A step is doubled again when its error is below this part of the bound: an error of third order grows eightfold.
DOUBLED_BELOW = 0.1


class State(NamedTuple):
    """Dynamic state, changed in place; arrays over all nodes (3 n_nodes,), rows of the base stay constant.

    Attributes:
        q: Positions [m].
        v: Velocities [m/s].
        acceleration: q̈ [m/s2].
        auxiliary: The acceleration-like variable a of (14) [m/s2].
        drive: Drive lengths (m,) [m].
        slip: Where the cables' material lies in their holes; None: they do not rub.
    """

    q: Array
    v: Array
    acceleration: Array
    auxiliary: Array
    drive: Array
    slip: Slip | None


class Rule(NamedTuple):
    """How time is integrated.

    Attributes:
        h: Largest internal step [s].
        rho: Spectral radius of (15).
        bound: Largest error of an internal step [m], see :func:`error_share`; infinite: none is cut for it.
    """

    h: float
    rho: float
    bound: float = np.inf


class Scratch(NamedTuple):
    """Arrays of one internal step: predictors and the load of (*), and what one step leaves to the next.

    ``settled`` is 1 if the last one converged: then the workspace belongs to ``q``, else 0. ``halvings`` is how
    often the next one is cut in half.
    """

    q: Array
    q0: Array
    v0: Array
    drive: Array
    nodal: Array
    bar_before: Array
    bar_rate: Array
    cable_before: Array
    lead: Array
    settled: Array
    halvings: NDArray[np.int64]


def rest_state(q: Array, drive: Array, slip: Slip | None = None) -> State:
    """Make the state at rest in configuration ``q`` with ``drive``; copies both."""
    return State(q.copy(), np.zeros_like(q), np.zeros_like(q), np.zeros_like(q), drive.copy(), slip)


def make_scratch(model: Model) -> Scratch:
    """Allocate the arrays for ``model``."""
    size = SIZE * (model.mass.shape[0] + 1)
    bars = model.bars.shape[0]
    m = model.cables.shape[0]
    return Scratch(
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.zeros(m),
        np.zeros((4, size)),
        np.zeros(bars),
        np.zeros(bars),
        np.zeros(m),
        np.array([0.0, 0.0, -1.0]),
        np.zeros(1),
        np.zeros(1, dtype=np.int64),
    )


@kernel(error_model="numpy")
def lengths_before(
    model: Model, q: Array, v: Array, drive: Array, speed: Array, lag: float, s: Scratch, ws: Workspace
) -> None:
    """Fill s.bar_before and s.cable_before with l + lag dl/dt at (q, v) and (d, u)."""
    sliding_cable.path_gradients(
        q, model.first_hole, model.hole_nodes, model.hole_weights, model.cables, ws.length, ws.G
    )
    _bars_before(model, q, v, lag, s)
    _cables_before(v, drive, speed, lag, s, ws)


@part(error_model="numpy")
def _bars_before(model: Model, q: Array, v: Array, lag: float, s: Scratch) -> None:
    """Fill s.bar_before with l + lag dl/dt."""
    bar.lengths_and_rates(q, v, model.bar_nodes, s.bar_before, s.bar_rate)
    for b in range(s.bar_before.shape[0]):
        s.bar_before[b] += lag * s.bar_rate[b]


@part(error_model="numpy")
def _cables_before(v: Array, drive: Array, speed: Array, lag: float, s: Scratch, ws: Workspace) -> None:
    """Fill s.cable_before with l + d + lag (dl/dt + u), where ``ws`` has path lengths and gradients."""
    for c in range(drive.shape[0]):
        rate = speed[c]
        if lag != 0.0:
            for k in range(v.shape[0]):
                rate += ws.G[c, k] * v[k]
        s.cable_before[c] = ws.length[c] + drive[c] + lag * rate


@part(error_model="numpy")
def _known(q: Array, s: Scratch) -> bool:
    """Tell whether the last internal step converged, and to ``q``: then the workspace belongs to it."""
    if s.settled[0] == 0.0:
        return False
    same = True
    for k in range(q.shape[0]):
        same = same and q[k] == s.q[k]
    return same


@part(error_model="numpy")
def _begin_cables(
    model: Model,
    x: State,
    speed: Array,
    h: float,
    slip: Slip | None,
    stretches: Any,
    s: Scratch,
    ws: Workspace,
) -> None:
    """Start an internal step of the cables, whose geometry at x.q may be known from the end of the last one."""
    first, holes, weights, cables = model.first_hole, model.hole_nodes, model.hole_weights, model.cables
    known = _known(x.q, s)
    if slip is not None:
        if known:
            rubbing_cable.measure_leads(x.drive, first, cables, stretches)
        else:
            rubbing_cable.measure(x.q, x.drive, first, holes, weights, cables, stretches)
        rubbing_cable.begin(slip, h, s.lead, first, stretches)
    else:
        if not known:
            sliding_cable.path_gradients(x.q, first, holes, weights, cables, ws.length, ws.G)
        _cables_before(x.v, x.drive, speed, 0.5 * h, s, ws)


@part(error_model="numpy")
def _finish_slip(model: Model, slip: Slip | None, s: Any) -> None:
    """End an internal step of cables that rub."""
    if slip is not None:
        rubbing_cable.finish(slip, model.cables, model.first_hole, s)


@part(error_model="numpy")
def error_share(rho: float) -> float:
    """Return the error of an internal step over the way from its predicted end, at constant q̈, to its end.

    If q̈ changes linearly, by Δ, (12) ends β h² (1 - α_f) / (1 - α_m) Δ beside the prediction, and misses the true
    end by h² (β - 1/6) Δ. Source: [ZX91] for Newmark's rule, whose a is q̈.
    """
    c = coefficients(rho, 1.0)
    return abs(c.beta - 1.0 / 6.0) * (1.0 - c.alpha_m) / (c.beta * (1.0 - c.alpha_f))


@part(inline="always", error_model="numpy")  # compiled once, inside advance
def try_step(
    model: Model, x: State, speed: Array, h: float, rule: Rule, external: Array, ws: Workspace, s: Scratch
) -> tuple[Outcome, float]:
    """Try an internal step ``h`` [s]; changes ``x`` only if it converges within the bound; returns its error."""
    c = coefficients(rule.rho, h)
    _bars_before(model, x.q, x.v, 0.5 * h, s)
    _begin_cables(model, x, speed, h, x.slip, ws.stretches, s, ws)
    inertia = c.acceleration + model.damping * c.velocity
    for k in range(x.q.shape[0]):
        aux = (x.acceleration[k] - c.alpha_m * x.auxiliary[k]) / (1.0 - c.alpha_m)
        s.q0[k] = x.q[k] + h * x.v[k] + h * h * ((0.5 - c.beta) * x.auxiliary[k] + c.beta * aux)
        s.v0[k] = x.v[k] + h * ((1.0 - c.gamma) * x.auxiliary[k] + c.gamma * aux)
        s.q[k] = s.q0[k]
        s.nodal[Q_FREE, k] = s.q0[k] - (x.acceleration[k] + model.damping * s.v0[k]) / inertia
        s.nodal[FORCE, k] = external[k]
    for i in range(speed.shape[0]):
        s.drive[i] = x.drive[i] + h * speed[i]
    load = Load(inertia, 2.0 / h, s.nodal, s.bar_before, s.cable_before, x.slip)
    outcome = minimise(model, s.q, s.drive, load, ws, TOLERANCE, np.int64(MAX_ITERATIONS), np.bool_(False))
    error = _error(rule.rho, s)
    s.settled[0] = 1.0 if outcome.converged and error <= rule.bound else 0.0
    if s.settled[0] == 1.0:
        _finish_slip(model, x.slip, ws.stretches)
        for k in range(x.q.shape[0]):
            moved = s.q[k] - s.q0[k]
            aux = (x.acceleration[k] - c.alpha_m * x.auxiliary[k]) / (1.0 - c.alpha_m)
            aux += (1.0 - c.alpha_f) / (1.0 - c.alpha_m) * c.acceleration * moved
            x.auxiliary[k] = aux
            x.acceleration[k] += c.acceleration * moved
            x.v[k] = s.v0[k] + c.velocity * moved
            x.q[k] = s.q[k]
        for i in range(speed.shape[0]):
            x.drive[i] = s.drive[i]
    return outcome, error


@part(error_model="numpy")
def _error(rho: float, s: Scratch) -> float:
    """Return the error of a step from the predicted s.q0 to s.q [m]."""
    largest = 0.0
    for k in range(s.q.shape[0]):
        largest = max(largest, abs(s.q[k] - s.q0[k]))
    return error_share(rho) * largest


@kernel(error_model="numpy", nogil=True)
def advance(
    model: Model,
    x: State,
    speed: Array,
    duration: float,
    rule: Rule,
    external: Array,
    ws: Workspace,
    s: Scratch,
) -> tuple[bool, float, float, int]:
    """Advance the state in place by ``duration`` with constant drive speeds.

    Args:
        model: Robot arrays.
        x: State; on failure it holds the last internal step that converged.
        speed: Drive speeds u (m,) [m/s].
        duration: Time to advance [s].
        rule: How time is integrated.
        external: External force, gravity included (3 n_nodes,) [N].
        ws: Workspace; its tensions belong to the state at the end.
        s: Scratch arrays.

    Returns:
        (converged, residual [N], smallest internal step [s], Newton iterations).
    """
    done = 0.0
    residual = 0.0
    smallest = rule.h
    iterations = 0
    precise = rule.bound < np.inf
    halvings = s.halvings[0] if precise else 0
    while done < duration * (1.0 - 1e-9):
        h = min(rule.h / 2.0**halvings, duration - done)
        if precise:  # equal steps to the end: a short last one would start the next ones with another error
            h = (duration - done) / np.ceil((duration - done) / h - 1e-6)
        bound = rule.bound if halvings < PRECISE_HALVINGS else np.inf
        outcome, error = try_step(model, x, speed, h, Rule(rule.h, rule.rho, bound), external, ws, s)
        iterations += outcome.iterations
        residual = outcome.residual
        if s.settled[0] == 1.0:
            done += h
            if error < DOUBLED_BELOW * rule.bound:
                halvings = max(0, halvings - 1)
        else:
            halvings += 1
            if halvings > MAX_HALVINGS:
                return False, residual, smallest, iterations
            smallest = min(smallest, rule.h / 2.0**halvings)
    s.halvings[0] = halvings
    return True, residual, smallest, iterations

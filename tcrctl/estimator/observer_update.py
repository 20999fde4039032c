"""One update of the passive observer as a kernel: load, minimum, corrected end pose.

See ``passive_observer`` for what it means; here are the arrays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcrctl.numerics.copies import copy_vector
from tcrctl.numerics.kernel import kernel, part
from tcrctl.robot import pose
from tcrctl.robot.dynamics import Scratch, lengths_before
from tcrctl.robot.equations import Q_FREE, SPRING, SPRING_AT, Load, Workspace
from tcrctl.robot.model import Model
from tcrctl.robot.module import RING
from tcrctl.robot.potential import Outcome, minimise
from tcrctl.signals import Array

#: Largest nodal force left by an update [N]: against the virtual springs, 5 nanometres.
TOLERANCE = 1e-4
MAX_ITERATIONS = 30


class Body(NamedTuple):
    """The observed robot after an update.

    Attributes:
        q: Node positions (3 n_nodes,) [m].
        v: Node velocities (3 n_nodes,) [m/s].
        drive: Drive lengths (m,) [m].
        correction: Of the end pose (6,): position [m], normal.
    """

    q: Array
    v: Array
    drive: Array
    correction: Array


class Frame(NamedTuple):
    """What is seen.

    Attributes:
        nodes: Places of the markers (n_markers, 3) [m]; rows that are not seen are not read.
        seen: Which are seen (n_markers,).
        drive: Drive lengths (m,) [m].
    """

    nodes: Array
    seen: NDArray[np.bool_]
    drive: Array


class Observing(NamedTuple):
    """Numbers of all updates.

    Attributes:
        period: Control period [s].
        stiffness: Of a virtual spring when all markers are seen [N/m].
        rows: Rows of the nodes that carry markers (n_markers,).
        tip: Row of the first node of the tip ring.
        tip_marker: Its marker; the next two are those of the same ring.
        still: Drive speeds of a robot whose drives rest (m,) [m/s].
    """

    period: float
    stiffness: float
    rows: NDArray[np.int64]
    tip: int
    tip_marker: int
    still: Array


class Updated(NamedTuple):
    """An update with proof.

    Attributes:
        outcome: Of the solve; a body that was not solved for stays as it was.
        body: The robot now.
        pose: Corrected end position [m] and unit normal (6,).
        disturbance: Forces of the virtual springs (3 n_nodes,) [N].
        tip_seen: Whether the correction has moved on.
    """

    outcome: Outcome
    body: Body
    pose: Array
    disturbance: Array
    tip_seen: bool


@kernel(error_model="numpy")
def fill_load(model: Model, body: Body, frame: Frame, numbers: Observing, s: Scratch, ws: Workspace) -> Load:
    """Return the inertia of backward Euler, weight and virtual springs of one update, kept in ``s``."""
    period, count = numbers.period, 0
    inertia = 1.0 / period**2 + model.damping / period
    for k in range(body.q.shape[0]):
        s.nodal[Q_FREE, k] = body.q[k] + body.v[k] / (period * inertia)
    for marker in range(frame.seen.shape[0]):
        count += frame.seen[marker]
    share = count / frame.seen.shape[0]
    for marker in range(frame.seen.shape[0]):
        seen, first = frame.seen[marker], 3 * numbers.rows[marker]
        for i in range(3):
            s.nodal[SPRING, first + i] = numbers.stiffness * share**2 if seen else 0.0
            if seen:
                s.nodal[SPRING_AT, first + i] = frame.nodes[marker, i]
    lengths_before(model, body.q, body.v, body.drive, numbers.still, 0.0, s, ws)
    return Load(inertia, 1.0 / period, s.nodal, s.bar_before, s.cable_before, None)


@part(error_model="numpy")
def _end(q: Array, ring: int) -> Array:
    """Return position [m] and unit normal (6,) of a ring."""
    end, position, normal = np.empty(6), pose.position(q, ring), pose.normal(q, ring)
    for i in range(3):
        end[i], end[3 + i] = position[i], normal[i]
    return end


@part(error_model="numpy")
def _correct(frame: Frame, numbers: Observing, end: Array, correction: Array, blend: float) -> bool:
    """Move the correction (6,) towards what the markers of the tip ring say of the model's end; False if unseen."""
    first = numbers.tip_marker
    for marker in range(first, first + RING):
        if not frame.seen[marker]:
            return False
    seen = _end(frame.nodes[first : first + RING].ravel(), 0)
    for i in range(6):
        correction[i] += blend * (seen[i] - end[i] - correction[i])
    return True


@part(error_model="numpy")
def _corrected(end: Array, correction: Array) -> Array:
    """Return the end (6,) with its correction, the normal as a unit vector."""
    out = end + correction
    size = np.sqrt(out[3] ** 2 + out[4] ** 2 + out[5] ** 2)
    for i in range(3, 6):
        out[i] /= size
    return out


@kernel(error_model="numpy")
def update(
    model: Model, before: Body, frame: Frame, numbers: Observing, blend: float, s: Scratch, ws: Workspace
) -> Updated:
    """Step the model to the time of a frame.

    Args:
        model: Robot arrays.
        before: The body at the last update; unchanged.
        frame: What is seen.
        numbers: Of all updates.
        blend: Part of the way that the correction goes.
        s: Scratch with the weight in its load.
        ws: Workspace; holds tensions afterwards.
    """
    load = fill_load(model, before, frame, numbers, s, ws)
    q, v, drive, correction = before.q.copy(), before.v.copy(), before.drive.copy(), before.correction.copy()
    outcome = minimise(model, q, frame.drive, load, ws, TOLERANCE, np.int64(MAX_ITERATIONS), np.bool_(False))
    if outcome.converged:
        for k in range(q.shape[0]):
            v[k] = (q[k] - before.q[k]) / numbers.period
        copy_vector(frame.drive, drive)
    else:
        copy_vector(before.q, q)
    end, disturbance = _end(q, numbers.tip), np.empty(q.shape[0])
    tip_seen = _correct(frame, numbers, end, correction, blend)
    for k in range(q.shape[0]):
        disturbance[k] = s.nodal[SPRING, k] * (s.nodal[SPRING_AT, k] - q[k])
    return Updated(outcome, Body(q, v, drive, correction), _corrected(end, correction), disturbance, tip_seen)

"""The model at rest, followed from drives to drives: equilibrium, outputs there, and their static gain.

q_eq(d)        stable equilibrium of the model at the drives d
y(q_eq(d))     outputs there: end position, normal, twist, tensions
S = ∂y/∂d      static gain
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from tcrctl.elements.sliding_cable import STIFFNESS
from tcrctl.numerics.copies import copy_rows, copy_vector
from tcrctl.numerics.kernel import kernel
from tcrctl.robot import linear, pose
from tcrctl.robot.equations import Load, Workspace
from tcrctl.robot.equilibrium import TOLERANCE as _ROUNDING
from tcrctl.robot.model import Model
from tcrctl.robot.module import FIXED
from tcrctl.robot.potential import Outcome, minimise
from tcrctl.robot.response import POSE_ROWS
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

#: Largest nodal force left in the model's equilibrium [N]: 1e-5 N moves the softest mode by 3 micrometres.
TOLERANCE: Final = 1e-5
#: The same where the tolerance itself must not show [N].
SHARP: Final = _ROUNDING
MAX_ITERATIONS: Final = 40


class StaticMap(NamedTuple):
    """The model at rest at certain drives, changed in place; see :func:`follow`.

    Attributes:
        equilibrium: q_eq (3 n_nodes,) [m].
        drive: Drives it belongs to (m,) [m].
        gain: ∂q_eq/∂d (n_free, m).
    """

    equilibrium: Array
    drive: Array
    gain: Array


def rest_map(robot: Robot) -> StaticMap:
    """Return the static map of a robot at zero drive."""
    return StaticMap(robot.rest.q.copy(), np.zeros(robot.n_cables), robot.rest.gain.copy())


@kernel(error_model="numpy")
def follow(model: Model, load: Load, ws: Workspace, at: StaticMap, drive: Array, tolerance: float) -> Outcome:
    """Move the model's equilibrium to other drives, starting where its static gain points to.

    Args:
        model: Robot arrays.
        load: Static load.
        ws: Workspace; afterwards it belongs to the new equilibrium.
        at: Where the model is, with the taut cables in its gain; moved.
        drive: The new drives (m,) [m].
        tolerance: Largest nodal force accepted [N].
    """
    q = at.equilibrium.copy()
    for k in range(at.gain.shape[0]):
        for c in range(at.drive.shape[0]):
            q[3 * FIXED + k] += at.gain[k, c] * (drive[c] - at.drive[c])
    outcome = minimise(model, q, drive, load, ws, tolerance, int(MAX_ITERATIONS), bool(1))
    if outcome.converged:
        copy_vector(q, at.equilibrium)
        copy_vector(drive, at.drive)
        linear.couple(ws, ws.r)
        linear.drive_gain(ws, at.gain)
    return outcome


@kernel(error_model="numpy")
def static_outputs(model: Model, ws: Workspace, at: StaticMap, tip: int) -> tuple[Array, Array]:
    """Return the outputs at rest (7 + m,) and their derivatives by the drives (7 + m, m).

    Cables count as two-sided, so that a slack one still has authority over its (negative) tension.

    Args:
        model: Robot arrays.
        ws: Workspace as :func:`follow` left it; its axial stiffness is changed.
        at: Where the model is.
        tip: Row of the first node of the tip ring.
    """
    m, first = model.cables.shape[0], 3 * (tip - FIXED)
    rest, gain = np.empty(POSE_ROWS + m), np.empty((POSE_ROWS + m, m))
    copy_vector(pose.position(at.equilibrium, tip), rest[:3])
    copy_vector(pose.normal(at.equilibrium, tip), rest[3:6])
    rest[6] = pose.twist(at.equilibrium, tip)
    copy_vector(ws.tension, rest[POSE_ROWS:])
    for c in range(m):
        ws.axial[c] = model.cables[c, STIFFNESS]
    linear.couple(ws, ws.r)
    answer = np.empty((ws.r.shape[0], m))
    linear.drive_gain(ws, answer)
    copy_rows(np.dot(pose.output_matrix(at.equilibrium, tip), answer[first : first + 9]), gain[:POSE_ROWS])
    copy_rows(linear.tension_gain(ws, answer), gain[POSE_ROWS:])
    return rest, gain

"""Cables as they lie in their holes before anything has moved: without any friction force."""

from __future__ import annotations

import numpy as np

from tcrctl.elements import rubbing_cable, sliding_cable
from tcrctl.elements.rubbing_cable import Slip
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.model import Model
from tcrctl.signals import Array


def unworn(model: Model, q: Array, drive: Array, tension: Array, holes: Array) -> Slip:
    """Return the slip of cables that lie in their holes without any friction force: one tension along each.

    Args:
        model: Robot arrays.
        q: Node positions (3 n_nodes,) [m].
        drive: Drive lengths (m,) [m].
        tension: Tensions (m,) [N].
        holes: Friction of every hole (n_holes, 3), columns as in ``elements.rubbing_cable``.
    """
    s = make_workspace(model, rubbing=True).stretches
    assert s is not None
    cables, first = model.cables, model.first_hole
    rubbing_cable.measure(q, drive, first, model.hole_nodes, model.hole_weights, cables, s)
    along = np.repeat(tension, np.diff(first))
    ea = np.repeat(cables[:, sliding_cable.STIFFNESS] * cables[:, sliding_cable.REST], np.diff(first))
    rest = s.length / (1.0 + along / ea)
    slack = (
        np.repeat(cables[:, sliding_cable.REST], np.diff(first))
        * s.length
        / np.repeat(np.add.reduceat(s.length, first[:-1]), np.diff(first))
    )
    rest = np.where(along > 0.0, rest, slack)
    zeros = np.zeros_like(along)
    return Slip(holes.copy(), ea / rest, rest, along, zeros, zeros.copy(), np.zeros(1))


def lead_direction(q: Array) -> Array:
    """Return the unit vector from the actuators to the base ring (3,): along the base's axis, towards the robot."""
    r = q[:9].reshape(3, 3)
    up = np.cross(r[1] - r[0], r[2] - r[0])
    return np.asarray(-up / np.linalg.norm(up))

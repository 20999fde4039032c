"""One cable along an arc of fixed rings, whose drive is moved step by step: the law of the holes alone."""

from __future__ import annotations

import numpy as np

from support import mechanics
from tcrctl.elements import rubbing_cable
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.unworn import unworn

RINGS, SPACING, STIFFNESS, TENSION = 12, 0.05, 1500.0, 5.0
#: Slips up to this are the rounding of lengths [m].
ROUNDING = 1e-14
CENTRE = (1 / 3, 1 / 3, 1 / 3)


def arc(turn_deg, rings=RINGS):
    """Node positions (3 n_nodes,) [m] of rings on an arc that turns by ``turn_deg`` from one to the next."""
    direction, place, nodes = np.array([0.0, 0.0, -1.0]), np.zeros(3), []
    turn = mechanics.turned(np.array([0.0, np.radians(turn_deg), 0.0]))
    for _ in range(rings + 1):
        nodes += [place] * 4
        direction = turn @ direction
        place = place + SPACING * direction
    return np.array(nodes).ravel()


class Chain:
    """A cable from the actuator to the last ring.

    Attributes:
        slip: Its material.
        stretches: What the last step found.
        work: Work of friction so far [J].
    """

    def __init__(self, q, *, mu, least_wrap=0.0, drag=0.0, tension=TENSION, rings=RINGS, damping=0.0):
        path = 0.1 + SPACING * rings
        holes = [(ring, CENTRE) for ring in range(rings + 1)]
        rest = path / (1.0 + tension / (STIFFNESS * path))
        self.model = mechanics.elements_only(rings, cables=[(holes, rest, STIFFNESS, damping, 0.1)])
        friction = np.tile([mu, least_wrap, drag], (rings + 1, 1))
        self.q, self.drive, self.work = q, np.zeros(1), 0.0
        self.slip = unworn(self.model, q, self.drive, np.array([tension]), friction)
        self.stretches = make_workspace(self.model, rubbing=True).stretches
        self.energy = self._energy()

    def _measure(self):
        m = self.model
        rubbing_cable.measure(
            self.q, self.drive, m.first_hole, m.hole_nodes, m.hole_weights, m.cables, self.stretches
        )

    def _energy(self):
        """Elastic energy [J]."""
        return 0.5 * float(np.sum(self.slip.tension**2 / self.slip.stiffness))

    def step(self, drive, q=None, h=1e-3):
        """Go to another drive length [m], and shape if given; returns which holes let material through."""
        m, before = self.model, self.slip.rest.copy()
        self._measure()
        rubbing_cable.begin(self.slip, h, np.array([0.0, 0.0, -1.0]), m.first_hole, self.stretches)
        self.drive, self.q = np.array([drive]), self.q if q is None else q
        self._measure()
        rubbing_cable.tensions(self.slip, m.cables, m.first_hole, self.stretches)
        self.work += rubbing_cable.finish(self.slip, m.cables, m.first_hole, self.stretches)
        return np.abs(np.cumsum(before - self.slip.rest)[:-1]) > ROUNDING

    @property
    def tension(self):
        """Tensions of the stretches from the drive on [N]."""
        return self.slip.tension

    def wraps(self):
        """Angles by which the cable turns in its holes [rad]."""
        e = self.stretches.direction.copy()
        e[0] = [0.0, 0.0, -1.0]
        return np.arccos(np.clip(np.sum(e[:-1] * e[1:], axis=1), -1.0, 1.0))

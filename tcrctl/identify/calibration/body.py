"""Unknowns -> kernel arrays of the robot that they describe; ``robot_values`` writes it as a robot file."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from tcrctl.elements import bar, sliding_cable, torus
from tcrctl.identify.calibration.unknowns import Unknowns, spring_group_of
from tcrctl.identify.statics import Side, Twins
from tcrctl.robot.description import RobotDescription, cable_routes
from tcrctl.robot.equilibrium import static_load, with_rest_lengths
from tcrctl.robot.model import freeze, gravity_force, undeformed
from tcrctl.robot.module import FIXED, NODES, RIGID_BARS, RING, mass_block, straight_stack
from tcrctl.robot.robot import Robot, retensioned
from tcrctl.signals import Array

#: Half step of numerical derivatives, in standard deviations.
HALF_STEP: Final = 0.02
#: The same of the tension factor whose rest lengths are looked for.
TENSION_STEP: Final = 0.02


class Body:
    """A robot whose parts may all be a little different from what its file says."""

    def __init__(self, description: RobotDescription, robot: Robot, unknowns: Unknowns) -> None:
        """Take a robot as described, as built, and what is unknown of it.

        Raises:
            NoEquilibriumError: If it has no shape under a little more or less tension.
        """
        self.description, self.robot, self.unknowns = description, robot, unknowns
        d, self._model = description, robot.model
        self._nodes = straight_stack(d.modules)
        self._spring_group = spring_group_of(d)
        cells = [mass_block(d.modules.of(m)) for m in range(1, d.modules.count + 1)]
        self._cell = np.stack([np.kron(block, np.eye(3)) for block in cells])
        self._angles = np.array([angle for route in cable_routes(d) for _, angle in route.holes])
        self._gravity = np.array(d.gravity_m_s2, dtype=float)
        self._looser = self._rest_by_tension()

    def _rest_by_tension(self) -> Array:
        """How rest lengths follow a factor on all initial tensions (m,) [m]."""
        ends = [
            retensioned(self.robot, np.full(self.robot.n_cables, 1.0 + sign * TENSION_STEP)).model.cables
            for sign in (-1.0, 1.0)
        ]
        return np.asarray((ends[1] - ends[0])[:, sliding_cable.REST] / (2.0 * TENSION_STEP))

    def rest_lengths(self, x: Array) -> Array:
        """Return rest lengths (m,) [m]: a cable that a drive has taken in at its zero is shorter."""
        u = self.unknowns
        rest = self._model.cables[:, sliding_cable.REST]
        return np.asarray(rest + self._looser * u.take(x, "tension") - u.take(x, "zeros"))

    def offsets(self, x: Array) -> Array:
        """Return how far the nodes of every moving module are beside their places (n_modules, 4, 3) [m]."""
        return self.unknowns.take(x, "geometry").reshape(-1, NODES, 3)

    def spring_factors(self, x: Array) -> Array:
        """Return factors on the modulus of every spring (n_springs,)."""
        own = self.unknowns.take(x, "joint_springs")[self._spring_group]
        return np.asarray((1.0 + self.unknowns.take(x, "springs")) * (1.0 + own))

    def mass_factors(self, x: Array) -> tuple[float, Array]:
        """Return the factor on all masses, and those on the mass of every module (n_modules,)."""
        density = 1.0 + float(self.unknowns.take(x, "density")[0])
        return density, np.asarray(density * (1.0 + self.unknowns.take(x, "masses")))

    def side(self, x: Array) -> Side:
        """Return the arrays, base and weight of the robot that x describes."""
        model = freeze(
            self._model._replace(mass=self._masses(x), bars=self._bars(x), hole_weights=self._hole_weights(x))
        )
        model = with_rest_lengths(model, self.rest_lengths(x))
        return Side(model, self._base(x), static_load(model, gravity_force(model, self._gravity)))

    def twins(self, x: Array) -> tuple[Twins, ...]:
        """Return the neighbours of x along every unknown that changes the robot, in their order."""
        found = []
        for i in self.unknowns.columns(robot=True):
            half = HALF_STEP * self.unknowns.prior[i]
            low, high = x.copy(), x.copy()
            low[i], high[i] = x[i] - half, x[i] + half
            found.append(Twins(self.side(low), self.side(high), 2.0 * half))
        return tuple(found)

    def _masses(self, x: Array) -> Array:
        density, modules = self.mass_factors(x)
        springs = self._model.mass - self._cell
        return np.asarray(density * springs + modules[:, None, None] * self._cell)

    def _bars(self, x: Array) -> Array:
        bars, pairs = self._model.bars.copy(), self._model.bar_nodes
        nodes = self._nodes.copy()
        nodes[FIXED:] += self.offsets(x).reshape(-1, 3)
        rigid = RIGID_BARS * self._model.mass.shape[0]
        length = np.linalg.norm(nodes[pairs[:rigid, 1]] - nodes[pairs[:rigid, 0]], axis=1)
        bars[:rigid, bar.STIFFNESS] *= bars[:rigid, bar.REST] / length
        bars[:rigid, bar.REST] = length
        bars[rigid:, bar.STIFFNESS] *= self.spring_factors(x)
        return bars

    def _hole_weights(self, x: Array) -> Array:
        angle = self._angles + self.unknowns.take(x, "holes")
        turns = angle[:, None] - np.arange(RING) * torus.TURN_THIRD
        return np.asarray(2.0 / 3.0 * np.cos(turns) + 1.0 / 3.0)

    def _base(self, x: Array) -> Array:
        tilt = self.unknowns.take(x, "tilt")
        if not tilt.any():
            return self.robot.rest.q[: 3 * FIXED].copy()
        return undeformed(self.hung(tilt))[: 3 * FIXED]

    def hung(self, tilt: Array) -> RobotDescription:
        """Return the description with its base turned further, about x and y (2,) [rad]."""
        x, y = (
            given + math.degrees(by) for given, by in zip(self.description.base.tilt_deg, tilt, strict=True)
        )
        base = self.description.base.model_copy(update={"tilt_deg": (x, y)})
        return self.description.model_copy(update={"base": base})

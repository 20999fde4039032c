"""Shapes at rest for given drives, and how they answer to all that is unknown or loose."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tcrctl.errors import NoEquilibriumError
from tcrctl.identify.calibration.body import Body
from tcrctl.identify.calibration.loose import hole_forces, holes_of_cables
from tcrctl.identify.calibration.rests import Rests
from tcrctl.identify.calibration.settings import RestSettings
from tcrctl.identify.statics import Side, Twins, answers
from tcrctl.robot.equations import FORCE
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.module import FIXED
from tcrctl.signals import Array


@dataclass(frozen=True, slots=True)
class Shape:
    """The robot at one rest.

    Attributes:
        q: Node positions (3 n_nodes,) [m].
        slopes: Their derivatives by all unknowns; 0 for those of the cameras (3 n_nodes, n).
        loose: What one standard deviation of each loose quantity does (3 n_nodes, n_loose) [m].
        tension: Cable tensions (m,) [N].
    """

    q: Array
    slopes: Array
    loose: Array
    tension: Array


class Shapes:
    """Follows the rests of one log; remembers the last shapes as starts for the next ones."""

    def __init__(self, body: Body, rests: Rests, settings: RestSettings) -> None:
        self._body, self._rests, self._settings = body, rests, settings
        self._last = [body.robot.rest.q] * len(rests.drive)

    def at(self, x: Array) -> Iterator[Shape]:
        """Yield the shapes of all rests for unknowns x (n,).

        Raises:
            NoEquilibriumError: If the robot that x describes has no stable shape at a rest.
        """
        side, twins = self._body.side(x), self._body.twins(x)
        for k in range(len(self._last)):
            yield self._shape(k, x, side, twins)

    def where_stable(self, x: Array) -> Iterator[Shape | None]:
        """Yield the shapes of all rests for unknowns x (n,), None for those that have no stable one."""
        side, twins = self._body.side(x), self._body.twins(x)
        for k in range(len(self._last)):
            try:
                yield self._shape(k, x, side, twins)
            except NoEquilibriumError:
                yield None

    def _shape(self, k: int, x: Array, side: Side, twins: tuple[Twins, ...]) -> Shape:
        u, rests = self._body.unknowns, self._rests
        drive = rests.drive[k] * (1.0 + u.take(x, "radius"))
        weight = side.load.nodal[FORCE]
        start = np.concatenate([side.base, self._last[k][3 * FIXED :]])
        rest = equilibrium(side.model, drive, weight, start)
        self._last[k] = rest.q
        robot = replace(self._body.robot, model=side.model, weight=weight)
        forces, wrap = hole_forces(side.model, rest.q)
        columns = [-pair.force_slope(rest.q, drive) for pair in twins]
        found = answers(robot, rest.q, drive, np.array([*columns, *forces[:, 3 * FIXED :]]).T)
        slopes = np.zeros((rest.q.size, len(u)))
        slopes[:, u.columns(robot=True)] = np.vstack(
            [np.array([pair.base_slope for pair in twins]).T, found[:, : len(twins)]]
        )
        slopes[3 * FIXED :, u.of("zeros")] = rest.gain
        slopes[3 * FIXED :, u.of("radius")] = rest.gain * rests.drive[k]
        held = self._held_back(found[:, len(twins) :], wrap, side, rest.tension)
        slopes[3 * FIXED :, u.of("backlash").start] = -0.5 * rest.gain @ rests.pushed[k]
        loose = np.zeros((rest.q.size, held.shape[1] + drive.size))
        loose[3 * FIXED :] = np.hstack(
            [self._settings.stick * held, 1e-3 * self._settings.play_mm * rest.gain]
        )
        q = rest.q + slopes[:, u.of("backlash")] @ u.take(x, "backlash")
        return Shape(q, slopes, loose, rest.tension)

    def _held_back(self, answer: Array, wrap: Array, side: Side, tension: Array) -> Array:
        """Answer to what friction of coefficient 1 would hold back at every hole, to first order."""
        angle = np.maximum(wrap, math.radians(self._settings.least_wrap_deg))
        return np.asarray(answer * angle * tension[holes_of_cables(side.model)])

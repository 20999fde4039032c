"""One simulated robot in real time, moved by emulated drives and seen by emulated cameras."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from tcrctl.errors import DivergenceError
from tcrctl.plant.settings import Mismatch
from tcrctl.robot import dynamics
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.module import ring_nodes, ring_rows
from tcrctl.robot.robot import Robot, mismatched
from tcrctl.signals import Array

#: Internal time step [s]: twice that of the simulated plant, because this one has to keep up with the clock.
STEP: Final = 0.002
RULE: Final = dynamics.Rule(STEP, 0.8)
#: Time that is made up for at once [s]; on a computer that is too slow the robot moves in slow motion.
LONGEST_CATCH_UP: Final = 0.02
#: A robot slower than this, whose drives stand still, is not integrated [m/s]; drives: [m].
STILL_SPEED: Final = 1e-6
STILL_DRIVE: Final = 1e-8


class EmulatedRobot:
    """Not thread-safe: one thread asks for its shape.

    Attributes:
        robot: The robot that moves, which differs from the controller's model by the mismatch.
        slipped: Time by which it is behind the clock because the computer was too slow [s].
    """

    def __init__(
        self,
        robot: Robot,
        mismatch: Mismatch | None,
        drives: Callable[[], Sequence[float]],
        tensions: Callable[[Sequence[float]], None],
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Hang it up at rest.

        Args:
            robot: The robot as the controller knows it.
            mismatch: By what it differs.
            drives: Cable lengths taken in now (m,) [m].
            tensions: Takes the cable tensions (m,) [N].
            clock: Never jumps [s].
        """
        if mismatch is not None:
            robot = mismatched(
                robot, mismatch.springs_youngs_modulus, mismatch.cables_youngs_modulus, mismatch.density
            )
        self.robot, self.slipped = robot, 0.0
        self._drives, self._tensions, self._clock = drives, tensions, clock
        self._state = dynamics.rest_state(robot.rest.q, np.zeros(robot.n_cables))
        self._work, self._scratch = make_workspace(robot.model), dynamics.make_scratch(robot.model)
        self._work.tension[:] = robot.rest.tension
        self._time = clock()
        self._rings = np.array([*ring_nodes(0), *ring_rows(robot.n_modules)])

    def rings(self) -> Array:
        """All ring nodes now, those of the base first (3 + 3 n_modules, 3) [m].

        Raises:
            DivergenceError: If the simulation broke down.
        """
        self._advance()
        nodes: Array = self._state.q.reshape(-1, 3)[self._rings]
        return nodes

    def _advance(self) -> None:
        now = self._clock()
        if now - self._time > LONGEST_CATCH_UP:
            if not self._still():
                self.slipped += now - self._time - LONGEST_CATCH_UP
            self._time = now - LONGEST_CATCH_UP
        steps = int((now - self._time) / STEP)
        if steps < 1:
            return
        duration = steps * STEP
        self._time += duration
        target = np.asarray(self._drives(), dtype=float)
        speed = (target - self._state.drive) / duration
        if self._still() and np.abs(target - self._state.drive).max() < STILL_DRIVE:
            return
        converged, residual, smallest, _ = dynamics.advance(
            self.robot.model, self._state, speed, duration, RULE, self.robot.weight, self._work, self._scratch
        )
        if not converged:
            raise DivergenceError(self._time, residual, smallest)
        self._state.drive[:] = target
        self._tensions(self._work.tension.tolist())

    def _still(self) -> bool:
        return float(np.abs(self._state.v).max()) < STILL_SPEED

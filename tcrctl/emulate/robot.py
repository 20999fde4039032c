"""One simulated robot in real time, moved by emulated drives and seen by emulated cameras."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from tcrctl.plant.body import Body, relaxes
from tcrctl.plant.own_robot import moving_robot
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.robot.module import ring_nodes, ring_rows
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

#: Internal time step [s]: twice that of the simulated plant, because this one has to keep up with the clock.
STEP: Final = 0.002
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
        settings: SimulatedSettings,
        drives: Callable[[], Sequence[float]],
        tensions: Callable[[Sequence[float]], None],
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Hang it up at rest.

        Args:
            robot: The robot as the controller knows it, or a scattered one.
            settings: By what it differs: material, strings, friction, hysteresis, creep; drives and cameras are not
                its own.
            drives: Cable lengths taken in now (m,) [m].
            tensions: Takes the cable tensions (m,) [N].
            clock: Never jumps [s].
        """
        robot = moving_robot(settings, robot)
        self.robot, self.slipped = robot, 0.0
        self._drives = drives
        self._tensions = tensions
        self._clock = clock
        self._cable = np.asarray(drives(), dtype=float)
        self._body = Body(settings.model_copy(update={"step_ms": 1e3 * STEP}), robot, self._cable)
        self._relaxes = relaxes(settings)
        self._time = clock()
        self._rings = np.array([*ring_nodes(0), *ring_rows(robot.n_modules)])

    def rings(self) -> Array:
        """Return all ring nodes now, those of the base first (3 + 3 n_modules, 3) [m].

        Raises:
            DivergenceError: If the simulation broke down.
        """
        self._advance()
        nodes: Array = self._body.state.q.reshape(-1, 3)[self._rings]
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
        before, target = self._cable, np.asarray(self._drives(), dtype=float)
        if self._still() and np.abs(target - before).max() < STILL_DRIVE:
            return
        self._cable = target
        if self._relaxes:
            for i in range(1, steps + 1):
                cable = before + (target - before) * (i / steps)
                self._body.follow(cable, STEP, self.robot.weight, self._time)
        else:
            drive = self._body.state.drive
            self._body.advance((target - drive) / duration, duration, self.robot.weight, self._time)
            drive[:] = target
        self._tensions(self._body.tension.tolist())

    def _still(self) -> bool:
        return float(np.abs(self._body.state.v).max()) < STILL_SPEED

"""Simulated plant: the robot's DAE under generalized-alpha, watched by noisy, late cameras.

With ideal drives, cables, springs and cameras a control period is one or two calls of the integrator; with real
ones it goes step by step, see :mod:`tcrctl.plant.reality`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tcrctl.memory import ACCELERATION, POSITION, SPEED, Kept
from tcrctl.plant.body import Body, chooses_steps, steps_one_by_one
from tcrctl.plant.disturbances import pushed, seen
from tcrctl.plant.own_robot import moving_robot
from tcrctl.plant.reality import Reality, real_drives
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.plant.stroke import within_stroke
from tcrctl.robot import pose
from tcrctl.robot.module import FIXED, module_of, ring_rows
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, Measurement, Truth


class SimulatedPlant:
    """One robot in simulation.

    Attributes:
        robot: The (possibly mismatched) robot that moves.
        time: Simulated time [s].
        reality: Its drives, cables, springs and cameras if they are not ideal.
    """

    def __init__(self, settings: SimulatedSettings, robot: Robot, period: float, seed: int) -> None:
        """Let the robot hang at rest.

        Args:
            settings: Of the plant.
            robot: That of the controller, or the plant's own one before :func:`moving_robot`.
            period: Control period [s].
            seed: Of everything random.

        Raises:
            NoEquilibriumError: If the robot has no stable shape.
        """
        robot = self.robot = moving_robot(settings, robot)
        self._settings = settings
        self.period, self.time = period, 0.0
        self._pushes, self._dropouts = settings.pushes, settings.dropouts
        self._latency, self._noise = settings.latency_ms / 1000.0, settings.noise_um * 1e-6
        whole = int(self._latency / period + 1e-9)  # periods; what is left of the latency is within one
        self._late = max(0.0, self._latency - whole * period)
        self._precision: type = np.float32  # as cameras deliver them
        self._random = np.random.default_rng(seed)
        self._rows = np.array(ring_rows(robot.n_modules))
        self._rings = module_of(self._rows)
        rings = range(1, robot.n_modules + 1) if settings.measured_rings == "all" else settings.measured_rings
        self._valid = np.isin(self._rings, list(rings))
        start = np.array(settings.start_drives_mm or np.zeros(robot.n_cables)) / 1000.0
        drives = real_drives(settings, start, period) if steps_one_by_one(settings) else None
        self._body = Body(settings, robot, start if drives is None else drives.cable())
        self.reality: Reality | None = None
        if drives is not None:
            self.reality = Reality(settings, self._body, drives, self._rows, period, seed)
        self._seen = deque(
            [self._body.state.q.copy()], maxlen=whole + 1
        )  # oldest first: shapes as cameras saw them

    @property
    def smooth(self) -> bool:
        """Whether :meth:`memory` is all that its next step depends on, and that step is a smooth map."""
        chosen = chooses_steps(self._settings)
        return self.reality is None and self._body.state.slip is None and not chosen

    def start(self) -> None:
        """Do nothing: there is nothing to arm in simulation."""

    def read(self) -> Measurement:
        """Return ring nodes one latency ago, with noise, in single precision, and what the drives report."""
        if self.reality is not None:
            frame = self.reality.cameras.read(self.time, self._valid, self._visible)
            reported = self.reality.drives.reported()
            return Measurement(frame.t, frame.nodes.astype(self._precision), frame.valid, reported)
        nodes = self._seen[0].reshape(-1, 3)[self._rows]
        nodes = nodes + self._noise * self._random.standard_normal(nodes.shape)
        t = self.time - min(self._latency, self.time)
        return Measurement(
            t=t,
            nodes=nodes.astype(self._precision),
            valid=self._visible(self._valid, t),
            drive=self._body.state.drive.copy(),
        )

    def _visible(self, valid: NDArray[np.bool_], t: float) -> NDArray[np.bool_]:
        return seen(valid, self._rings, self._dropouts, t)

    def write(self, command: Command) -> Command:
        """Move the drives at ``command.speed`` for one period; drives stop at the ends of their stroke.

        Raises:
            DivergenceError: If an internal step did not converge.
        """
        force = pushed(self.robot.weight, self._pushes, self.time)
        if self.reality is not None:
            drives = self.reality.drives
            applied = within_stroke(command, drives.set_point, self.period, self.robot.stroke)
            self.reality.period(applied.speed, force, self.time)
            drives.set_point = applied.drive.copy()
        else:
            drive, body = self._body.state.drive, self._body
            applied = within_stroke(command, drive, self.period, self.robot.stroke)
            body.advance(applied.speed, self.period - self._late, force, self.time)
            self._seen.append(body.state.q.copy())
            body.advance(applied.speed, self._late, force, self.time)
            drive[:] = applied.drive  # the sum of many sub-steps differs from it by rounding
        self.time += self.period
        return applied

    def truth(self) -> Truth:
        """Return the true end pose, tensions and shape now."""
        q = self._body.state.q
        return Truth(
            position=pose.position(q, self.robot.tip),
            normal=pose.normal(q, self.robot.tip),
            tension=self._body.tension.copy(),
            q=q.copy(),
        )

    def state(self) -> tuple[Array, Array]:
        """Return the true node positions [m] and velocities [m/s] now, (3 n_nodes,) each."""
        return self._body.state.q.copy(), self._body.state.v.copy()

    def without_noise(self) -> None:
        """Let the cameras from now on report what they see exactly, in double precision."""
        self._noise, self._precision = 0.0, np.float64
        if self.reality is not None:
            self.reality.cameras.without_noise()

    def memory(self) -> Mapping[str, Kept]:
        """Return the integrator's state without the base, drives, and shapes that cameras have yet to report."""
        first, x = 3 * FIXED, self._body.state
        seen = {f"seen_{i}": Kept(q[first:], POSITION) for i, q in enumerate(self._seen)}
        return {
            "q": Kept(x.q[first:], POSITION),
            "v": Kept(x.v[first:], SPEED),
            "acceleration": Kept(x.acceleration[first:], ACCELERATION),
            "auxiliary": Kept(x.auxiliary[first:], ACCELERATION),
            "drive": Kept(x.drive, POSITION),
            **seen,
        }

    def close(self) -> None:
        """Do nothing: there is nothing to leave safe in simulation."""

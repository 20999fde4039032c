"""Simulated plant: the robot's DAE under generalized-alpha, watched by noisy, late cameras."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np

from tcrctl.errors import DivergenceError
from tcrctl.memory import ACCELERATION, POSITION, SPEED, Kept
from tcrctl.plant.disturbances import pushed, seen
from tcrctl.plant.settings import Mismatch, SimulatedSettings
from tcrctl.plant.stroke import within_stroke
from tcrctl.robot import dynamics, pose
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.equilibrium import Equilibrium, equilibrium
from tcrctl.robot.module import FIXED, module_of, ring_rows
from tcrctl.robot.robot import Robot, mismatched
from tcrctl.signals import Array, Command, Measurement, Truth


def _moving(settings: SimulatedSettings, robot: Robot) -> Robot:
    """Return the robot that moves: not quite the one the controller knows."""
    if settings.mismatch is None and not settings.tip_load_g:
        return robot
    factors = settings.mismatch or Mismatch()
    return mismatched(
        robot,
        factors.springs_youngs_modulus,
        factors.cables_youngs_modulus,
        factors.density,
        settings.tip_load_g / 1000.0,
    )


def _start(settings: SimulatedSettings, robot: Robot) -> tuple[Array, Equilibrium]:
    """Drives (m,) [m] and shape in which the robot rests before the run."""
    if settings.start_drives_mm is None:
        return np.zeros(robot.n_cables), robot.rest
    drive = np.array(settings.start_drives_mm) / 1000.0
    return drive, equilibrium(robot.model, drive, robot.weight, robot.rest.q)


class SimulatedPlant:
    """One robot in simulation.

    Attributes:
        robot: The (possibly mismatched) robot that moves.
        time: Simulated time [s].
    """

    def __init__(self, settings: SimulatedSettings, robot: Robot, period: float, seed: int) -> None:
        robot = self.robot = _moving(settings, robot)
        self.period, self.time = period, 0.0
        self._pushes, self._dropouts = settings.pushes, settings.dropouts
        self._rule = dynamics.Rule(settings.step_ms / 1000.0, settings.spectral_radius)
        self._latency, self._noise = settings.latency_ms / 1000.0, settings.noise_um * 1e-6
        whole = int(self._latency / period + 1e-9)  # periods; what is left of the latency is within one
        self._late = max(0.0, self._latency - whole * period)
        self._precision: type = np.float32  # as cameras deliver them
        self._random = np.random.default_rng(seed)
        drive, rest = _start(settings, robot)
        slip = None
        if settings.friction is not None:
            f = settings.friction
            row = [f.coefficient, np.radians(f.least_wrap_deg), f.drag_n]
            holes = np.tile(row, (robot.model.hole_nodes.shape[0], 1))
            slip = dynamics.unworn(robot.model, rest.q, drive, rest.tension, holes)
        self._state = dynamics.rest_state(rest.q, drive, slip)
        self._work = make_workspace(robot.model, rubbing=slip is not None)
        self._scratch = dynamics.make_scratch(robot.model)
        self._scratch.lead[:] = dynamics.lead_direction(rest.q)
        self._work.tension[:] = rest.tension
        self._rows = np.array(ring_rows(robot.n_modules))
        self._rings = module_of(self._rows)
        rings = range(1, robot.n_modules + 1) if settings.measured_rings == "all" else settings.measured_rings
        self._valid = np.isin(self._rings, list(rings))
        self._seen = deque(
            [self._state.q.copy()], maxlen=whole + 1
        )  # oldest first: shapes as cameras saw them

    def start(self) -> None:
        """Nothing to arm in simulation."""

    def read(self) -> Measurement:
        """Ring nodes as they were one latency ago, with noise, in single precision; drives as they are."""
        nodes = self._seen[0].reshape(-1, 3)[self._rows]
        nodes = nodes + self._noise * self._random.standard_normal(nodes.shape)
        t = self.time - min(self._latency, self.time)
        return Measurement(
            t=t,
            nodes=nodes.astype(self._precision),
            valid=seen(self._valid, self._rings, self._dropouts, t),
            drive=self._state.drive.copy(),
        )

    def write(self, command: Command) -> Command:
        """Move the drives at ``command.speed`` for one period; drives stop at the ends of their stroke.

        Raises:
            DivergenceError: If a time step did not converge.
        """
        applied = within_stroke(command, self._state.drive, self.period, self.robot.stroke)
        force = pushed(self.robot.weight, self._pushes, self.time)
        self._advance(applied.speed, self.period - self._late, force)
        self._seen.append(self._state.q.copy())
        self._advance(applied.speed, self._late, force)
        self.time += self.period
        self._state.drive[:] = applied.drive  # the sum of many sub-steps differs from it by rounding
        return applied

    def _advance(self, speed: Array, duration: float, force: Array) -> None:
        converged, residual, smallest, _ = dynamics.advance(
            self.robot.model, self._state, speed, duration, self._rule, force, self._work, self._scratch
        )
        if not converged:
            raise DivergenceError(self.time, residual, smallest)

    def truth(self) -> Truth:
        """True end pose, tensions and shape now."""
        q = self._state.q
        return Truth(
            position=pose.position(q, self.robot.tip),
            normal=pose.normal(q, self.robot.tip),
            tension=self._work.tension.copy(),
            q=q.copy(),
        )

    def state(self) -> tuple[Array, Array]:
        """True node positions [m] and velocities [m/s] now, (3 n_nodes,) each."""
        return self._state.q.copy(), self._state.v.copy()

    def without_noise(self) -> None:
        """Let the cameras from now on report what they see exactly, in double precision."""
        self._noise, self._precision = 0.0, np.float64

    def memory(self) -> Mapping[str, Kept]:
        """State of the integrator without the fixed base, drives, shapes that the cameras have yet to report."""
        first, x = 3 * FIXED, self._state
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
        """Nothing to leave safe in simulation."""

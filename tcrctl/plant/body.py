"""The moving robot of a simulated plant: arrays, state and integrator."""

from __future__ import annotations

import numpy as np

from tcrctl.errors import DivergenceError
from tcrctl.plant.own_robot import friction_of
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.plant.spring_hysteresis import SpringHysteresis
from tcrctl.robot import dynamics
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array


class Body:
    """A robot that starts at rest.

    Attributes:
        model: Its arrays.
        state: Its state, changed in place.
        tension: Cable tensions at the drives (m,) [N], changed in place.
        hysteresis: Friction elements of the springs, or None.
    """

    def __init__(self, settings: SimulatedSettings, robot: Robot, drive: Array) -> None:
        """Let it hang with drive lengths (m,) [m].

        Raises:
            NoEquilibriumError: If it has no stable shape with them.
        """
        rest = robot.rest
        if np.any(drive != 0.0) or settings.start_drives_mm is not None:
            rest = equilibrium(robot.model, drive, robot.weight, robot.rest.q)
        self._rule = dynamics.Rule(settings.step_ms / 1000.0, settings.spectral_radius)
        holes = friction_of(settings, robot)
        slip = None if holes is None else dynamics.unworn(robot.model, rest.q, drive, rest.tension, holes)
        self.state = dynamics.rest_state(rest.q, drive, slip)
        loss = settings.springs_hysteresis
        self.hysteresis = None if loss is None else SpringHysteresis(loss, robot.model, rest.q)
        self.model = robot.model if self.hysteresis is None else self.hysteresis.model
        self._work = make_workspace(self.model, rubbing=slip is not None)
        self._scratch = dynamics.make_scratch(self.model)
        self._scratch.lead[:] = dynamics.lead_direction(rest.q)
        self.tension = self._work.tension
        self.tension[:] = rest.tension

    def advance(self, speed: Array, duration: float, force: Array, t: float) -> None:
        """Let time pass.

        Args:
            speed: Rates of the drive lengths (m,) [m/s].
            duration: How long [s].
            force: External force, weight included (3 n_nodes,) [N].
            t: Time, for messages [s].

        Raises:
            DivergenceError: If a time step did not converge.
        """
        converged, residual, smallest, _ = dynamics.advance(
            self.model, self.state, speed, duration, self._rule, force, self._work, self._scratch
        )
        if not converged:
            raise DivergenceError(t, residual, smallest)

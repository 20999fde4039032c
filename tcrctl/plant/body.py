"""The moving robot of a simulated plant: state, integrator, springs that give way and cables that creep."""

from __future__ import annotations

import numpy as np

from tcrctl.elements import sliding_cable
from tcrctl.errors import DivergenceError
from tcrctl.plant.creep import Creep
from tcrctl.plant.own_robot import friction_of
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.plant.spring_hysteresis import SpringHysteresis
from tcrctl.plant.time_step import LONGEST_MS, fixed_ms
from tcrctl.robot import dynamics
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import Robot
from tcrctl.robot.unworn import lead_direction, unworn
from tcrctl.signals import Array


def relaxes(settings: SimulatedSettings) -> bool:
    """Return whether something has to happen to a robot between internal steps."""
    creeps = settings.cables is not None and bool(settings.cables.creep)
    return creeps or settings.springs_hysteresis is not None


def steps_one_by_one(settings: SimulatedSettings) -> bool:
    """Return whether a plant has something that happens between internal steps."""
    return relaxes(settings) or settings.drives is not None or settings.cameras is not None


def chooses_steps(settings: SimulatedSettings) -> bool:
    """Return whether internal steps are as long as their error lets them be, if nothing rubs."""
    return settings.step_ms == "auto" and not steps_one_by_one(settings)


def _rule(settings: SimulatedSettings, rubs: bool) -> dynamics.Rule:
    """Return how time is integrated.

    What rubs goes by fixed steps: where it sticks is decided once per step, and an error has no order.
    """
    if rubs or not chooses_steps(settings):
        return dynamics.Rule(fixed_ms(settings.step_ms) / 1000.0, settings.spectral_radius)
    return dynamics.Rule(LONGEST_MS / 1000.0, settings.spectral_radius, settings.step_error_um * 1e-6)


class Body:
    """A robot that starts at rest.

    Attributes:
        model: Its arrays.
        state: Its state, changed in place.
        tension: Cable tensions at the drives (m,) [N], changed in place.
        late: Cable that creep has paid out, as seen from the drives (m,) [m]; with friction it is in the stretches.
    """

    def __init__(self, settings: SimulatedSettings, robot: Robot, drive: Array) -> None:
        """Let it hang with drive lengths (m,) [m].

        Raises:
            NoEquilibriumError: If it has no stable shape with them.
        """
        rest = robot.rest
        if np.any(drive != 0.0) or settings.start_drives_mm is not None:
            rest = equilibrium(robot.model, drive, robot.weight, robot.rest.q)
        holes = friction_of(settings, robot)
        slip = None if holes is None else unworn(robot.model, rest.q, drive, rest.tension, holes)
        self.state = dynamics.rest_state(rest.q, drive, slip)
        self._rule = _rule(settings, rubs=slip is not None)
        loss = settings.springs_hysteresis
        self._hysteresis = None if loss is None else SpringHysteresis(loss, robot.model, rest.q)
        self.model = robot.model if self._hysteresis is None else self._hysteresis.model
        self._work = make_workspace(self.model, rubbing=slip is not None)
        self._scratch = dynamics.make_scratch(self.model)
        self._scratch.lead[:] = lead_direction(rest.q)
        self.tension = self._work.tension
        self.tension[:] = rest.tension
        self.late = np.zeros_like(drive)
        branches = () if settings.cables is None else settings.cables.creep
        self._creep = Creep(branches, self._elastic()) if branches else None

    def advance(self, speed: Array, duration: float, force: Array, t: float) -> None:
        """Let time pass.

        Args:
            speed: Rates of the drive lengths (m,) [m/s].
            duration: How long [s].
            force: External force, weight included (3 n_nodes,) [N].
            t: Time, for messages [s].

        Raises:
            DivergenceError: If an internal step did not converge.
        """
        converged, residual, smallest, _ = dynamics.advance(
            self.model, self.state, speed, duration, self._rule, force, self._work, self._scratch
        )
        if not converged:
            raise DivergenceError(t, residual, smallest)

    def follow(self, cable: Array, h: float, force: Array, t: float) -> None:
        """Go one internal step ``h`` [s] to the cable taken in at its end (m,) [m], and let follow what is slow.

        Raises:
            DivergenceError: If it did not converge.
        """
        self.advance((cable - self.late - self.state.drive) / h, h, force, t)
        if self._hysteresis is not None:
            self._hysteresis.give_way(self.state.q)
        if self._creep is not None:
            grown, slip = self._creep.grow(self._elastic(), h), self.state.slip
            if slip is None:
                self.late += grown
            else:
                slip.rest[:] += grown

    def _elastic(self) -> Array:
        """Return elastic elongations of the cables (m,) or, where they rub, of their stretches (n_holes,) [m]."""
        slip = self.state.slip
        if slip is None:
            return np.asarray(self.tension / self.model.cables[:, sliding_cable.STIFFNESS])
        return np.asarray(slip.tension / slip.stiffness)

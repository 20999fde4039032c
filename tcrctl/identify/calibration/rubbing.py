"""Friction of every cable, from the pulls: the robot that was found moves as the log says, rubbing more or less.

Static shapes do not tell it: where a hole holds a cable depends on how all cables came there. So the pulls are
simulated, and what is compared is how far each rest is from the one before any motion.
"""  # fmt: skip

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import DivergenceError, NoEquilibriumError
from tcrctl.identify.calibration.body import Body
from tcrctl.identify.calibration.rests import Rests
from tcrctl.identify.calibration.settings import RestSettings
from tcrctl.identify.calibration.shapes import Shape
from tcrctl.identify.calibration.sight import Sight
from tcrctl.identify.motion import SPECTRAL_RADIUS
from tcrctl.log.reader import Log
from tcrctl.robot import dynamics
from tcrctl.robot.equations import FORCE, Workspace, make_workspace
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import Robot, hole_friction
from tcrctl.robot.sections import FrictionSettings
from tcrctl.robot.unworn import lead_direction, unworn
from tcrctl.signals import Array

#: Coefficients tried first, for all cables alike.
TRIED: Final = (0.0, 0.1, 0.25)
#: Difference of a coefficient for its slope, and its largest value.
HALF, MOST = 0.02, 1.0
#: Gauss-Newton steps for single cables.
STEPS: Final = 1
#: Standard deviation beforehand of one cable's coefficient from that of all.
SPREAD: Final = 0.1
#: Fewest rests after pulls.
FEWEST: Final = 4


class Rubbing(NamedTuple):
    """What the pulls say.

    Attributes:
        coefficient: Of every cable (m,); empty if there are no pulls.
        deviation: Standard deviation of each (m,).
        error: Root mean square of what is left of the markers' motion [m].
        smooth_error: The same without friction [m].
    """

    coefficient: Array
    deviation: Array
    error: float
    smooth_error: float


NOTHING: Final = Rubbing(np.zeros(0), np.zeros(0), np.nan, np.nan)


class Pulls:
    """The part of a log up to the last pull."""

    def __init__(self, log: Log, rests: Rests, body: Body, x: Array, settings: RestSettings) -> None:
        columns = log.columns(("t", "measurement_drive"))
        later = np.arange(1, len(rests.t))  # beside the first one, after a pull or not
        pulled = np.setdiff1d(later, rests.shaken)
        self._which: NDArray[np.intp] = np.concatenate([[0], pulled]) if pulled.size else pulled
        self._body, self._x, self._settings, self._rests = body, x, settings, rests
        last = 0 if not pulled.size else int(np.searchsorted(columns["t"], rests.t[pulled[-1]]))
        self._t = columns["t"][: last + 1]
        u = body.unknowns
        drive = columns["measurement_drive"][: last + 1] * (1.0 + u.take(x, "radius"))
        self._drive = behind_play(drive, float(u.take(x, "backlash")[0]))
        side = body.side(x)
        self._robot = replace(body.robot, model=side.model, weight=side.load.nodal[FORCE])
        self._start = np.concatenate([side.base, body.robot.rest.q[side.base.size :]])
        self._sight = Sight(u, body.robot.n_modules)

    def __len__(self) -> int:
        """Return the number of rests after pulls."""
        return max(0, len(self._which) - 1)

    def left(self, coefficient: Array) -> Array:
        """Return how the markers moved beside what is simulated, over all pulls (r,) [m]; NaN where not seen.

        Raises:
            NoEquilibriumError: If the robot has no shape at the start.
            DivergenceError: If a time step did not converge.
        """
        seen = self._rests.markers[self._which].reshape(len(self._which), -1)
        said = np.array([self._seen(q) for q in self._shapes(coefficient)])
        beside = seen - said
        return np.asarray((beside[1:] - beside[0]).ravel())

    def _seen(self, q: Array) -> Array:
        none = np.zeros((q.size, 0))
        return self._sight.of(self._x, Shape(q, np.zeros((q.size, len(self._x))), none, none))[0]

    def _shapes(self, coefficient: Array) -> list[Array]:
        """Node positions at the start and at the ends of all rests after pulls (3 n_nodes,) each [m]."""
        robot, drive, t = self._robot, self._drive, self._t
        at_rest = equilibrium(robot.model, drive[0], robot.weight, self._start)
        state, work, scratch = _moving(
            robot, at_rest.q, at_rest.tension, drive[0], coefficient, self._settings
        )
        rule = dynamics.Rule(self._settings.step_ms / 1e3, SPECTRAL_RADIUS)
        ends, found = set(np.searchsorted(t, self._rests.t[self._which]).tolist()), []
        for k in range(len(t)):
            if k > 0:
                duration = float(t[k] - t[k - 1])
                speed = (drive[k] - drive[k - 1]) / duration
                converged, residual, smallest, _ = dynamics.advance(
                    robot.model, state, speed, duration, rule, robot.weight, work, scratch
                )
                if not converged:
                    raise DivergenceError(float(t[k]), residual, smallest)
                state.drive[:] = drive[k]
            if k in ends:
                found.append(state.q.copy())
        return found


def _moving(
    robot: Robot, q: Array, tension: Array, drive: Array, coefficient: Array, settings: RestSettings
) -> tuple[dynamics.State, Workspace, dynamics.Scratch]:
    """State at rest, workspace and scratch of a robot that rubs, unless all coefficients are 0."""
    friction = FrictionSettings(
        coefficient=tuple(coefficient.tolist()), least_wrap_deg=settings.least_wrap_deg
    )
    holes = hole_friction(friction, robot.model.first_hole)
    slip = unworn(robot.model, q, drive, tension, holes)
    state = dynamics.rest_state(q, drive, slip)
    work, scratch = make_workspace(robot.model, rubbing=True), dynamics.make_scratch(robot.model)
    scratch.lead[:] = lead_direction(q)
    work.tension[:] = tension
    return state, work, scratch


def behind_play(drive: Array, play: float) -> Array:
    """Return cable taken in (k, m) [m] by drives (k, m) [m] with a play [m], in its middle at first."""
    cable, out = drive[0].copy(), np.empty_like(drive)
    for k in range(drive.shape[0]):
        cable = np.clip(cable, drive[k] - 0.5 * max(play, 0.0), drive[k] + 0.5 * max(play, 0.0))
        out[k] = cable
    return out


def find_friction(log: Log, rests: Rests, body: Body, x: Array, settings: RestSettings) -> Rubbing:
    """Find coefficients of friction; nothing if there are no pulls, or the robot cannot be simulated."""
    pulls = Pulls(log, rests, body, x, settings)
    if len(pulls) < FEWEST:
        return NOTHING
    try:
        return _found(pulls, body.robot.n_cables)
    except (DivergenceError, NoEquilibriumError):
        return NOTHING


def _found(pulls: Pulls, m: int) -> Rubbing:
    tried = [_size(pulls.left(np.full(m, mu))) for mu in TRIED]
    mu = np.full(m, TRIED[int(np.argmin(tried))])
    for _ in range(STEPS):
        left = pulls.left(mu)
        ok = np.isfinite(left)
        columns = []
        for c in range(m):
            more = mu.copy()
            more[c] += HALF
            columns.append((pulls.left(more) - left)[ok] / HALF)
        slopes = np.array(columns).T
        information = slopes.T @ slopes / max(_size(left), 1e-12) ** 2 + np.eye(m) / SPREAD**2
        move = np.linalg.solve(information, -slopes.T @ left[ok] / max(_size(left), 1e-12) ** 2)
        mu = np.clip(mu + move, 0.0, MOST)
    deviation = np.sqrt(np.diag(np.linalg.inv(information)))
    return Rubbing(mu, deviation, _size(pulls.left(mu)), tried[0])


def _size(left: Array) -> float:
    return float(np.sqrt(np.nanmean(left**2)))

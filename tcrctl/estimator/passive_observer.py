"""Passive model observer: the model itself, drawn to the measured nodes by virtual springs.

Each update steps the model by one control period (backward Euler, incremental potential) with the drives
that were applied, and with springs of stiffness S from its ring nodes to their measured places. Noise that
would stretch rods is rejected by the rods' own stiffness, while the soft modes follow the markers; springs and
backward Euler can only store or dissipate energy, so the observer is stable whatever the mismatch.

Between rings that are not seen, a mismatched model pushes against the springs like a column between two walls, and
buckles if they are hard. So the stiffness falls with the square of the share of markers that are seen.

A mismatched model keeps the springs stretched. So the end pose is corrected by the filtered difference between
the measured tip ring and the model's; while the tip ring is not seen, the last correction stays.

A robot may hang beside its model from the start: the first frame is taken for a robot at rest (``fit_start``). A
frame without any marker would let the model swing back there: it repeats the last one (``hold_blank``), and a
single lost marker is filled in for a while (``lost_markers``). What is known of cameras and markers is taken out
of every frame first (``calibration``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tcrctl.estimator.calibration import MarkerCalibration
from tcrctl.estimator.drives import BelievedDrives
from tcrctl.estimator.exact import TrueState
from tcrctl.estimator.lost_markers import LostMarkers
from tcrctl.estimator.settings import PassiveObserverSettings
from tcrctl.memory import NORMAL, POSITION, SPEED, Kept
from tcrctl.robot import dynamics, pose
from tcrctl.robot.equations import FORCE, Q_FREE, SPRING, SPRING_AT, Load, make_workspace
from tcrctl.robot.module import FIXED, ring_rows
from tcrctl.robot.potential import minimise
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, Estimate, Measurement

#: Largest nodal force left by an update [N]: against the virtual springs, 5 nanometres.
TOLERANCE = 1e-4
MAX_ITERATIONS = 30
#: The same for the first frame, which may lie far from the model's rest.
FIT_ITERATIONS = 80


class PassiveObserver:
    """See the module's docstring. State: positions, velocities, drives, correction of the end pose, last frame."""

    def __init__(
        self, settings: PassiveObserverSettings, robot: Robot, period: float, drives: BelievedDrives
    ) -> None:
        """Take an ``estimator:`` section, the robot, the control period [s] and the drives."""
        self._robot, self._period, self._drives = robot, period, drives
        self._stiffness = settings.stiffness_n_m
        self._blend = -float(np.expm1(-period / settings.pose_filter_s))
        rows = np.array(ring_rows(robot.n_modules))
        self._coordinates = (3 * rows[:, None] + np.arange(3)).ravel()
        self._tip_markers = np.flatnonzero((rows >= robot.tip) & (rows < robot.tip + 3))
        self._q, self._v = robot.rest.q.copy(), np.zeros_like(robot.rest.q)
        self._drive = np.zeros(robot.n_cables)
        self._still = np.zeros(robot.n_cables)
        self._correction = np.zeros(6)
        self._updates = 0
        self._fits, self._holds = settings.fit_start, settings.hold_blank
        self._frame = np.zeros((rows.size, 3))
        self._frame_valid = np.zeros(rows.size, dtype=np.bool_)
        self._lost = LostMarkers(rows.size, period)
        self._calibration = MarkerCalibration.of(settings.calibrated, robot.n_modules)
        self._work = make_workspace(robot.model)
        self._scratch = dynamics.make_scratch(robot.model)
        self._scratch.nodal[FORCE] = robot.weight
        self._valid, self._seen = np.zeros(rows.shape[0], dtype=np.bool_), self._coordinates[:0]

    def _load(self, measured: Measurement) -> Load:
        """Return the inertia of backward Euler, weight and virtual springs of one update."""
        period = self._period
        s = self._scratch
        model = self._robot.model
        inertia = 1.0 / period**2 + model.damping / period
        s.nodal[Q_FREE] = self._q + self._v / (period * inertia)
        if not np.array_equal(measured.valid, self._valid):
            self._valid = measured.valid.copy()
            self._seen = self._coordinates[np.repeat(self._valid, 3)]
            s.nodal[SPRING] = 0.0
            s.nodal[SPRING, self._seen] = self._stiffness * float(np.mean(self._valid)) ** 2
        s.nodal[SPRING_AT, self._seen] = measured.nodes[self._valid].ravel()
        dynamics.lengths_before(model, self._q, self._v, self._drive, self._still, 0.0, s, self._work)
        return Load(inertia, 1.0 / period, s.nodal, s.bar_before, s.cable_before, None)

    def _held(self, measured: Measurement) -> Measurement:
        """Return the frame; the last one with markers in the place of a blank one."""
        if measured.valid.any():
            self._frame[:] = np.where(measured.valid[:, None], measured.nodes, 0.0)
            self._frame_valid = measured.valid.copy()
        elif self._holds and self._frame_valid.any():
            return replace(measured, nodes=self._frame.astype(measured.nodes.dtype), valid=self._frame_valid)
        return measured

    def _at_markers(self, q: Array) -> Array:
        """Return the nodes that carry markers (n_markers, 3) [m]."""
        return np.asarray(q[self._coordinates].reshape(-1, 3))

    def _fit(self, measured: Measurement) -> None:
        """Fit the resting model to a frame by statics: virtual springs and weight, no inertia, no damping.

        So the robot does not seem to jump there in a step. Without a solution the model stays at its own rest.
        """
        still = self._load(measured)._replace(inertia=0.0, w=0.0)
        model = self._robot.model
        q = self._q.copy()
        drive = measured.drive.copy()
        if minimise(model, q, drive, still, self._work, TOLERANCE, FIT_ITERATIONS, False).converged:
            self._q = q
            self._v = np.zeros_like(q)
            self._drive = drive

    def _correct(self, measured: Measurement) -> tuple[Array, Array]:
        """End position and normal, corrected by what the tip ring's markers say."""
        tip = self._robot.tip
        position, normal = pose.position(self._q, tip), pose.normal(self._q, tip)
        if measured.valid[self._tip_markers].all():
            ring = measured.nodes[self._tip_markers].astype(float).ravel()
            error = np.concatenate([pose.position(ring, 0) - position, pose.normal(ring, 0) - normal])
            self._updates += 1  # the first ones are averaged, then the filter forgets
            self._correction = self._correction + max(self._blend, 1.0 / self._updates) * (
                error - self._correction
            )
        turned = normal + self._correction[3:]
        return position + self._correction[:3], turned / np.linalg.norm(turned)

    def sharpen(self) -> None:
        """Let the drives be as they are believed to be now; see :class:`BelievedDrives`."""
        self._drives.sharpen()

    def memory(self) -> Mapping[str, Kept]:
        """Return positions and velocities without the base, drives, pose correction, and the last frame."""
        first = 3 * FIXED
        return {
            "q": Kept(self._q[first:], POSITION),
            "v": Kept(self._v[first:], SPEED),
            "drive": Kept(self._drive, POSITION),
            "correction_position": Kept(self._correction[:3], POSITION),
            "correction_normal": Kept(self._correction[3:], NORMAL),
            **self._drives.memory(),
            **({"frame": Kept(self._frame.ravel(), POSITION)} if self._holds else {}),
        }

    def update(self, measured: Measurement, applied: Command) -> Estimate:
        """Step the model to the time of ``measured``."""
        self._drives.update(measured.drive, applied.drive)
        measured = self._calibration.corrected(measured, self._at_markers(self._q))
        measured = replace(self._held(measured), drive=self._drives.reached)
        if self._fits and measured.valid.any():
            self._fit(measured)
            self._fits = False
        if self._holds:
            measured = self._lost.filled(measured)
        load = self._load(measured)
        q = self._q.copy()
        model, drive = self._robot.model, measured.drive
        outcome = minimise(model, q, drive, load, self._work, TOLERANCE, MAX_ITERATIONS, False)
        if outcome.converged:
            self._v, self._q, self._drive = (q - self._q) / self._period, q, drive.copy()
        position, normal = self._correct(measured)
        return Estimate(
            t=measured.t,
            q=self._q,
            v=self._v,
            drive=self._drive,
            set_point=self._drives.set_point,
            arrived=self._drives.arrived,
            lag=self._drives.lag,
            tension=self._work.tension.copy(),
            position=position,
            normal=normal,
            disturbance=load.nodal[SPRING] * (load.nodal[SPRING_AT] - self._q),
            converged=outcome.converged,
        )


def build_observer(
    settings: PassiveObserverSettings,
    robot: Robot,
    period: float,
    state: TrueState | None,
    drives: BelievedDrives,
) -> PassiveObserver:
    """Build the estimator; see :func:`tcrctl.estimator.estimator.build_estimator`."""
    del state
    return PassiveObserver(settings, robot, period, drives)

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
from tcrctl.estimator.observer_update import TOLERANCE, Body, Frame, Observing, Updated, fill_load, update
from tcrctl.estimator.settings import PassiveObserverSettings
from tcrctl.memory import NORMAL, POSITION, SPEED, Kept
from tcrctl.robot import dynamics
from tcrctl.robot.equations import FORCE, make_workspace
from tcrctl.robot.module import FIXED, ring_rows
from tcrctl.robot.potential import minimise
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, Estimate, Measurement

#: Iterations for the first frame, which may lie far from the model's rest.
FIT_ITERATIONS = 80


class PassiveObserver:
    """See the module's docstring. State: positions, velocities, drives, correction of the end pose, last frame."""

    def __init__(
        self, settings: PassiveObserverSettings, robot: Robot, period: float, drives: BelievedDrives
    ) -> None:
        """Take an ``estimator:`` section, the robot, the control period [s] and the drives."""
        self._robot, self._drives = robot, drives
        self._blend = -float(np.expm1(-period / settings.pose_filter_s))
        rows = np.array(ring_rows(robot.n_modules))
        self._coordinates = (3 * rows[:, None] + np.arange(3)).ravel()
        still = np.zeros(robot.n_cables)
        self._numbers = Observing(
            period, settings.stiffness_n_m, rows, robot.tip, int(np.argmax(rows == robot.tip)), still
        )
        self._body = Body(robot.rest.q.copy(), np.zeros_like(robot.rest.q), still.copy(), np.zeros(6))
        self._updates = 0
        self._fits, self._holds = settings.fit_start, settings.hold_blank
        self._frame = np.zeros((rows.size, 3))
        self._frame_valid = np.zeros(rows.size, dtype=np.bool_)
        self._lost = LostMarkers(rows.size, period)
        self._calibration = MarkerCalibration.of(settings.calibrated, robot.n_modules)
        self._work = make_workspace(robot.model)
        self._scratch = dynamics.make_scratch(robot.model)
        self._scratch.nodal[FORCE] = robot.weight
        self._nodes, self._seen = np.zeros((rows.size, 3)), np.zeros(rows.size, dtype=np.bool_)
        self._told = np.zeros(robot.n_cables)

    def _held(self, measured: Measurement) -> Measurement:
        """Return the frame; the last one with markers in the place of a blank one."""
        count = np.count_nonzero(measured.valid)
        if count == measured.valid.size:
            self._frame[:], self._frame_valid[:] = measured.nodes, True
        elif count > 0:
            self._frame[:] = np.where(measured.valid[:, None], measured.nodes, 0.0)
            self._frame_valid[:] = measured.valid
        elif self._holds and self._frame_valid.any():
            nodes = self._frame.astype(measured.nodes.dtype)
            return replace(measured, nodes=nodes, valid=self._frame_valid.copy())
        return measured

    def _at_markers(self, q: Array) -> Array:
        """Return the nodes that carry markers (n_markers, 3) [m]."""
        return np.asarray(q[self._coordinates].reshape(-1, 3))

    def _fit(self, frame: Frame) -> None:
        """Fit the resting model to a frame by statics: virtual springs and weight, no inertia, no damping.

        So the robot does not seem to jump there in a step. Without a solution the model stays at its own rest.
        """
        model, body = self._robot.model, self._body
        load = fill_load(model, body, frame, self._numbers, self._scratch, self._work)
        still, q = load._replace(inertia=0.0, w=0.0), body.q.copy()
        if minimise(model, q, frame.drive, still, self._work, TOLERANCE, FIT_ITERATIONS, False).converged:
            self._body = Body(q, np.zeros_like(q), frame.drive.copy(), body.correction)

    def _framed(self, measured: Measurement) -> Frame:
        """Return a frame for the kernels, which take one type of arrays whoever delivers them."""
        self._nodes[:], self._seen[:], self._told[:] = measured.nodes, measured.valid, self._drives.reached
        return Frame(self._nodes, self._seen, self._told)

    def sharpen(self) -> None:
        """Let the drives be as they are believed to be now; see :class:`BelievedDrives`."""
        self._drives.sharpen()

    def memory(self) -> Mapping[str, Kept]:
        """Return positions and velocities without the base, drives, pose correction, and the last frame."""
        first, body = 3 * FIXED, self._body
        return {
            "q": Kept(body.q[first:], POSITION),
            "v": Kept(body.v[first:], SPEED),
            "drive": Kept(body.drive, POSITION),
            "correction_position": Kept(body.correction[:3], POSITION),
            "correction_normal": Kept(body.correction[3:], NORMAL),
            **self._drives.memory(),
            **({"frame": Kept(self._frame.ravel(), POSITION)} if self._holds else {}),
        }

    def update(self, measured: Measurement, applied: Command) -> Estimate:
        """Step the model to the time of ``measured``."""
        self._drives.update(measured.drive, applied.drive)
        if self._calibration.known:
            measured = self._calibration.corrected(measured, self._at_markers(self._body.q))
        measured = self._held(measured)
        if self._fits and measured.valid.any():
            self._fit(self._framed(measured))
            self._fits = False
        if self._holds:
            measured = self._lost.filled(measured)
        blend = max(self._blend, 1.0 / (self._updates + 1))  # at first a mean, then the filter forgets
        frame, model = self._framed(measured), self._robot.model
        found = update(model, self._body, frame, self._numbers, blend, self._scratch, self._work)
        self._body = found.body
        self._updates += int(found.tip_seen)
        return self._estimate(measured.t, found)

    def _estimate(self, t: float, found: Updated) -> Estimate:
        """Return an update at a time [s] as what it says of robot and drives."""
        body, drives = found.body, self._drives
        return Estimate(
            t=t,
            q=body.q,
            v=body.v,
            drive=body.drive,
            set_point=drives.set_point,
            arrived=drives.arrived,
            lag=drives.lag,
            tension=self._work.tension.copy(),
            position=found.pose[:3],
            normal=found.pose[3:],
            disturbance=found.disturbance,
            converged=found.outcome.converged,
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

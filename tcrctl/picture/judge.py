"""The picture judged in motion: what has changed since the start in a way that a robot cannot change is left out.

    frame -> sides of rings -> joints between rings -> frame without what is not believed -> estimator
                                     too little left -> hold the drives -> stop

It is what an estimator's innovation says, taken where a robot is stiff. Node by node that says little: on healthy
robots with friction and late frames a node is up to 57 mm from where the estimate expects it (one in a hundred
20 mm), and the virtual springs let the estimate follow a marker that drifts. Against the ring above a ring moves by
1 or 2 mm.

What is left out is not valid in the measurement that is recorded, so that a replay needs no judgement.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import PictureError
from tcrctl.picture.kernel import Shape, typical_change
from tcrctl.picture.limits import limits_in_motion
from tcrctl.picture.notes import PictureNotes
from tcrctl.picture.settings import PictureSettings
from tcrctl.picture.shape import anatomy_of, completed, median_shape, shape_of
from tcrctl.picture.shares import Shares, is_strange, joint_shares, side_shares
from tcrctl.picture.suspects import Suspect, Verdict, judge_joints, wrong_markers, wrong_rings
from tcrctl.robot.module import RING
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Measurement

#: What was left out comes back at this share of its limit.
BACK: Final = 0.7
#: Time constant of the noise that is seen [s].
FILTER: Final = 1.0
#: Median of the absolute values of a normal variable, and what two frames make of a marker's noise in a side.
MEDIAN: Final = 0.6745
TWO_FRAMES: Final = 2.0

Report = Callable[[str, str, str], None]


class PictureJudge:
    """See the module's docstring; judges the frames of one run.

    Attributes:
        doubt: Why the drives must be held now; empty if they need not.
    """

    def __init__(
        self,
        settings: PictureSettings,
        robot: Robot,
        period: float,
        start: Sequence[Measurement],
        report: Report,
    ) -> None:
        """Take the robot as it is at the start.

        Args:
            settings: Section ``safety.picture``.
            robot: As the controller knows it.
            period: Control period [s].
            start: Frames of the robot at rest.
            report: Takes kind, level and text of an event.
        """
        self.doubt = ""
        self._settings, self._period = settings, period
        self._limits, self._anatomy = limits_in_motion(settings), anatomy_of(robot)
        self._notes = PictureNotes(report)
        n = robot.n_modules
        self._out, self._frame_out = np.zeros(RING * n, np.bool_), False
        self._now, self._held_since = 0.0, 0.0
        self._last: tuple[float, Array] = (-np.inf, np.full((n, RING), np.nan))
        self._noise, self._blend = 0.0, 1.0
        shapes = []
        for measured in start:
            shapes.append(shape_of(self._anatomy, measured.nodes.astype(float), measured.valid))
            self._listen(measured.t, shapes[-1].side)
        self._start, self._unknown = median_shape(shapes), True
        self._blend = -float(np.expm1(-period / FILTER))
        self._warm_up(start[-1], shapes[-1])

    def _warm_up(self, measured: Measurement, shape: Shape) -> None:
        """Use every kernel once, so that none is compiled or loaded in motion."""
        is_strange(self._start, shape, self._limits, self._noise)
        self._searched(measured.nodes.astype(float), measured.valid, shape)

    def judged(self, measured: Measurement, elapsed: float) -> Measurement:
        """Return the frame without what is not believed; the frame itself if all of it is.

        Args:
            measured: The frame.
            elapsed: Time since the first step of the run, missed steps counted [s].
        """
        self._now = elapsed
        nodes, seen = measured.nodes.astype(float), measured.valid
        shape = shape_of(self._anatomy, nodes, seen)
        self._listen(measured.t, shape.side)
        if not self._is_doubtful(shape):
            self._doubt((), few=False)
            return measured
        verdict = self._searched(nodes, seen, shape)
        self._out, self._frame_out = verdict.out, verdict.frame
        left = int(np.count_nonzero(seen & ~verdict.out))
        least = self._settings.least_share
        few = left < least * np.count_nonzero(seen) or 1.0 - verdict.strange < least
        self._doubt(verdict.suspects, few=verdict.frame or bool(few))
        if not verdict.out.any():
            return measured
        return replace(measured, valid=seen & ~verdict.out)

    def broken(self, step: int) -> PictureError | None:
        """Return why the run must stop now; None if it need not.

        It stops in the step that is nearest to the limit of time, so that steps that begin a little early or late
        make no difference; a step that was missed, or one that took long, is time in which the drives were held.
        """
        held = self._now - self._held_since
        if not self.doubt or held <= self._settings.stop_s - 0.5 * self._period:
            return None
        return PictureError(step, self.doubt)

    def _is_doubtful(self, shape: Shape) -> bool:
        """Return whether anything is not believed, or was not; nearly always nothing, which one look tells."""
        if self._unknown:
            self._start = completed(self._start, shape)
            self._unknown = any(np.isnan(part).any() for part in self._start)
        ill = self._frame_out or np.count_nonzero(self._out) > 0
        return bool(ill or is_strange(self._start, shape, self._limits, self._noise))

    def _searched(self, nodes: Array, seen: NDArray[np.bool_], shape: Shape) -> Verdict:
        """Return what is not believed, marker by marker and ring by ring."""
        verdict = Verdict(np.zeros_like(self._out))
        rings_out = self._out.reshape(-1, RING).any(axis=1)
        again = np.where(rings_out, BACK, 1.0)
        change = shape.since(self._start)
        above = np.concatenate([[BACK if self._frame_out else 1.0], again[:-1]])
        joints = np.minimum(again, above)

        def look(out: NDArray[np.bool_]) -> Shares:
            now = change if not out.any() else shape_of(self._anatomy, nodes, seen & ~out).since(self._start)
            return joint_shares(now, self._limits, self._noise).over(joints)

        worst = look(verdict.out).worst
        judge_joints(verdict, worst)
        wrong_markers(verdict, side_shares(change, self._limits, self._noise) / again[:, None], worst)
        wrong_rings(verdict, look)
        return verdict

    def _listen(self, t: float, side: Array) -> None:
        """Find the noise of the markers from how the sides of rings, which are stiff, differ in two frames."""
        before, self._last = self._last, (t, side)
        if t == before[0]:
            return
        change = typical_change(side, before[1])
        if not math.isnan(change):
            self._noise += self._blend * (change / (MEDIAN * TWO_FRAMES) - self._noise)

    def _doubt(self, suspects: Sequence[Suspect], *, few: bool) -> None:
        if not self.doubt:
            self._held_since = self._now
        self.doubt = self._notes.note(suspects, self._now, held=few)

"""The references of a run, step by step; where a trajectory is known before, for many steps at once.

    trajectory -> poses at all instants of the next steps, each asked for once -> reference of one step

Neighbouring steps look at the same instants: of 17 in a step 16 belong to others too. To ask for one instant costs
almost as much as to ask for a hundred, and to ask step by step more than half as much as control itself.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from tcrctl.signals import Array, Reference
from tcrctl.trajectory.trajectory import Trajectory, drives_of, sample_reference

#: Steps that are asked for at once, which must not take long: a paced run waits for it.
STEPS: Final = 128


def in_periods(ahead: Array, period: float) -> Array:
    """Return prediction instants ``ahead`` (n,) [s] in periods, so that ``(k + ahead) * period`` is their time.

    An instant that several steps look at then has the same bits in all of them, and so has its reference: in the
    log all but one are a repetition, which the compressor removes.
    """
    return np.asarray(np.round(ahead / period, 9))


class _Block(NamedTuple):
    """Poses of some steps.

    Attributes:
        first: The first step.
        rows: For every step, the rows of its instant and of its prediction instants (steps, 1 + n).
        position: End positions (instants, 3) [m].
        normal: End normals (instants, 3), or None.
        drive: Drive lengths at the first prediction instant of every step (steps, m) [m], or None.
    """

    first: int
    rows: np.ndarray
    position: Array
    normal: Array | None
    drive: Array | None


class References:
    """Asks a trajectory for the references of a run.

    A trajectory says by ``known_ahead`` that it gives the same poses whenever it is asked; any other one, a record
    or one from elsewhere, is asked when a step is due.
    """

    def __init__(self, trajectory: Trajectory, period: float) -> None:
        """Take a trajectory and the control period [s]."""
        self._trajectory, self._period = trajectory, period
        self._known = bool(getattr(trajectory, "known_ahead", False))
        self._ahead, self._block = np.zeros(0), _Block(0, np.zeros((0, 1), int), np.zeros((0, 3)), None, None)

    def at(self, k: int, ahead: Array) -> Reference:
        """Return the reference of step ``k`` with prediction instants ``ahead`` (n,) [s] after it."""
        if not self._known or ahead.size == 0:
            times = (k + in_periods(ahead, self._period)) * self._period
            return sample_reference(self._trajectory, k * self._period, times)
        same = ahead is self._ahead or np.array_equal(ahead, self._ahead)
        if not same or not 0 <= k - self._block.first < len(self._block.rows):
            self._ahead, self._block = ahead, self._asked(k, ahead)
        return self._of_step(k)

    def _asked(self, first: int, ahead: Array) -> _Block:
        steps = first + np.arange(STEPS)
        offsets = np.concatenate(([0.0], in_periods(ahead, self._period)))
        asked = (steps[:, None] + offsets) * self._period
        times, rows = np.unique(asked, return_inverse=True)
        trajectory = self._trajectory
        return _Block(
            first,
            rows.reshape(asked.shape),
            trajectory.position(times),
            trajectory.normal(times),
            drives_of(trajectory, np.array(asked[:, 1])),
        )

    def _of_step(self, k: int) -> Reference:
        block, i = self._block, k - self._block.first
        now, first, last = int(block.rows[i, 0]), int(block.rows[i, 1]), int(block.rows[i, -1])
        in_a_row = last - first == block.rows.shape[1] - 2  # then no step needs an array of its own
        ahead = slice(first, last + 1) if in_a_row else block.rows[i, 1:]
        position, normal = block.position, block.normal
        return Reference(
            t=k * self._period,
            position=position[now],
            normal=None if normal is None else normal[now],
            ahead_position=position[ahead],
            ahead_normal=None if normal is None else normal[ahead],
            drive=None if block.drive is None else block.drive[i],
        )

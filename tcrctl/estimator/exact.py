"""The simulated plant's true state, for studies of the controller alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from tcrctl.elements import sliding_cable
from tcrctl.errors import InputError
from tcrctl.estimator.drives import BelievedDrives
from tcrctl.estimator.settings import ExactSettings
from tcrctl.memory import Kept
from tcrctl.robot import pose
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, Estimate, Measurement

TrueState = Callable[[], tuple[Array, Array]]
"""Returns positions and velocities (3 n_nodes,) each [m], [m/s]."""


class ExactState:
    """Passes on what ``state`` returns: true positions and velocities (3 n_nodes,) each."""

    def __init__(self, robot: Robot, state: TrueState, drives: BelievedDrives) -> None:
        self._robot, self._state, self._drives = robot, state, drives

    def sharpen(self) -> None:
        """Let the drives be as they are believed to be now; see :class:`BelievedDrives`."""
        self._drives.sharpen()

    def memory(self) -> Mapping[str, Kept]:
        """Return what is kept of the drives; the plant remembers all else."""
        return self._drives.memory()

    def update(self, measured: Measurement, applied: Command) -> Estimate:
        """Estimate without error; tensions are those of the controller's model in that shape."""
        self._drives.update(measured.drive, applied.drive)
        drive = self._drives.reached
        q, v = self._state()
        model, tip = self._robot.model, self._robot.tip
        length = np.zeros(self._robot.n_cables)
        gradient = np.zeros((self._robot.n_cables, q.shape[0]))
        sliding_cable.path_gradients(
            q, model.first_hole, model.hole_nodes, model.hole_weights, model.cables, length, gradient
        )
        stretch = length + drive - model.cables[:, sliding_cable.REST]
        return Estimate(
            t=measured.t,
            q=q,
            v=v,
            drive=drive.copy(),
            set_point=self._drives.set_point,
            arrived=self._drives.arrived,
            lag=self._drives.lag,
            tension=np.maximum(model.cables[:, sliding_cable.STIFFNESS] * stretch, 0.0),
            position=pose.position(q, tip),
            normal=pose.normal(q, tip),
            disturbance=np.zeros_like(q),
            converged=True,
        )


def build_exact(
    settings: ExactSettings, robot: Robot, period: float, state: TrueState | None, drives: BelievedDrives
) -> ExactState:
    """Build the estimator; see :func:`tcrctl.estimator.estimator.build_estimator`.

    Raises:
        InputError: If there is no true state.
    """
    del settings, period
    if state is None:
        raise InputError("estimator.kind: exact needs a simulated plant")
    return ExactState(robot, state, drives)

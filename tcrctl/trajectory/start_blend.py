"""The trajectory as it is run: from where the robot really is, smoothly onto the wanted path."""

from __future__ import annotations

from typing import Final

import numpy as np

from tcrctl.numerics import rotation
from tcrctl.signals import Array
from tcrctl.trajectory.own import OwnTrajectory
from tcrctl.trajectory.trajectory import Trajectory, drives_of

#: Steepest slope of the fading, at its middle.
STEEPEST: Final = 35.0 / 16.0


def fade_out(x: Array) -> Array:
    """Return 1 at x <= 0, 0 at x >= 1 (n,); three derivatives vanish at both ends (septic smoothstep)."""
    x = np.clip(x, 0.0, 1.0)
    faded: Array = 1.0 - x**4 * (35.0 - x * (84.0 - x * (70.0 - 20.0 * x)))
    return faded


class StartBlend:
    """A trajectory plus the offset of the robot's start pose, which fades out within ``blend`` [s].

    A real robot at rest stands a millimetre or a degree beside its model. Without this, every run would begin
    with a step of the reference, and a step excites the slow modes. The same holds for drives that a trajectory
    moves, wherever the run before has left them.

    A robot that stands so far away that fading would be faster than ``speed``, for instance where the run before
    has left it, first goes to the start of the trajectory, as slowly as that.

    Attributes:
        approach: Time from rest until the trajectory begins [s]; 0 if the robot is near enough.
        rest: Time in which the robot is left where it is before that [s].
        duration: That of rest, approach and the trajectory [s].
    """

    def __init__(
        self,
        trajectory: Trajectory,
        position: Array,
        normal: Array,
        blend: float,
        speed: float = np.inf,
        rest: float = 0.0,
        drive: Array | None = None,
    ) -> None:
        """Take up a trajectory.

        Args:
            trajectory: What is wanted.
            position: End position of the robot before the first step (3,) [m].
            normal: Its unit end normal (3,); not used if the trajectory leaves the orientation free.
            blend: Time in which the offset fades out [s]; 0: no offset, the run begins with a step.
            speed: Largest speed at which the offset may fade out while the trajectory goes on [m/s].
            rest: Time in which the robot is left where it is before anything begins [s]; it counts only if there
                is a blend.
            drive: Drive lengths before the first step (m,) [m], for a trajectory that gives some.
        """
        self._trajectory = trajectory
        self.rest = rest if blend > 0.0 else 0.0
        zero = np.zeros(1)
        self._offset = position - trajectory.position(zero)[0]
        self._drives = self._beside(drive)
        needed = (
            STEEPEST * max(float(np.linalg.norm(self._offset)), float(np.abs(self._drives).max())) / speed
        )
        self.approach = needed if needed > blend > 0.0 else 0.0
        self._fading = self.approach or blend
        wanted = trajectory.normal(zero)
        self._turn = np.zeros(3)
        if wanted is not None:
            self._turn = rotation.quaternion_log(rotation.rotation_between(wanted[0], normal))

    @property
    def known_ahead(self) -> bool:
        """Whether it gives the same poses whenever it is asked: one from elsewhere need not."""
        return not isinstance(self._trajectory, OwnTrajectory)

    @property
    def duration(self) -> float:
        """Duration of rest, approach and the trajectory [s]."""
        return self.rest + self.approach + self._trajectory.duration

    def position(self, t: Array) -> Array:
        """Return end positions at times t (n,) [s] as (n, 3) [m]."""
        position: Array = self._trajectory.position(self._since(t)) + self._left(t)[:, None] * self._offset
        return position

    def normal(self, t: Array) -> Array | None:
        """Return unit end normals at times t (n,) [s] as (n, 3), or None if the orientation is free."""
        wanted = self._trajectory.normal(self._since(t))
        return None if wanted is None else _turned(wanted, self._left(t)[:, None] * self._turn)

    def drive(self, t: Array) -> Array | None:
        """Return the trajectory's drive lengths at times t (n,) [s] as (n, m) [m], or None."""
        wanted = drives_of(self._trajectory, self._since(t))
        return None if wanted is None else wanted + self._left(t)[:, None] * self._drives

    def _beside(self, drive: Array | None) -> Array:
        """Return how far drives (m,) are beside the trajectory's first lengths (m,) [m]; zero if unknown."""
        wanted = drives_of(self._trajectory, np.zeros(1))
        if wanted is None or drive is None or not np.isfinite(drive).all():
            return np.zeros(1)
        return np.asarray(drive - wanted[0])

    def _since(self, t: Array) -> Array:
        """Return times of the trajectory at times t (n,) of the run."""
        before = self.rest + self.approach
        return np.maximum(t - before, 0.0) if before else t

    def _left(self, t: Array) -> Array:
        """Return the part of the offset that is left at times t (n,)."""
        return fade_out((t - self.rest) / self._fading) if self._fading > 0.0 else np.zeros(t.shape)


def _turned(vectors: Array, turns: Array) -> Array:
    """Rotate each of ``vectors`` (n, 3) by its rotation vector (n, 3) [rad], formula of Rodrigues."""
    angle = np.linalg.norm(turns, axis=1, keepdims=True)
    axis = turns / np.where(angle > 0.0, angle, 1.0)
    along = np.sum(axis * vectors, axis=1, keepdims=True)
    turned: Array = (
        vectors * np.cos(angle)
        + np.cross(axis, vectors) * np.sin(angle)
        + axis * along * (1.0 - np.cos(angle))
    )
    return turned

"""``kind: table``: an end pose given by samples, interpolated by cubic splines from rest to rest.

The splines are twice continuously differentiable; at both ends their speed is zero, because a run begins and
ends at rest. What speed and acceleration they need is held against limits before anything moves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from tcrctl.errors import InfeasibleError, InputError
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array
from tcrctl.trajectory.samples import Samples, samples_of
from tcrctl.trajectory.table_files import columns_of
from tcrctl.trajectory.table_settings import TableSettings

MM = 1e-3  # [m]
#: Instants between two samples at which speed and acceleration are looked at.
LOOKS = 4

Spline = Callable[..., Array]


@dataclass(frozen=True, slots=True)
class TableTrajectory:
    """Splines through samples, between two rests.

    Attributes:
        duration: Rests included [s].
        lead_in: Rest at the first sample [s].
        last: Time from the first sample to the last [s].
        path: Position (n, 3) [m] at times after the first sample (n,) [s], or its ``nu``-th derivative.
        turn: Direction of the normal there (n, 3), not of unit length; None if the orientation is free.
    """

    duration: float
    lead_in: float
    last: float
    path: Spline
    turn: Spline | None

    def position(self, t: Array) -> Array:
        """Return end positions at times t (n,) [s] as (n, 3) [m]."""
        return self.path(self._within(t))

    def normal(self, t: Array) -> Array | None:
        """Return unit end normals at times t (n,) [s] as (n, 3), or None."""
        if self.turn is None:
            return None
        found = self.turn(self._within(t))
        normal: Array = found / np.linalg.norm(found, axis=1, keepdims=True)
        return normal

    def _within(self, t: Array) -> Array:
        return np.clip(t - self.lead_in, 0.0, self.last)


def table_samples(settings: TableSettings) -> Samples:
    """Return the samples of a section whose file has been read.

    Raises:
        SpecError: If something is wrong with them, at their lines.
        InputError: If the file has not been read, or is of another kind.
    """
    if not settings.content:
        raise InputError(f"trajectory.file: {settings.file}: is empty, or not at hand")
    return _read(settings.content, settings.file, settings.largest_gap, MM * settings.speed_limit_mm_s)


@lru_cache(maxsize=1)
def _read(content: bytes, file: str, largest_gap: float, speed_limit: float) -> Samples:
    """Read a table once, though its section is checked before it is built."""
    return samples_of(columns_of(content, file), largest_gap, speed_limit)


def build_table(settings: TableSettings, robot: Robot) -> TableTrajectory:
    """Interpolate the samples.

    Args:
        settings: With the content of the file.
        robot: The robot whose rest position is meant.

    Raises:
        SpecError: As :func:`table_samples`.
        InfeasibleError: If the splines need more speed or acceleration than is allowed.
    """
    from scipy.interpolate import CubicSpline  # heavy

    samples = table_samples(settings)
    start = robot.rest_position if settings.origin == "rest" else np.zeros(3)
    spline: Any = partial(CubicSpline, samples.t, bc_type="clamped")
    path = spline(start + samples.position)
    turn = None if samples.normal is None else spline(samples.normal)
    _check(samples.t, path, settings)
    last = float(samples.t[-1])
    return TableTrajectory(
        settings.lead_in_s + last + settings.settle_s, settings.lead_in_s, last, path, turn
    )


def _check(t: Array, path: Spline, settings: TableSettings) -> None:
    """Raise the largest speed or acceleration that is beyond its limit."""
    looks = np.concatenate([t[:-1] + (i / LOOKS) * np.diff(t) for i in range(LOOKS)] + [t[-1:]])
    limits = (
        ("speed", 1, settings.speed_limit_mm_s, "mm/s"),
        ("acceleration", 2, settings.acceleration_limit_mm_s2, "mm/s2"),
    )
    for name, order, limit, unit in limits:
        size = np.linalg.norm(path(looks, order), axis=1) / MM
        worst = int(np.argmax(size))
        if size[worst] > limit:
            key = f"trajectory.{name}_limit_{unit.replace('/', '_')}"
            hint = f"Smooth the samples, stretch their time, or raise {key}."
            raise InfeasibleError(
                float(looks[worst]), f"{name} of {settings.file}", size[worst], limit, unit, hint=hint
            )

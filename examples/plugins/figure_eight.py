"""A figure of eight; in an experiment: ``trajectory: {kind: ./figure_eight.py:EIGHT}``."""

from __future__ import annotations

import numpy as np

from tcrctl.extend import Array, Positive, Robot, TrajectorySection, quantity


class EightSettings(TrajectorySection):
    """A figure of eight in a horizontal plane, from rest to rest; the orientation is free."""

    width_mm: Positive = quantity("mm", "from side to side", 40.0)
    raise_mm: float = quantity("mm", "height of the plane above the rest position", 30.0)
    duration_s: Positive = quantity("s", "time of the way up and of one round", 20.0)


class Eight:
    """From the rest position up to the plane, and once round."""

    def __init__(self, settings: EightSettings, robot: Robot) -> None:
        self.duration = settings.duration_s
        self.start, self.settings = robot.rest_position, settings

    def position(self, t: Array) -> Array:
        """Return end positions at times t (n,) [s] as (n, 3) [m]."""
        x = np.clip(t / self.duration, 0.0, 1.0)
        up, round_ = (
            smooth(np.clip(4.0 * x, 0.0, 1.0)),
            2.0 * np.pi * smooth(np.clip((4.0 * x - 1.0) / 3.0, 0.0, 1.0)),
        )
        half = 0.5e-3 * self.settings.width_mm
        way = np.stack(
            (half * np.sin(round_), half * np.sin(2.0 * round_), 1e-3 * self.settings.raise_mm * up), axis=1
        )
        path: Array = self.start + way
        return path


def smooth(x: Array) -> Array:
    """Return 0 to 1 with two derivatives that vanish at both ends."""
    return x**3 * (10.0 - x * (15.0 - 6.0 * x))


EIGHT = (EightSettings, Eight)

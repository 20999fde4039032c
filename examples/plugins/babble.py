"""Drives that wander through a box of lengths; in an experiment: ``trajectory: {kind: ./babble.py:BABBLE}``."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tcrctl.extend import Array, Positive, Robot, TrajectorySection, quantity


class BabbleSettings(TrajectorySection):
    """Every drive swings at a period of its own, so that all combinations come by; from rest to rest."""

    gives_drives: ClassVar[bool] = True

    middle_mm: float = quantity("mm", "length about which all drives swing", 20.0)
    swing_mm: Positive = quantity("mm", "how far each swings to both sides", 20.0)
    fastest_s: Positive = quantity(
        "s", "period of the fastest drive; the next ones take 1.3 times as long", 7.0
    )
    duration_s: Positive = quantity("s", "how long", 60.0)


class Babble:
    """Drive lengths over time; the end pose does not matter to who plays them."""

    def __init__(self, settings: BabbleSettings, robot: Robot) -> None:
        self.settings, self.duration, self.rest = settings, settings.duration_s, robot.rest_position
        self.periods = settings.fastest_s * 1.3 ** np.arange(robot.n_cables)

    def drive(self, t: Array) -> Array:
        """Return drive lengths at times t (n,) [s] as (n, m) [m]."""
        s = self.settings
        fade = np.clip(np.minimum(t, s.duration_s - t) / 4.0, 0.0, 1.0)[:, None]
        waves = s.middle_mm + s.swing_mm * np.sin(2.0 * np.pi * t[:, None] / self.periods)
        drives: Array = 1e-3 * fade**2 * (3.0 - 2.0 * fade) * waves
        return drives

    def position(self, t: Array) -> Array:
        """Return the rest position (n, 3) [m] at all times."""
        return np.tile(self.rest, (len(t), 1))


BABBLE = (BabbleSettings, Babble)

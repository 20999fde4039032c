"""``kind: sine`` and ``chirp``: all drives swing in one pattern about a middle.

    d(t) = middle + amplitude w(t) sin φ(t),    sine: φ = 2π f t,
    chirp: linear φ = 2π (f0 t + (f1 - f0) t²/2T), exponential φ = 2π T f0 ((f1/f0)^(t/T) - 1) / ln(f1/f0)

with a window w that grows and dies away like a smooth ramp. Before and after, the drives go to the middle and back.
All drive lengths lie on two lines, from zero to the middle and through it along the amplitude, so the end poses
at rest are found once along those.
"""  # fmt: skip

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tcrctl.robot.robot import Robot
from tcrctl.signals import Array
from tcrctl.trajectory.drives import MM, end_poses, interpolated, samples
from tcrctl.trajectory.time_law import ramp
from tcrctl.trajectory.wave_settings import ChirpSettings, SineSettings, WaveSection


@dataclass(frozen=True, slots=True)
class WaveTrajectory:
    """Drive lengths over time and the end poses at rest that go with them.

    Attributes:
        settings: The section.
        corners: Zero, middle, middle minus amplitude, middle plus amplitude (4, m) [m].
        phase: Phase of the wave [rad] at times after its beginning [s].
        s: Places on the lines at which end poses are known (k,), place i at corner i.
        positions: End positions there (k, 3) [m].
        normals: Unit end normals there (k, 3).
    """

    settings: WaveSection
    corners: Array
    phase: Callable[[Array], Array]
    s: Array
    positions: Array
    normals: Array

    @property
    def duration(self) -> float:
        """Rests and ways included [s]."""
        s = self.settings
        return s.lead_in_s + 2.0 * self.way + s.wave_s + s.settle_s

    @property
    def interval(self) -> float:
        """Time between samples that show its speed to a hundredth [s]."""
        return 1.0 / (16.0 * self.settings.fastest_hz)

    @property
    def way(self) -> float:
        """Time of the way to the middle [s]; none if it is zero."""
        return self.settings.move_s if self.corners[1].any() else 0.0

    def drive(self, t: Array) -> Array:
        """Return drive lengths at times t (n,) [s] as (n, m) [m]; clamped beyond the ends."""
        return interpolated(self._place(t), np.arange(4.0), self.corners)

    def position(self, t: Array) -> Array:
        """Return end positions at times t (n,) [s] as (n, 3) [m]."""
        return interpolated(self._place(t), self.s, self.positions)

    def normal(self, t: Array) -> Array:
        """Return unit end normals at times t (n,) [s] as (n, 3)."""
        between = interpolated(self._place(t), self.s, self.normals)
        normal: Array = between / np.linalg.norm(between, axis=1, keepdims=True)
        return normal

    def _place(self, t: Array) -> Array:
        """Return where on the lines the drives are (n,): 0 to 1 on the way, 2.5 + swing / 2 in the wave."""
        s, way = self.settings, self.way
        x = np.clip(t - s.lead_in_s - way, 0.0, s.wave_s)
        swing = self._window(x) * np.sin(self.phase(x))
        before, after = t - s.lead_in_s, t - s.lead_in_s - way - s.wave_s
        share = (
            ramp(np.clip(before / way, 0.0, 1.0)) - ramp(np.clip(after / way, 0.0, 1.0)) if way else 0.0 * t
        )
        waves = (before >= way) & (after <= 0.0)
        return np.where(waves, 2.5 + 0.5 * swing, share)

    def _window(self, x: Array) -> Array:
        fade = self.settings.fade_s
        if fade == 0.0:
            return np.ones_like(x)
        return ramp(np.clip(np.minimum(x, self.settings.wave_s - x) / fade, 0.0, 1.0))


def build_wave(settings: SineSettings | ChirpSettings, robot: Robot) -> WaveTrajectory:
    """Find the end poses along the wave.

    Raises:
        NoEquilibriumError: If the model has no stable shape somewhere on the way.
    """
    middle = MM * np.array(settings.middle_mm or np.zeros(robot.n_cables))
    amplitude = MM * np.array(settings.amplitude_mm)
    corners = np.stack((np.zeros(robot.n_cables), middle, middle - amplitude, middle + amplitude))
    s = samples(corners)
    return WaveTrajectory(settings, corners, _phase(settings), s, *end_poses(corners, s, robot))


def _phase(settings: SineSettings | ChirpSettings) -> Callable[[Array], Array]:
    if isinstance(settings, SineSettings):
        return lambda x: np.asarray(2.0 * np.pi * settings.frequency_hz * x)
    first, span, duration = settings.from_hz, settings.to_hz - settings.from_hz, settings.duration_s
    if settings.spacing == "linear" or span == 0.0:
        return lambda x: np.asarray(2.0 * np.pi * x * (first + 0.5 * span * x / duration))
    octaves = np.log(settings.to_hz / first)
    return lambda x: np.asarray(2.0 * np.pi * duration * first * np.expm1(octaves * x / duration) / octaves)

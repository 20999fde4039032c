"""Cameras of the simulated plant: which markers are reported where, and how old that is.

    shapes of the robot -> exposure -> markers beside their nodes -> frame that is off -> noise, outliers -> losses

A frame that is lost is the last one again, with the time at which that was taken, as a bench reports it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcrctl.numerics.rotation import matrix_from_quaternion, quaternion_exp
from tcrctl.plant.reality_settings import CameraSettings
from tcrctl.robot.module import RING
from tcrctl.signals import Array

Seen = Callable[[NDArray[np.bool_], float], NDArray[np.bool_]]
"""Which markers can be seen at a time, out of those that carry one."""


class CameraFrame(NamedTuple):
    """What the cameras report.

    Attributes:
        t: Middle of the exposure [s].
        nodes: Markers (n_markers, 3), all zero before the first frame [m].
        valid: Which were seen (n_markers,).
    """

    t: float
    nodes: Array
    valid: NDArray[np.bool_]


def directions(random: np.random.Generator, count: int) -> Array:
    """Draw unit vectors (count, 3), evenly on the sphere."""
    drawn = random.standard_normal((count, 3))
    return np.asarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True))


def ring_frames(nodes: Array) -> Array:
    """Return the axes of every ring (n_rings, 3, 3), one per row, from its nodes (3 n_rings, 3)."""
    rings = nodes.reshape(-1, RING, 3)
    x = rings[:, 1] - rings[:, 0]
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    z = np.cross(x, rings[:, 2] - rings[:, 0])
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=1)


class CameraDraw(NamedTuple):
    """What is wrong with cameras from beginning to end.

    Attributes:
        bias: Every marker beside its node, in the axes of its ring (n_markers, 3) [m].
        rotation: Rotation vector by which the frame is off (3,) [rad].
        translation: Distance by which it is off (3,) [m].
    """

    bias: Array
    rotation: Array
    translation: Array

    def beside(self, nodes: Array) -> Array:
        """Return the markers (n_markers, 3) of ring nodes (n_markers, 3) [m]."""
        axes = np.repeat(ring_frames(nodes), RING, axis=0)
        return np.asarray(nodes + np.einsum("ni,nij->nj", self.bias, axes))

    def in_frame(self, markers: Array) -> Array:
        """Return markers (n, 3) in the frame that the cameras take for that of the robot [m]."""
        return np.asarray(
            markers @ matrix_from_quaternion(quaternion_exp(self.rotation)).T + self.translation
        )


def draw_cameras(settings: CameraSettings, markers: int, seed: int) -> CameraDraw:
    """Draw what stays; ``seed`` counts if the settings have none."""
    fixed = np.random.default_rng([_seed(settings, seed), 0])
    bias = 1e-3 * settings.marker_bias_mm * directions(fixed, markers)
    axis, way = directions(fixed, 2)
    off = settings.frame_error
    return CameraDraw(bias, np.radians(off.rotation_deg) * axis, 1e-3 * off.translation_mm * way)


def _seed(settings: CameraSettings, seed: int) -> int:
    return seed if settings.seed is None else settings.seed


class ImperfectCameras:
    """See the module's docstring.

    Attributes:
        draw: What stays as it is.
    """

    def __init__(
        self, settings: CameraSettings, markers: int, latency: float, noise: float, seed: int
    ) -> None:
        """Draw what stays; ``latency`` [s], ``noise`` per coordinate [m]."""
        self._random = np.random.default_rng([_seed(settings, seed), 1])
        self._settings = settings
        self._latency = latency
        self._noise = noise
        self.draw = draw_cameras(settings, markers, seed)
        self._shapes: deque[tuple[float, Array]] = deque()
        self._markers = markers
        self._last = CameraFrame(0.0, np.zeros((markers, 3)), np.zeros(markers, np.bool_))
        self._coming, self._arrival, self._newest = 0, latency + self._late(), 0.0

    def watch(self, t: float, nodes: Array) -> None:
        """Remember the ring nodes (n_markers, 3) [m] at ``t`` [s]; between two shapes they move straight."""
        self._shapes.append((t, nodes))

    def without_noise(self) -> None:
        """Report what is seen without noise from now on."""
        self._noise = 0.0

    def read(self, now: float, carries: NDArray[np.bool_], seen: Seen) -> CameraFrame:
        """Report the newest frame.

        Args:
            now: Time [s].
            carries: Which nodes carry a marker (n_markers,).
            seen: Which of them can be seen at a time.
        """
        exposed = self._exposure(now)
        stale = 0.0 < exposed == self._last.t
        if not stale and not self._happens(self._settings.lost_frames):
            nodes = self._reported(self._shape(exposed))
            valid = seen(carries, exposed)
            valid &= self._random.random(self._markers) >= self._settings.lost_markers
            self._last = CameraFrame(exposed, nodes, valid)
        return self._last

    def _happens(self, share: float) -> bool:
        return bool(self._random.random() < share)

    def _late(self) -> float:
        """Return the time by which a frame comes later than usual [s]."""
        return 1e-3 * self._settings.age_jitter_ms * abs(float(self._random.standard_normal()))

    def _exposure(self, now: float) -> float:
        """Return when the newest frame that has arrived was taken; before the run everything stood still."""
        rate = self._settings.rate_hz
        if rate is None:
            return max(now - self._latency - self._late(), self._last.t)
        while self._arrival <= now:
            self._newest, self._coming = self._coming / rate, self._coming + 1
            due = self._coming / rate + self._latency + self._late()
            self._arrival = max(self._arrival, due)
        return self._newest

    def _shape(self, t: float) -> Array:
        """Return the ring nodes at ``t``; older shapes are not asked for any more."""
        shapes = self._shapes
        while len(shapes) > 1 and shapes[1][0] <= t:
            shapes.popleft()
        if len(shapes) == 1:
            return shapes[0][1]
        (t0, x0), (t1, x1) = shapes[0], shapes[1]
        return np.asarray(x0 + (x1 - x0) * max(0.0, (t - t0) / (t1 - t0)))

    def _reported(self, nodes: Array) -> Array:
        """Return the markers in the frame that the cameras take for that of the robot (n_markers, 3) [m]."""
        markers = self.draw.in_frame(self.draw.beside(nodes))
        markers = markers + self._noise * self._random.standard_normal(markers.shape)
        wild = self._random.random(self._markers) < self._settings.outliers.share
        away = 1e-3 * self._settings.outliers.size_mm * directions(self._random, self._markers)
        return np.asarray(markers + wild[:, None] * away)

"""A control period of a plant with real drives, cables, springs and cameras, one internal step after the other.

One internal step:

    set-points -> drives -> cable taken in -> robot, whose springs give way and whose cables creep -> cameras
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcrctl.plant.body import Body
from tcrctl.plant.cameras import ImperfectCameras
from tcrctl.plant.drives import SimulatedDrives
from tcrctl.plant.reality_settings import CameraSettings, DriveSettings
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.plant.time_step import fixed_ms
from tcrctl.signals import Array

#: Drives that do what they are told.
IDEAL_DRIVES = DriveSettings(reports="set_point")


def real_drives(settings: SimulatedSettings, start: Array, period: float) -> SimulatedDrives:
    """Return the drives of a plant that rests at drive lengths ``start`` (m,) [m]."""
    return SimulatedDrives(settings.drives or IDEAL_DRIVES, start, period / steps(settings, period))


def steps(settings: SimulatedSettings, period: float) -> int:
    """Return the number of internal steps in a control period [s]."""
    return max(1, round(1000.0 * period / fixed_ms(settings.step_ms)))


class Reality:
    """What lies between command and robot, and between robot and measurement.

    Attributes:
        drives: Its drives.
        cameras: Its cameras.
    """

    def __init__(
        self,
        settings: SimulatedSettings,
        body: Body,
        drives: SimulatedDrives,
        rows: NDArray[np.int64],
        period: float,
        seed: int,
    ) -> None:
        """Be at rest.

        Args:
            settings: Of the plant.
            body: The robot.
            drives: As they are at rest.
            rows: Rows of the nodes that cameras look at (n_markers,).
            period: Control period [s].
            seed: Of what is random and has no seed of its own.
        """
        self.drives = drives
        self._body = body
        self._rows = rows
        self._count = steps(settings, period)
        self._h = period / self._count
        self.cameras = ImperfectCameras(
            settings.cameras or CameraSettings(),
            rows.size,
            settings.latency_ms / 1000.0,
            settings.noise_um * 1e-6,
            seed,
        )
        self._watch(0.0)

    def period(self, speed: Array, force: Array, t: float) -> None:
        """Let a control period pass.

        Args:
            speed: Rates of the set-points (m,) [m/s].
            force: External force, weight included (3 n_nodes,) [N].
            t: Time at its beginning [s].

        Raises:
            DivergenceError: If an internal step did not converge.
        """
        h = self._h
        for i in range(self._count):
            self._body.follow(self.drives.move(speed), h, force, t + i * h)
            self._watch(t + (i + 1) * h)

    def _watch(self, t: float) -> None:
        self.cameras.watch(t, self._body.state.q.reshape(-1, 3)[self._rows])

"""A control period of a plant with real drives, cables, springs and cameras, one internal step after the other.

    set-points -> drives -> cable taken in - late elongation -> robot -> springs give way, cables creep -> cameras
"""  # fmt: skip

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcrctl.elements import sliding_cable
from tcrctl.plant.body import Body
from tcrctl.plant.cameras import ImperfectCameras
from tcrctl.plant.creep import Creep
from tcrctl.plant.drives import SimulatedDrives
from tcrctl.plant.reality_settings import CableEffects, CameraSettings, DriveSettings
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.signals import Array

#: Drives that do what they are told.
IDEAL_DRIVES = DriveSettings(reports="set_point")


def steps_one_by_one(settings: SimulatedSettings) -> bool:
    """Return whether a plant has something that happens between internal steps."""
    cables = settings.cables
    return (
        settings.drives is not None
        or settings.springs_hysteresis is not None
        or settings.cameras is not None
        or (cables is not None and bool(cables.creep))
    )


def real_drives(settings: SimulatedSettings, start: Array, period: float) -> SimulatedDrives:
    """Return the drives of a plant that rests at drive lengths ``start`` (m,) [m]."""
    return SimulatedDrives(settings.drives or IDEAL_DRIVES, start, period / steps(settings, period))


def steps(settings: SimulatedSettings, period: float) -> int:
    """Return the number of internal steps in a control period [s]."""
    return max(1, round(1000.0 * period / settings.step_ms))


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
        self.drives, self._body, self._rows = drives, body, rows
        self._count = steps(settings, period)
        self._step = period / self._count
        self.cameras = ImperfectCameras(
            settings.cameras or CameraSettings(),
            rows.size,
            settings.latency_ms / 1000.0,
            settings.noise_um * 1e-6,
            seed,
        )
        self._late = np.zeros_like(body.state.drive)
        self._creep = Creep((settings.cables or CableEffects()).creep, self._elastic())
        self._watch(0.0)

    def period(self, speed: Array, force: Array, t: float) -> None:
        """Let a control period pass.

        Args:
            speed: Rates of the set-points (m,) [m/s].
            force: External force, weight included (3 n_nodes,) [N].
            t: Time at its beginning [s].

        Raises:
            DivergenceError: If a time step did not converge.
        """
        body, h = self._body, self._step
        for i in range(self._count):
            wanted = self.drives.move(speed) - self._late
            body.advance((wanted - body.state.drive) / h, h, force, t + i * h)
            if body.hysteresis is not None:
                body.hysteresis.give_way(body.state.q)
            self._let_creep()
            self._watch(t + (i + 1) * h)

    def _elastic(self) -> Array:
        """Elastic elongations of the cables (m,) or, where they rub, of their stretches (n_holes,) [m]."""
        slip, body = self._body.state.slip, self._body
        if slip is None:
            return np.asarray(body.tension / body.model.cables[:, sliding_cable.STIFFNESS])
        return np.asarray(slip.tension / slip.stiffness)

    def _let_creep(self) -> None:
        """What comes late makes a cable longer: without friction as if its drive had paid it out."""
        grown = self._creep.step(self._elastic(), self._step)
        slip = self._body.state.slip
        if slip is None:
            self._late += grown
        else:
            slip.rest[:] += grown

    def _watch(self, t: float) -> None:
        self.cameras.watch(t, self._body.state.q.reshape(-1, 3)[self._rows])

"""Dither: a small fast motion of the drives that keeps the cables from sticking in their holes.

Friction in the holes makes the end position a relay of the drives' directions: every reversal of a cable throws the
end by millimetres, and a loop that does not know of it hunts. A cable that always slides to and fro feels on the
mean only 2/π asin(U / V) of its friction, with mean speed U and dither speed V: a little damping, no relay.

    triangle wave of the drive lengths, ± A, sign +1 or -1 by cable so that forces and motions cancel
    A is the largest one if cables are known to rub; it grows while the end does not go where the prediction said,
    and shrinks slowly otherwise

While a run settles and the reference rests, a small wave with another pattern tries whether cables rub
(controller.friction_probe). Later friction shows by the innovation: the measured end position against the one
predicted a period before, averaged over a whole wave so that the dither's own trace is not in it, less a part of
the motion that was predicted: a wrong model misses by that, too. A robot without friction is left in peace. [ADC94]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from tcrctl.controller import surprise
from tcrctl.controller.dither_settings import DitherSettings
from tcrctl.controller.friction_probe import SHORTEST, FrictionProbe
from tcrctl.controller.surprise import adapting, still_wave
from tcrctl.memory import POSITION, Kept
from tcrctl.robot.robot import Robot
from tcrctl.robot.swing import signs
from tcrctl.signals import Array, Estimate

#: By how much larger an innovation has to be to say that cables rub that did not while they were probed.
CONVINCING: Final = 5.0
#: From this amplitude on a robot counts as dithered, with weights and gains of its own [m].
AWAKE: Final = 0.5e-3


class Dithered(NamedTuple):
    """What a dither does at one moment.

    Attributes:
        amplitude: Half of the travel to and fro [m].
        place: Where it has moved the drives (m,) [m].
        fastest: Speed of the drives in the wave [m/s].
    """

    amplitude: float
    place: Array
    fastest: float = 0.0

    @property
    def awake(self) -> float:
        """How far the dither has grown, 0 to 1."""
        return min(self.amplitude / AWAKE, 1.0)


class Dither:
    """Adaptive dither of one controller.

    Attributes:
        runs: It is on, and was not told to stand still.
    """

    def __init__(self, settings: DitherSettings | None, period: float, robot: Robot, limit: float) -> None:
        """Take a ``dither:`` section or None for none, the control period [s], the robot, the speed limit [m/s]."""
        self._settings = settings or DitherSettings()
        self._period = period
        self.runs = settings is not None
        self._half_wave = max(1, round(0.5 / (self._settings.frequency_hz * period)))  # periods
        self._step = (
            self._half_wave // 2
        )  # it begins halfway up, so that the mean of the first wave is zero too
        self._signs = signs(robot) if self.runs else np.zeros(robot.n_cables)
        room = self._settings.speed_part * limit * self._half_wave * period / 2.0
        self._most = min(self._settings.most_mm / 1e3, room)
        self._least = min(self._settings.least_mm / 1e3, self._most)
        self._adapting = adapting(self._settings, period, self._least, self._most)
        self._seen = still_wave(self._least if self.runs else 0.0, 2 * self._half_wave)
        self._probe: FrictionProbe | None = None
        told = self._half_wave >= SHORTEST and self._settings.probe_mm > 0.0
        if self.runs and told and self._settings.probe_mm > self._settings.least_mm:
            self._probe = FrictionProbe(robot, self._half_wave, period)
        self._probes = False
        self._wave, self._place = 0.0, np.zeros(robot.n_cables)
        self._expects = False

    @property
    def amplitude(self) -> float:
        """Half of the travel to and fro [m]."""
        return float(self._seen.sizes[0])

    @property
    def sleeps(self) -> bool:
        """Whether it moves no drive, and none has to come back."""
        return bool(self._seen.sizes[0] == 0.0 and self._wave == 0.0) and not np.count_nonzero(self._place)

    @property
    def thrown(self) -> float | None:
        """By how much more than without friction the probing wave has thrown the end [m]; None: not known."""
        return None if self._probe is None else self._probe.thrown

    @property
    def rubs(self) -> bool:
        """Whether the probing wave has told that cables rub."""
        return self.thrown is not None and self.thrown > self._settings.rubs_mm / 1e3

    @property
    def slides(self) -> bool:
        """Whether the probing wave has told that they do not."""
        return self.thrown is not None and not self.rubs

    @property
    def now(self) -> Dithered:
        """Amplitude and speed, and where the drives are in the wave."""
        fastest = 2.0 * self.amplitude / (self._half_wave * self._period)
        return Dithered(self.amplitude, self._place.copy(), fastest)

    @property
    def innovation(self) -> float:
        """Filtered size of the innovation over a wave [m]."""
        return float(self._seen.sizes[1])

    def stand_still(self) -> None:
        """Move no drive from now on: under a periodic input a loop has no equilibrium to linearise about."""
        self.runs = False
        self._seen.sizes[:] = 0.0
        self._wave = 0.0
        self._place[:] = 0.0

    def memory(self) -> Mapping[str, Kept]:
        """Return where the dither is, its amplitude and what it compares with, if it runs.

        Its phase is left out: that is time.
        """
        if not self.runs:
            return {}
        seen = {name: values.ravel() for name, values in self._seen._asdict().items()}  # views
        kept = {"place": self._place, **seen}
        return {f"dither_{name}": Kept(values, POSITION) for name, values in kept.items()}

    def observe(self, position: Array, estimate: Estimate, *, settling: bool = False) -> None:
        """Look at what has become of the wave or of the expected motion, and adapt the amplitude.

        Args:
            position: Measured end position now (3,) [m].
            estimate: The end when it was measured, and where the drives were.
            settling: The reference rests, and nothing else moves the drives.
        """
        if not self.runs:
            return
        if self._probe is not None and settling and self._probe.thrown is None:
            self._try(self._probe, estimate)
        elif self._probes:  # it is over
            self._probes = False
            self._seen.sizes[0] = self._most if self.rubs else self._least
        else:
            slot, threshold = self._step % self._seen.errors.shape[0], self._settings.threshold_mm / 1e3
            threshold *= CONVINCING if self.slides else 1.0
            surprise.observe(self._seen, self._adapting, position, slot, self._expects, threshold)
        self._seen.position[:] = position

    def _try(self, probe: FrictionProbe, estimate: Estimate) -> None:
        """Find out whether cables rub."""
        self._probes = True
        self._seen.sizes[0] = min(self._settings.probe_mm / 1e3, self._most)
        probe.observe(estimate.position, estimate.drive)

    def expect(self, position: Array | None) -> None:
        """Take the end position (3,) [m] that is expected one period from now; None if nothing is."""
        self._expects = position is not None and math.isfinite(position.sum())
        self._seen.expected[:] = position if position is not None and self._expects else 0.0

    def sleep(self) -> None:
        """Move on by a period in which it sleeps."""
        self._step += 1

    def speed(self) -> Array:
        """Move on by a period, and return what is added to the drive speeds in it (m,) [m/s]."""
        if not self.runs:
            return np.zeros(self._place.size)
        up = 1.0 if (self._step // self._half_wave) % 2 == 0 else -1.0
        self._step += 1
        ramp = 2.0 * self.amplitude / self._half_wave  # way of a period
        self._wave = min(max(self._wave + up * ramp, -self.amplitude), self.amplitude)
        pattern = self._probe.pattern if self._probe is not None and self._probes else self._signs
        wanted = self._wave * pattern
        moved = wanted - self._place
        self._place[:] = wanted
        return np.asarray(moved / self._period)

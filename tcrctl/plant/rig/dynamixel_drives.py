"""Dynamixel motors as the rig plant wants them: one per cable, the number of the axis is that of the motor.

Their torque is on from the first time that they are switched on, and stays on: without it cables would be let go.
*Enabled* is that the bus watchdog of all of them is armed, which another program sees, too.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcr_hardware.dynamixel import table
from tcr_hardware.dynamixel.bus import DynamixelBus, signed, unsigned
from tcr_hardware.errors import HardwareError
from tcrctl.errors import DeviceError, InputError
from tcrctl.plant.rig.devices import DeviceLimits, DriveControl, DriveStatus, Identity
from tcrctl.plant.rig.finding import Finding
from tcrctl.plant.rig.mounting import CableAxis
from tcrctl.plant.rig.settings import Dynamixel

#: Motors that move less than this from one exchange to the next stand still [counts].
STILL: Final = 2
#: The watchdog has tripped so long after its time, if it has [s].
MARGIN: Final = 0.1
#: Every packet feeds the bus watchdog, so after an exchange motors are only read for this share of its time.
READABLE: Final = 0.4
#: A set-point is reached by this factor sooner than the next one is due, which may come a little early.
SOONER: Final = 1.1


class DynamixelDrives:
    """The motors of one robot."""

    def __init__(self, settings: Dynamixel, cables: tuple[CableAxis, ...]) -> None:
        """Connect and read how the motors are set; nothing is written.

        Raises:
            DeviceError: If a motor does not answer.
            InputError: If one is set otherwise than the rig file needs it.
        """
        self._settings, self._cables, self._where = settings, cables, f"Dynamixel bus at {settings.device}"
        self._ids = [cable.axis for cable in cables]
        self._signs = np.array([cable.sign for cable in cables])
        self._count = 1e3 * settings.mm_per_turn / table.TURN  # [um]
        self._velocity_unit = 1e3 * settings.mm_per_turn * table.VELOCITY_UNIT  # [um/s]
        self._fastest = [max(1, int(cable.speed / self._velocity_unit)) for cable in cables]
        self._period: float | None = None  # of who sends set-points [s], once it is known
        self._bus: DynamixelBus = self._call(
            lambda: DynamixelBus(settings.device, settings.baud, self._ids, settings.timeout_ms / 1e3)
        )
        try:
            self._check_modes()
            self.limits = self._read_limits()
            self._offsets = self._each(table.HOMING_OFFSET)
        except BaseException:
            self._bus.close()
            raise
        longest = 1e-3 * settings.watchdog_ms / ((1.0 + READABLE) * table.WATCHDOG_UNIT)
        self._ticks = max(1, math.floor(longest + 1e-9))
        self._fed_for = self._ticks * table.WATCHDOG_UNIT
        self.watchdog = (1.0 + READABLE) * self._fed_for
        models = ", ".join(str(self._bus.models[motor]) for motor in self._ids)
        told = {"models": models, "watchdog": f"{1e3 * self.watchdog:g} ms"}
        self.identity = Identity(
            "Dynamixel bus", self._where, f"models {models}, watchdog {told['watchdog']}", told
        )
        self._last, self._exchanged = self._read(), -math.inf
        self._sent = self._last.position
        self._reset_seen = self._zero_seen = self._stopping = False
        self._reject = ""

    def load(self, period: float) -> float:
        """Return the share of a period [s] that the bytes of an exchange are on the wire.

        Raises:
            InputError: If they take longer, or the watchdog is not three periods.
        """
        share = 2.0 * self._bus.seconds() / period  # a loop reads, then exchanges
        if share >= 1.0:
            long = f"to read and to exchange takes {2e3 * self._bus.seconds():.1f} ms, too long"
            raise InputError(f"{self._where}: {long}", hint="Raise the baud rate of the motors.")
        if 3.0 * period > self._fed_for:
            least = math.ceil(3e3 * (1.0 + READABLE) * period)
            raise InputError(f"{self._where}: watchdog_ms must be at least {least} for {1e3 * period:g} ms")
        self._period = period
        return share

    def status(self) -> DriveStatus:
        """Read, unless that would feed the watchdog of drives that nobody moves any more; then tell what was.

        Raises:
            DeviceError: If a motor does not answer.
        """
        since = time.monotonic() - self._exchanged
        tripped_by = self.watchdog + MARGIN
        if self._last.enabled and READABLE * self._fed_for < since < tripped_by:
            return self._last
        return self._read()

    def exchange(self, target: NDArray[np.int64], control: DriveControl) -> DriveStatus:
        """Send set-points, or hold, and read how all motors are.

        Raises:
            DeviceError: If a motor does not answer.
        """
        before = self._last
        self._edges(before, control)
        wanted = control.enable and control.permit
        if wanted and not before.enabled and not (before.watchdog or before.fault or self._stopping):
            self._switch_on()
        elif before.enabled and not wanted:
            self._stop()
        elif before.enabled and control.follow:
            self._send(target)
        self._last, self._exchanged = self._read(), time.monotonic()
        self._still(before)
        return self._last

    def checks(self) -> tuple[Finding, ...]:
        """Return nothing: how motors are set was looked at when the line was opened."""
        return ()

    def close(self) -> None:
        """Close the line; motors hold where they are."""
        self._bus.close()

    # --- what is done to the motors ---

    def _edges(self, before: DriveStatus, control: DriveControl) -> None:
        if control.reset and not self._reset_seen:
            self._all(table.BUS_WATCHDOG, dict.fromkeys(self._ids, 0))
        if control.zero and not self._zero_seen and not before.enabled:
            self._zero()
        self._reset_seen, self._zero_seen = control.reset, control.zero

    def _switch_on(self) -> None:
        """Torque on where the motors stand, then the watchdog."""
        self._all(table.BUS_WATCHDOG, dict.fromkeys(self._ids, 0))
        self._profile()
        self._hold()
        self._all(table.TORQUE_ENABLE, dict.fromkeys(self._ids, 1))
        self._all(table.BUS_WATCHDOG, dict.fromkeys(self._ids, self._ticks))

    def _profile(self) -> None:
        self._all(table.PROFILE_VELOCITY, dict(zip(self._ids, self._fastest, strict=True)))
        if self._settings.current_limit_ma is not None:
            units = int(self._settings.current_limit_ma / self._settings.current_unit_ma)
            self._all(table.GOAL_CURRENT, dict.fromkeys(self._ids, units))

    def _hold(self) -> None:
        """Make the present positions the goals."""
        data = self._call(self._bus.read_all)
        counts = {motor: signed(data[motor], table.PRESENT_POSITION) for motor in self._ids}
        self._all(table.GOAL_POSITION, counts)
        self._sent = self._lengths(np.array(list(counts.values())))

    def _stop(self) -> None:
        if not self._stopping:
            self._hold()
            self._stopping = True

    def _still(self, before: DriveStatus) -> None:
        """End a stop when the motors stand."""
        moved = float(np.abs(self._last.position - before.position).max()) / self._count
        if self._stopping and moved <= STILL:
            self._all(table.BUS_WATCHDOG, dict.fromkeys(self._ids, 0))
            self._stopping, self._last = False, self._read()

    def _send(self, target: NDArray[np.int64]) -> None:
        outside = (target < self.limits.low) | (target > self.limits.high)
        self._reject = (
            f"out of range, cable {self._cables[int(np.argmax(outside))].name}" if outside.any() else ""
        )
        if not outside.any():
            motions = zip(self._ids, self._velocities(target), self._counts(target), strict=True)
            whole = (1 << 8 * table.GOAL_POSITION.size) - 1
            below = 8 * table.PROFILE_VELOCITY.size
            self._all(table.MOTION, {m: velocity | (goal & whole) << below for m, velocity, goal in motions})
            self._sent = target

    def _velocities(self, target: NDArray[np.int64]) -> list[int]:
        """Return profile velocities that reach set-points in a period: motors that dash and wait shake robots."""
        if self._period is None:
            return self._fastest
        speeds = SOONER * np.abs(target - self._sent) / self._period  # [um/s]
        units = np.ceil(speeds / self._velocity_unit).astype(int)
        return [int(value) for value in np.clip(units, 1, self._fastest)]

    def _zero(self) -> None:
        """Move the homing offsets so that the present positions read ``zero_tick``; the torque is off meanwhile."""
        data = self._call(self._bus.read_all)
        for motor in self._ids:
            old = self._offsets[motor]
            # 0 stands for never zeroed
            new = self._settings.zero_tick - (signed(data[motor], table.PRESENT_POSITION) - old) or 1
            if abs(new) > table.MOST_OFFSET:
                self._reject = f"motor {motor}: its horn is more than a quarter of a turn from zero"
                return
            self._one(motor, table.TORQUE_ENABLE, 0)
            self._one(motor, table.HOMING_OFFSET, new)
            self._one(motor, table.GOAL_POSITION, self._settings.zero_tick)
            self._one(motor, table.TORQUE_ENABLE, 1)
            self._offsets[motor] = new

    # --- what they say ---

    def _read(self) -> DriveStatus:
        begun = time.monotonic()
        data = self._call(self._bus.read_all)
        watchdogs = [unsigned(data[motor], table.BUS_WATCHDOG) for motor in self._ids]
        counts = np.array([signed(data[motor], table.PRESENT_POSITION) for motor in self._ids])
        enabled = all(0 < watchdog < table.TRIPPED for watchdog in watchdogs)
        return DriveStatus(
            self._lengths(counts),
            enabled=enabled,
            zeroed=all(self._offsets.values()),
            stopping=getattr(self, "_stopping", False),
            watchdog=table.TRIPPED in watchdogs,
            fault=_faults(data, self._ids, torque=enabled),
            reject=getattr(self, "_reject", ""),
            round_trip=time.monotonic() - begun,
        )

    def _lengths(self, counts: NDArray[Any]) -> NDArray[np.int64]:
        """Return cable lengths (m,) [um]."""
        lengths = self._signs * (counts - self._settings.zero_tick) * self._count
        return np.asarray(np.round(lengths), np.int64)

    def _counts(self, lengths: NDArray[np.int64]) -> list[int]:
        counts = self._settings.zero_tick + self._signs * lengths / self._count
        return [round(float(count)) for count in counts]

    def _check_modes(self) -> None:
        mode = table.Mode.POSITION if self._settings.current_limit_ma is None else table.Mode.CURRENT_POSITION
        others = {motor: found for motor, found in self._each(table.OPERATING_MODE).items() if found != mode}
        if others:
            wrong = ", ".join(f"motor {motor} in {found}" for motor, found in others.items())
            hint = "Set it with the vendor's tool while the torque is off, and save it."
            raise InputError(f"{self._where}: operating mode {mode.value} is needed; {wrong}", hint=hint)

    def _read_limits(self) -> DeviceLimits:
        ends = [self._each(register) for register in (table.MIN_POSITION, table.MAX_POSITION)]
        lengths = np.array(
            [self._lengths(np.array([end[motor] for motor in self._ids])) for end in ends], float
        )
        slowest = min(self._each(table.VELOCITY_LIMIT).values())
        return DeviceLimits(lengths.min(axis=0), lengths.max(axis=0), slowest * self._velocity_unit)

    # --- the line ---

    def _each(self, register: table.Register) -> dict[int, int]:
        bits = 8 * register.size
        found = self._call(lambda: {motor: self._bus.read(motor, register) for motor in self._ids})
        return {
            motor: value - (1 << bits) if value >> (bits - 1) else value for motor, value in found.items()
        }

    def _all(self, register: table.Register, values: Mapping[int, int]) -> None:
        self._call(lambda: self._bus.write_all(register, values))

    def _one(self, motor: int, register: table.Register, value: int) -> None:
        self._call(lambda: self._bus.write(motor, register, value))

    def _call(self, action: Callable[[], Any]) -> Any:
        try:
            return action()
        except HardwareError as error:
            raise DeviceError(f"{self._where}: {error}", hint=error.hint) from error


def _faults(data: Mapping[int, bytes], ids: list[int], *, torque: bool) -> str:
    found = []
    for motor in ids:
        error = table.HardwareFault(unsigned(data[motor], table.HARDWARE_ERROR))
        names = ", ".join(bit.name.lower().replace("_", " ") for bit in error if bit.name)
        if error:
            found.append(f"motor {motor}: {names or int(error)}")
        elif torque and not unsigned(data[motor], table.TORQUE_ENABLE):
            found.append(f"motor {motor}: torque is off")
    return "; ".join(found)

"""One emulated Dynamixel motor: control table, motion at the profile velocity, bus watchdog, shutdown on errors.

goal -> profile at its velocity -> position loop (:class:`Servo`, ideal unless it is told otherwise) -> horn
"""

from __future__ import annotations

import math
from typing import Final

from tcr_hardware.dynamixel import table
from tcr_hardware.dynamixel.table import Register
from tcr_hardware.servo import Servo, ServoSettings

#: Errors in status packets.
RANGE, ACCESS = 0x04, 0x07
_GOALS: Final = frozenset(
    register.address for register in (table.GOAL_CURRENT, table.PROFILE_VELOCITY, table.GOAL_POSITION)
)
_READ_ONLY: Final = frozenset(
    (table.MODEL.address, table.HARDWARE_ERROR.address, table.PRESENT_POSITION.address)
)
XM430_W350: Final = 1020
#: A motor that follows its profile exactly.
IDEAL: Final = ServoSettings(lag_s=0.0, speed_um_s=math.inf, acceleration_um_s2=math.inf)


class DynamixelMotor:
    """A motor whose horn stands at ``turn`` counts, before the homing offset.

    Attributes:
        servo: Its position loop, counted from where the horn stood first [counts].
    """

    def __init__(
        self, turn: int, now: float, mode: int = table.Mode.POSITION, servo: ServoSettings = IDEAL
    ) -> None:
        """Switch it on.

        Args:
            turn: Where its horn stands [counts].
            now: Time [s].
            mode: Operating mode.
            servo: Its position loop, in counts where that says micrometres.
        """
        self._data = bytearray(table.END)
        self._start, self.servo, self._profile = turn, Servo(servo), 0.0
        self._now, self._fed = now, now
        self._set(table.MODEL, XM430_W350)
        self._set(table.OPERATING_MODE, mode)
        self._set(table.VELOCITY_LIMIT, 200)
        self._set(table.MAX_POSITION, table.TURN - 1)
        self._set(table.GOAL_POSITION, turn)

    @property
    def turn(self) -> float:
        """Where the horn stands [counts]."""
        return self._start + self.servo.position

    def get(self, register: Register) -> int:
        """Return a register, signed."""
        end = register.address + register.size
        return int.from_bytes(self._data[register.address : end], "little", signed=True)

    def _set(self, register: Register, value: int) -> None:
        bits = value & ((1 << 8 * register.size) - 1)
        end = register.address + register.size
        self._data[register.address : end] = bits.to_bytes(register.size, "little")

    def fail(self, fault: table.HardwareFault) -> None:
        """Shut down: the torque is gone, and the error stays until the motor is switched off and on."""
        self._set(table.HARDWARE_ERROR, self.get(table.HARDWARE_ERROR) | fault)
        self._set(table.TORQUE_ENABLE, 0)

    def restart(self) -> None:
        """Lose power for a moment: what survives are the registers below the volatile ones."""
        self._data[table.FIRST_VOLATILE :] = bytes(table.END - table.FIRST_VOLATILE)
        self._rest()

    def feed(self) -> None:
        """Notice a packet on the bus."""
        self._fed = self._now

    def advance(self, now: float) -> None:
        """Let time pass until ``now`` [s]."""
        watchdog = self._data[table.BUS_WATCHDOG.address]
        armed = 0 < watchdog < table.TRIPPED
        end = self._fed + watchdog * table.WATCHDOG_UNIT
        if armed and now > end:
            self._move(max(0.0, end - self._now))
            self._set(table.BUS_WATCHDOG, table.TRIPPED)
            self._rest()
        self._move(max(0.0, now - max(self._now, end if armed and now > end else self._now)))
        self._now = now
        self._set(table.PRESENT_POSITION, round(self.turn) + self.get(table.HOMING_OFFSET))

    def _move(self, seconds: float) -> None:
        if not self.get(table.TORQUE_ENABLE):
            return
        wanted = self.get(table.GOAL_POSITION) - self.get(table.HOMING_OFFSET) - self._start
        speed = self.get(table.PROFILE_VELOCITY) or self.get(table.VELOCITY_LIMIT)
        reach = speed * table.VELOCITY_UNIT * table.TURN * seconds
        self._profile += min(reach, max(-reach, wanted - self._profile))
        self.servo.advance(self._profile, seconds)

    def _rest(self) -> None:
        """Make the present position the goal."""
        self._set(table.GOAL_POSITION, round(self.turn) + self.get(table.HOMING_OFFSET))
        self._profile = self.servo.position

    def read(self, address: int, count: int) -> bytes:
        """Return bytes of the control table."""
        return bytes(self._data[address : address + count])

    def write(self, address: int, data: bytes) -> int:
        """Write bytes; returns the error of the status packet, 0 if they were taken."""
        if address in _READ_ONLY or (address < table.FIRST_VOLATILE and self.get(table.TORQUE_ENABLE)):
            return ACCESS
        written = range(address, address + len(data))
        if (
            any(goal in written for goal in _GOALS)
            and self._data[table.BUS_WATCHDOG.address] == table.TRIPPED
        ):
            return RANGE
        if table.GOAL_POSITION.address in written and self._beyond(
            data[table.GOAL_POSITION.address - address :]
        ):
            return RANGE
        if address == table.TORQUE_ENABLE.address and any(data) and self.get(table.HARDWARE_ERROR):
            return ACCESS
        self._data[address : address + len(data)] = data
        return 0

    def _beyond(self, goal: bytes) -> bool:
        """Whether a goal position is outside the limits of its mode."""
        value = int.from_bytes(goal[: table.GOAL_POSITION.size], "little", signed=True)
        bounded = self.get(table.OPERATING_MODE) == table.Mode.POSITION
        return bounded and not self.get(table.MIN_POSITION) <= value <= self.get(table.MAX_POSITION)

"""The part of the control table of Dynamixel X motors that is used here.

Source: ROBOTIS e-Manual, XM430-W350, chapter 2 "Control Table". Not tried on a real motor.
"""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import Final, NamedTuple

#: Counts of the encoder in a turn.
TURN: Final = 4096
#: Unit of velocities and of their limits [1/s of a turn].
VELOCITY_UNIT: Final = 0.229 / 60.0
#: Unit of the bus watchdog [s].
WATCHDOG_UNIT: Final = 0.02
#: What the bus watchdog reads when it has tripped.
TRIPPED: Final = 0xFF
#: Largest homing offset in position mode, either way: a quarter of a turn.
MOST_OFFSET: Final = 1024


class Register(NamedTuple):
    """Address and size in bytes."""

    address: int
    size: int


MODEL: Final = Register(0, 2)
OPERATING_MODE: Final = Register(11, 1)
HOMING_OFFSET: Final = Register(20, 4)
VELOCITY_LIMIT: Final = Register(44, 4)
MAX_POSITION: Final = Register(48, 4)
MIN_POSITION: Final = Register(52, 4)
TORQUE_ENABLE: Final = Register(64, 1)
HARDWARE_ERROR: Final = Register(70, 1)
BUS_WATCHDOG: Final = Register(98, 1)
GOAL_CURRENT: Final = Register(102, 2)
PROFILE_VELOCITY: Final = Register(112, 4)
GOAL_POSITION: Final = Register(116, 4)
#: Profile velocity and goal position, which follows it, as one number.
MOTION: Final = Register(PROFILE_VELOCITY.address, PROFILE_VELOCITY.size + GOAL_POSITION.size)
PRESENT_POSITION: Final = Register(132, 4)
#: From here on nothing is used.
END: Final = 147
#: Below are registers that survive a power cycle and are written while the torque is off only.
FIRST_VOLATILE: Final = 64


class Mode(IntEnum):
    """Operating modes that are used."""

    POSITION = 3
    CURRENT_POSITION = 5


class HardwareFault(IntFlag):
    """Bits of the hardware error status."""

    INPUT_VOLTAGE = 0x01
    OVERHEATING = 0x04
    ENCODER = 0x08
    ELECTRICAL_SHOCK = 0x10
    OVERLOAD = 0x20

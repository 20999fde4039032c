"""The fault matrix of Dynamixel motors: that of the bench, with an emulated bus in the place of the PLC."""

from __future__ import annotations

import numpy as np

from support.fault_matrix import Case, WatchedEmulators, harmless, plc_lost
from tcr_hardware.dynamixel import table
from tcrctl.emulate.winches import EmulatedWinches
from tcrctl.plant.rig.settings import Dynamixel

AXES = (1, 2, 3, 4)
#: A drum whose counts are fine against the limits of the matrix.
MM_PER_TURN, ZERO = 100.0, 2048
COUNT_UM = 1e3 * MM_PER_TURN / table.TURN
#: Goals nearer than this to where the motors are hold them there [counts].
STAYS = 3

CASES = [
    harmless("one lost answer", plc=("silence", {"count": 1})),
    harmless("one garbled answer", plc=("corrupt", {"count": 1})),
    harmless("answers 3 ms late", plc=("delay", {"seconds": 0.003})),
    plc_lost("silent bus", "silence", "does not answer"),
    plc_lost("a motor behind a broken wire", "silence", "does not answer", axis=3),
    plc_lost("garbled answers", "corrupt", "does not answer"),
    plc_lost("answers 0.3 s late", "delay", "does not answer", seconds=0.3),
    plc_lost("line unplugged", "reset", ""),
    Case("a motor shuts down", plc=("drive", {"axis": 2}), connect="disarmed", armed="faulted", moving="faulted",
         stopping="faulted", says="motor 2: overload", rule="now"),
    Case("a motor stands at its current limit", plc=("jam", {"axis": 2}), moving="disarmed", says="set-point",
         rule="following"),
    Case("power cycle of the motors", plc=("restart", {}), armed="faulted", moving="faulted", rule="silence"),
]  # fmt: skip

#: Faults that the test suite tries, the others being near relatives, in which phases.
SUITE = {
    "silent bus": ("connect", "moving", "stopping"),
    "garbled answers": ("moving",),
    "line unplugged": ("moving",),
    "a motor shuts down": ("connect", "armed", "moving", "stopping"),
    "a motor stands at its current limit": ("moving",),
    "power cycle of the motors": ("moving",),
}


class WatchedMotors(WatchedEmulators):
    """Emulated cameras and motors, and every set-point that reaches the motors while their watchdog is armed."""

    def watch_drives(self):
        self.timeout_ms = min(self.timeout_ms, 0.1 * self.watchdog_ms)
        self.plc = Motors(self._section("unknown"))
        motors = self.plc.bus.motors

        def noting(motor, write):
            def noted(address, data):
                error = write(address, data)
                if address == table.MOTION.address and motor == AXES[-1] and _followed(motors):
                    self.sent.append(COUNT_UM * (_each(motors, table.GOAL_POSITION) - ZERO))
                return error

            return noted

        for axis, motor in motors.items():
            motor.write = noting(axis, motor.write)

    def section(self):
        return self._section(self.plc.bus.device)

    def _section(self, device):
        return {
            "kind": "dynamixel",
            "device": device,
            "mm_per_turn": MM_PER_TURN,
            "zero_tick": ZERO,
            "timeout_ms": self.timeout_ms,
            "watchdog_ms": float(self.watchdog_ms),
        }


class Motors(EmulatedWinches):
    """Motors as the matrix wants drives."""

    def __init__(self, section):
        super().__init__(Dynamixel(**section), AXES)

    def start(self):
        self.bus.__enter__()

    def stop(self):
        self.bus.__exit__()


def _each(motors, register):
    return np.array([motors[axis].get(register) for axis in AXES])


def _followed(motors):
    """Whether the goals are set-points: not those of motors that nobody watches, nor to stay where they are."""
    armed = all(0 < dog < table.TRIPPED for dog in _each(motors, table.BUS_WATCHDOG))
    away = np.abs(_each(motors, table.GOAL_POSITION) - _each(motors, table.PRESENT_POSITION))
    return armed and away.max() > STAYS

"""Dynamixel motors on one serial line: registers of all of them in one packet each way."""

from __future__ import annotations

import termios
import time
from collections.abc import Mapping, Sequence
from typing import Any, Final

import dynamixel_sdk
import serial

from tcr_hardware.dynamixel.table import FIRST_VOLATILE, MODEL, MOTION, PRESENT_POSITION, Register
from tcr_hardware.errors import HardwareError

_sdk: Any = dynamixel_sdk  # it has no types

#: An exchange without a good answer is repeated so often.
RETRIES: Final = 1
#: Bits of a byte on the line.
BYTE_BITS: Final = 10
#: Bytes of a status packet beside its parameters.
OVERHEAD: Final = 11


class _Port(_sdk.PortHandler):
    """A line whose time-out is given, on a clock that never jumps, and that does not spin while it waits."""

    def __init__(self, device: str, timeout_s: float) -> None:
        super().__init__(device)
        self._timeout_ms = 1e3 * timeout_s

    def getCurrentTime(self) -> float:  # noqa: N802  # the library's name
        return 1e3 * time.monotonic()

    def setPacketTimeout(self, length: int) -> None:  # noqa: N802
        self.setPacketTimeoutMillis(self.tx_time_per_byte * length + self._timeout_ms)

    def clearPort(self) -> None:  # noqa: N802
        try:
            super().clearPort()
        except termios.error as error:  # no OSError, but one: the line has been pulled out
            raise serial.SerialException(str(error)) from error

    def readPort(self, length: int) -> bytes:  # noqa: N802
        if not self.ser.in_waiting:
            time.sleep(2e-4)
        return bytes(self.ser.read(length))


class DynamixelBus:
    """Motors by their numbers."""

    def __init__(self, device: str, baud: int, ids: Sequence[int], timeout_s: float) -> None:
        """Open the line and look whether all motors are there; nothing is written.

        Raises:
            HardwareError: The line cannot be opened, or a motor does not answer.
        """
        self.ids, self._baud = tuple(ids), baud
        self._port, self._packets = _Port(device, timeout_s), _sdk.PacketHandler(2.0)
        first, size = FIRST_VOLATILE, PRESENT_POSITION.address + PRESENT_POSITION.size - FIRST_VOLATILE
        self._block = Register(first, size)
        try:
            if not self._port.setBaudRate(baud):
                raise HardwareError(f"{device}: {baud} baud is no rate of Dynamixel motors")
            self.models = {motor: self.read(motor, MODEL) for motor in self.ids}
        except (OSError, serial.SerialException) as error:
            raise HardwareError(f"{device} cannot be opened: {error}") from error
        except BaseException:
            self.close()
            raise

    def seconds(self) -> float:
        """Return how long the bytes of one exchange take on the wire [s]."""
        answers = len(self.ids) * (OVERHEAD + self._block.size)
        questions = 2 * OVERHEAD + len(self.ids) * (2 + MOTION.size)
        return BYTE_BITS * (answers + questions) / self._baud

    def read(self, motor: int, register: Register) -> int:
        """Return an unsigned register of one motor.

        Raises:
            HardwareError: It does not answer.
        """
        calls = {
            1: self._packets.read1ByteTxRx,
            2: self._packets.read2ByteTxRx,
            4: self._packets.read4ByteTxRx,
        }
        value, *result = self._answered(
            f"motor {motor}", lambda: calls[register.size](self._port, motor, register.address)
        )
        del result
        return int(value)

    def write(self, motor: int, register: Register, value: int) -> None:
        """Write a register of one motor.

        Raises:
            HardwareError: It does not answer, or refuses the value.
        """
        calls = {
            1: self._packets.write1ByteTxRx,
            2: self._packets.write2ByteTxRx,
            4: self._packets.write4ByteTxRx,
        }
        bits = value & ((1 << 8 * register.size) - 1)
        error = self._answered(
            f"motor {motor}", lambda: (0, *calls[register.size](self._port, motor, register.address, bits))
        )[2]
        if error & 0x7F:  # the highest bit is the hardware error, told by a register
            raise HardwareError(f"motor {motor} refuses {value} at {register.address}: error {error & 0x7F}")

    def write_all(self, register: Register, values: Mapping[int, int]) -> None:
        """Write one register of many motors in one packet, which nobody answers.

        Raises:
            HardwareError: The line is gone.
        """
        group = _sdk.GroupSyncWrite(self._port, self._packets, register.address, register.size)
        all_bits = (1 << 8 * register.size) - 1
        for motor, value in values.items():
            group.addParam(motor, list((value & all_bits).to_bytes(register.size, "little")))
        self._answered("the bus", lambda: (0, group.txPacket(), 0))

    def read_all(self) -> dict[int, bytes]:
        """Return the registers in use of all motors, each as bytes from ``FIRST_VOLATILE`` on.

        Raises:
            HardwareError: A motor does not answer.
        """
        group = _sdk.GroupSyncRead(self._port, self._packets, *self._block)
        for motor in self.ids:
            group.addParam(motor)
        self._answered("a motor", lambda: (0, group.txRxPacket(), 0))
        return {motor: bytes(group.data_dict[motor]) for motor in self.ids}

    def close(self) -> None:
        """Close the line; nothing is sent."""
        if self._port.is_open:
            self._port.closePort()

    def _answered(self, who: str, call: Any) -> Any:
        """Do something on the line, again if it fails; value, result and error of the packet."""
        if not self._port.is_open:
            raise HardwareError("the line is closed")
        for _ in range(1 + RETRIES):
            try:
                found = call()
                if found[1] != _sdk.COMM_SUCCESS:
                    self._port.clearPort()
            except (OSError, serial.SerialException) as error:
                raise HardwareError(f"the line is gone: {error}") from error
            if found[1] == _sdk.COMM_SUCCESS:
                return found
            self._port.is_using = False
        raise HardwareError(f"{who} does not answer: {self._packets.getTxRxResult(found[1])}")


def signed(data: bytes, register: Register) -> int:
    """Return a register as a signed number, from the bytes that :meth:`DynamixelBus.read_all` returns."""
    start = register.address - FIRST_VOLATILE
    return int.from_bytes(data[start : start + register.size], "little", signed=True)


def unsigned(data: bytes, register: Register) -> int:
    """Return a register as a number that is not negative, likewise."""
    start = register.address - FIRST_VOLATILE
    return int.from_bytes(data[start : start + register.size], "little")

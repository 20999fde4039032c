"""A small Modbus server, TCP and RTU, that can be told to misbehave.

Written here and not taken from pymodbus: its client is on the other end, and a mistake that both ends share would
not be seen; and the faults need the bytes on the wire. Source: [MAP12].
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Sequence
from typing import Protocol

from tcr_hardware.emulators.plc_faults import PlcFaults
from tcr_hardware.emulators.plc_image import IllegalAddressError

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3
READ_HOLDING, WRITE_ONE, WRITE_MANY, READ_WRITE = 3, 6, 16, 23
MOST_READ, MOST_WRITTEN, MOST_WRITTEN_READING = 125, 123, 121


class Registers(Protocol):
    """What a server serves."""

    def read(self, address: int, count: int) -> list[int]:
        """Read registers (count,) from ``address`` on."""
        ...

    def write(self, address: int, words: Sequence[int]) -> None:
        """Write registers from ``address`` on."""
        ...


class RefusedError(Exception):
    """A request is answered with an exception code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"exception {code}")
        self.code = code


class ModbusServer:
    """Answers requests of one unit from a set of registers."""

    def __init__(self, unit: int, registers: Registers, faults: PlcFaults) -> None:
        """Serve ``registers`` as ``unit``."""
        self.unit = unit
        self._registers = registers
        self._faults = faults
        self._functions = {
            READ_HOLDING: self._read,
            WRITE_ONE: self._write_one,
            WRITE_MANY: self._write_many,
            READ_WRITE: self._read_write,
        }

    def answer(self, request: bytes) -> bytes | None:
        """Answer to a request, both without framing; None if there is to be none."""
        if self._faults.take("silence") is not None:
            return None
        answer = self._carried_out(request)
        if (late := self._faults.take("delay")) is not None:
            time.sleep(float(late["seconds"] or 0.0))
        return answer

    def _carried_out(self, request: bytes) -> bytes:
        """Carry a request out, if it is one."""
        function = request[0]
        try:
            self._refuse(function)
            return bytes([function]) + self._function(function)(request[1:])
        except IllegalAddressError:
            code = ILLEGAL_ADDRESS
        except (struct.error, ValueError):
            code = ILLEGAL_VALUE
        except RefusedError as refused:
            code = refused.code
        return bytes([function | 0x80, code])

    def spoil(self, frame: bytes) -> bytes:
        """Return a framed answer as it leaves the PLC."""
        if self._faults.take("corrupt") is not None:
            frame = frame[:-1] + bytes([frame[-1] ^ 0x10])
        if self._faults.take("truncate") is not None:
            frame = frame[: len(frame) // 2]
        return frame

    def _refuse(self, function: int) -> None:
        """Answer with an exception if a fault says so."""
        fault = self._faults.get("exception")
        if fault is not None and fault["function"] in (None, function):
            self._faults.take("exception")
            raise RefusedError(int(fault["code"] or ILLEGAL_FUNCTION))

    def _function(self, function: int) -> Callable[[bytes], bytes]:
        if function not in self._functions:
            raise RefusedError(ILLEGAL_FUNCTION)
        return self._functions[function]

    def _read(self, body: bytes) -> bytes:
        address, count = struct.unpack(">HH", body)
        return self._words(address, count)

    def _words(self, address: int, count: int) -> bytes:
        if not 1 <= count <= MOST_READ:
            raise ValueError
        return struct.pack(f">B{count}H", 2 * count, *self._registers.read(address, count))

    def _write_one(self, body: bytes) -> bytes:
        address, word = struct.unpack(">HH", body)
        self._registers.write(address, [word])
        return body

    def _write_many(self, body: bytes) -> bytes:
        address, count, size = struct.unpack_from(">HHB", body)
        if not 1 <= count <= MOST_WRITTEN or size != 2 * count:
            raise ValueError
        self._registers.write(address, struct.unpack(f">{count}H", body[5:]))
        wrong = self._faults.take("wrong_echo") is not None
        return struct.pack(">HH", address + wrong, count)

    def _read_write(self, body: bytes) -> bytes:
        address, count, to, number, size = struct.unpack_from(">HHHHB", body)
        if not 1 <= number <= MOST_WRITTEN_READING or size != 2 * number:
            raise ValueError
        self._words(address, count)  # if it may not be read, nothing is written
        self._registers.write(to, struct.unpack(f">{number}H", body[9:]))
        wrong = self._faults.take("wrong_echo") is not None
        return self._words(address, count - wrong)

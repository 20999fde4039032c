"""An emulated bus of Dynamixel motors behind a pseudo-terminal; it shares no code with what speaks to it.

Packets are those of protocol 2.0 (ROBOTIS e-Manual, "DYNAMIXEL Protocol 2.0"): header, number, length, instruction,
parameters with stuffed headers, CRC-16 with polynomial 0x8005.
"""

from __future__ import annotations

import os
import select
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Final

from tcr_hardware.dynamixel.table import BUS_WATCHDOG, HARDWARE_ERROR, HardwareFault, Mode
from tcr_hardware.emulators.dynamixel_motor import IDEAL, DynamixelMotor
from tcr_hardware.emulators.modbus_rtu import pseudo_terminal
from tcr_hardware.servo import ServoSettings

HEADER: Final = b"\xff\xff\xfd\x00"
PING, READ, WRITE, SYNC_READ, SYNC_WRITE, STATUS = 0x01, 0x02, 0x03, 0x82, 0x83, 0x55
EVERYBODY: Final = 0xFE
HARDWARE_ALERT: Final = 0x80
#: How often motors move while nobody asks [s].
TICK: Final = 0.005


class DynamixelEmulator:
    """Motors on a bus; a context manager.

    Attributes:
        motors: By number.
        device: Name of the serial device.
        silent: Nobody answers, and nothing that is sent arrives.
        corrupt: So many of the next answers have a flipped bit.
        lost: So many of the next answers are not sent.
        delay: Answers come so late [s].
        deaf: Motors behind a broken wire: they neither hear nor answer.
    """

    def __init__(
        self,
        turns: Mapping[int, int],
        *,
        mode: int = Mode.POSITION,
        servos: Mapping[int, ServoSettings] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Open a pseudo-terminal.

        Args:
            turns: Where the horn of every motor stands [counts].
            mode: Their operating mode.
            servos: Their position loops, in counts; ideal ones where there is none.
            clock: Never jumps [s].

        Raises:
            HardwareError: There are no pseudo-terminals on this system.
        """
        self._clock, self._lock, self._end = clock, threading.RLock(), threading.Event()
        loops = dict.fromkeys(turns, IDEAL) | dict(servos or {})
        self.motors = {
            number: DynamixelMotor(turn, clock(), mode, loops[number]) for number, turn in turns.items()
        }
        self._ours, self._theirs = pseudo_terminal()
        self.device, self.silent, self.corrupt = os.ttyname(self._theirs), False, 0
        self.lost, self.delay, self.deaf = 0, 0.0, set[int]()
        self._plugged = True
        self._waiting, self._outbox = b"", deque[tuple[float, bytes]]()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> DynamixelEmulator:
        """Begin to answer."""
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        """End it."""
        self._end.set()
        self._thread.join()
        if self._plugged:
            os.close(self._ours)
        os.close(self._theirs)

    def turns(self) -> dict[int, float]:
        """Return where the horns stand by motor [counts]."""
        with self._lock:
            self._advance()
            return {number: motor.turn for number, motor in self.motors.items()}

    def wound(self) -> dict[int, float]:
        """Return how far the drums have turned since the start by motor [counts]."""
        with self._lock:
            self._advance()
            return {number: motor.servo.output for number, motor in self.motors.items()}

    def watchdogs(self) -> list[int]:
        """Return what the bus watchdogs read."""
        with self._lock:
            self._advance()
            return [motor.read(BUS_WATCHDOG.address, 1)[0] for motor in self.motors.values()]

    def fail(self, number: int, fault: HardwareFault) -> None:
        """Let a motor shut down."""
        with self._lock:
            self.motors[number].fail(fault)

    def stall(self, number: int, *, stalled: bool = True) -> None:
        """Let a motor be held against its current limit, or let it go."""
        with self._lock:
            self.motors[number].servo.jammed = stalled

    def restart(self) -> None:
        """Let all motors lose power for a moment."""
        with self._lock:
            for motor in self.motors.values():
                motor.restart()

    def unplug(self) -> None:
        """Let the line be pulled out of the computer: the device is gone for good."""
        with self._lock:
            if self._plugged:
                os.close(self._ours)
            self._plugged = False

    def _serve(self) -> None:
        while not self._end.wait(0.0 if self._plugged else TICK):
            if self._plugged:
                select.select([self._ours], [], [], TICK)
            with self._lock:
                self._advance()
                data = self._read()
                self._waiting = b"" if self.silent else self._waiting + data
                for number, instruction, parameters in self._packets():
                    self._obey(number, instruction, parameters)
                self._send()

    def _read(self) -> bytes:
        if not self._plugged or not select.select([self._ours], [], [], 0.0)[0]:
            return b""
        return os.read(self._ours, 4096)

    def _advance(self) -> None:
        now = self._clock()
        for motor in self.motors.values():
            motor.advance(now)

    def _packets(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield number, instruction and parameters of every whole packet that has come."""
        while True:
            start = self._waiting.find(HEADER)
            if start < 0 or len(self._waiting) < start + 7:
                return
            size = 7 + int.from_bytes(self._waiting[start + 5 : start + 7], "little")
            packet = self._waiting[start : start + size]
            if len(packet) < size:
                return
            self._waiting = self._waiting[start + size :]
            if crc(packet[:-2]) == int.from_bytes(packet[-2:], "little"):
                body = packet[8:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
                yield packet[4], packet[7], body

    def _obey(self, number: int, instruction: int, given: bytes) -> None:
        for motor in self._hearing():
            self.motors[motor].feed()
        if instruction in (SYNC_READ, SYNC_WRITE):
            self._obey_all(instruction, given)
        else:
            for each in self._hearing():
                if number in (each, EVERYBODY):
                    self._obey_one(each, instruction, given)

    def _hearing(self) -> list[int]:
        return [number for number in self.motors if number not in self.deaf]

    def _obey_one(self, number: int, instruction: int, given: bytes) -> None:
        motor, address = self.motors[number], int.from_bytes(given[:2], "little")
        if instruction == PING:
            self._answer(number, 0, motor.read(0, 2) + b"\x2d")
        elif instruction == READ:
            self._answer(number, 0, motor.read(address, int.from_bytes(given[2:4], "little")))
        elif instruction == WRITE:
            self._answer(number, motor.write(address, given[2:]), b"")

    def _obey_all(self, instruction: int, given: bytes) -> None:
        address, count, rest = (
            int.from_bytes(given[:2], "little"),
            int.from_bytes(given[2:4], "little"),
            given[4:],
        )
        if instruction == SYNC_READ:
            for number in (n for n in rest if n in self._hearing()):
                self._answer(number, 0, self.motors[number].read(address, count))
            return
        for at in range(0, len(rest), 1 + count):
            if rest[at] in self._hearing():
                self.motors[rest[at]].write(address, rest[at + 1 : at + 1 + count])

    def _answer(self, number: int, error: int, data: bytes) -> None:
        alert = HARDWARE_ALERT if self.motors[number].get(HARDWARE_ERROR) else 0
        body = bytes((STATUS, error | alert)) + data.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
        packet = HEADER + bytes((number,)) + (len(body) + 2).to_bytes(2, "little") + body
        packet += crc(packet).to_bytes(2, "little")
        if self.corrupt:
            self.corrupt -= 1
            packet = packet[:-3] + bytes((packet[-3] ^ 0x10,)) + packet[-2:]
        if self.lost:
            self.lost -= 1
        else:
            self._outbox.append((self._clock() + self.delay, packet))

    def _send(self) -> None:
        """Send the answers that are due."""
        while self._plugged and self._outbox and self._outbox[0][0] <= self._clock():
            os.write(self._ours, self._outbox.popleft()[1])


def crc(data: bytes) -> int:
    """Return the CRC-16 of protocol 2.0: polynomial 0x8005, from 0, bits not reflected."""
    found = 0
    for byte in data:
        found ^= byte << 8
        for _ in range(8):
            found = (found << 1 ^ 0x8005) & 0xFFFF if found & 0x8000 else found << 1
    return found

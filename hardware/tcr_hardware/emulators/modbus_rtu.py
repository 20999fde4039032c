"""Modbus RTU framing of the emulated PLC, on a serial device or on a pseudo-terminal made for it."""

from __future__ import annotations

import os
import select
import struct
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from tcr_hardware.emulators.modbus_server import READ_WRITE, WRITE_MANY, ModbusServer
from tcr_hardware.errors import HardwareError

#: Silence after which an unfinished frame is thrown away [s]; longer than the 3.5 characters of the standard,
#: because a pseudo-terminal delivers bytes in bursts.
GAP_S = 0.01
#: Bits of a character with start and stop bit, and the silence between frames [s].
CHARACTER_BITS, SILENCE_S = 10, 1.75e-3
LONGEST_FRAME = 256
#: Where the byte count of a request stands, and the frame's length without the bytes it counts.
COUNTED = {WRITE_MANY: (6, 9), READ_WRITE: (10, 13)}
FIXED_LENGTH = 8
BROADCAST = 0


class RtuPort:
    """Answers on a serial line.

    Attributes:
        device: Path that the client opens.
    """

    def __init__(self, server: ModbusServer, device: str | None, baud: int) -> None:
        """Open the line.

        Args:
            server: Answers the requests.
            device: Serial device, or None for a new pseudo-terminal.
            baud: Answers come as late as on a line with so many bits per second; 0: at once.

        Raises:
            HardwareError: The device cannot be opened.
        """
        self._server, self._baud = server, baud
        self._stopped = threading.Event()
        self._descriptors = pseudo_terminal() if device is None else (_open(device),)
        self.device = os.ttyname(self._descriptors[-1]) if device is None else device
        self._thread = threading.Thread(target=self._serve, name="plc-rtu", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Close the line."""
        self._stopped.set()
        self._thread.join()
        for descriptor in self._descriptors:
            os.close(descriptor)

    def _serve(self) -> None:
        """Collect frames and answer them."""
        line, buffer = self._descriptors[0], b""
        while not self._stopped.is_set():
            if not select.select([line], [], [], GAP_S if buffer else 2 * GAP_S)[0]:
                buffer = b""
                continue
            try:
                buffer += os.read(line, LONGEST_FRAME)
            except OSError:
                self._stopped.wait(GAP_S)  # a pseudo-terminal whose other end was closed
                continue
            length = request_length(buffer)
            if length and len(buffer) >= length:
                self._answer(line, buffer[:length])
                buffer = b""
            elif len(buffer) > LONGEST_FRAME:
                buffer = b""

    def _answer(self, line: int, frame: bytes) -> None:
        """Answer a frame that is for this unit and intact."""
        if frame[0] not in (self._server.unit, BROADCAST) or crc(frame[:-2]) != frame[-2:]:
            return
        answer = self._server.answer(frame[1:-2])
        if answer is None or frame[0] == BROADCAST:
            return
        body = frame[:1] + answer
        reply = self._server.spoil(body + crc(body))
        if self._baud:
            time.sleep((len(frame) + len(reply)) * CHARACTER_BITS / self._baud + 2 * SILENCE_S)
        with suppress(OSError):
            os.write(line, reply)


def request_length(start: bytes) -> int:
    """Return the length of a request from its first bytes; 0 while it is not known."""
    if len(start) < 2:
        return 0
    if start[1] in COUNTED:
        at, fixed = COUNTED[start[1]]
        return fixed + start[at] if len(start) > at else 0
    return FIXED_LENGTH  # reads and single writes; other functions are refused by what their first bytes say


def crc(data: bytes) -> bytes:
    """Return the CRC-16 of Modbus, low byte first ([MSL06], section 6.2.2)."""
    remainder = 0xFFFF
    for byte in data:
        remainder ^= byte
        for _ in range(8):
            remainder = remainder >> 1 ^ (0xA001 if remainder & 1 else 0)
    return struct.pack("<H", remainder)


def _terminals() -> tuple[Callable[[int], Any], type[Exception]]:
    """Return what makes a terminal raw, and the error it raises; imported only here, as Windows has neither.

    Raises:
        HardwareError: This system has no terminals of this kind.
    """
    try:
        import termios
        import tty
    except ImportError:
        raise HardwareError(
            "a serial line can be emulated on Linux and macOS only; Modbus TCP everywhere"
        ) from None
    return tty.setraw, termios.error


def pseudo_terminal() -> tuple[int, int]:
    """Open a raw pseudo-terminal; return our end and the client's, kept open so that clients may come and go.

    Raises:
        HardwareError: There are none on this system.
    """
    make_raw, _ = _terminals()
    ours, theirs = os.openpty()
    make_raw(theirs)
    return ours, theirs


def _open(device: str) -> int:
    """Open a raw serial device.

    Raises:
        HardwareError: It cannot be opened.
    """
    make_raw, terminal_error = _terminals()
    try:
        descriptor = os.open(device, os.O_RDWR | os.O_NOCTTY)
        make_raw(descriptor)
    except (OSError, terminal_error) as error:
        raise HardwareError(f"cannot serve Modbus RTU on {device}: {error}") from error
    return descriptor

"""A PLC that answers with mutated bytes, without network: a pair of sockets stands for the wire."""

from __future__ import annotations

import random
import socket
import struct
from contextlib import suppress

from tcr_hardware.emulators.modbus_rtu import crc
from tcr_hardware.emulators.modbus_server import ModbusServer
from tcr_hardware.emulators.plc_faults import PlcFaults


def truncated(rng, frame):
    return frame[: rng.randrange(len(frame))]


def with_flipped_bits(rng, frame):
    spoiled = bytearray(frame)
    for _ in range(rng.randint(1, 4)):
        spoiled[rng.randrange(len(spoiled))] ^= 1 << rng.randrange(8)
    return bytes(spoiled)


def with_another_byte(rng, frame):
    at = rng.randrange(len(frame))
    return frame[:at] + bytes([rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))]) + frame[at + 1 :]


def with_inserted_bytes(rng, frame):
    at = rng.randrange(len(frame) + 1)
    return frame[:at] + rng.randbytes(rng.choice((1, 2, 7, 300))) + frame[at:]


def without_some_bytes(rng, frame):
    at = rng.randrange(len(frame))
    return frame[:at] + frame[at + rng.randint(1, 8) :]


def twice(rng, frame):
    del rng
    return frame + frame


def noise(rng, frame):
    return rng.randbytes(rng.choice((1, len(frame), 260, 5000)))


def after_noise(rng, frame):
    return rng.randbytes(rng.randint(1, 12)) + frame


def untouched(rng, frame):
    del rng
    return frame


MUTATIONS = (
    truncated,
    with_flipped_bits,
    with_another_byte,
    with_inserted_bytes,
    without_some_bytes,
    twice,
    noise,
    after_noise,
    untouched,
)


class MutatingWire:
    """Stands for the socket or the serial device of a client; its other end answers at once, and badly."""

    in_waiting = 0

    def __init__(self, registers, seed, *, serial):
        self._server = ModbusServer(1, registers, PlcFaults(lambda name, is_set: None))
        self._rng, self._serial = random.Random(seed), serial
        self._near, self._far = socket.socketpair()
        self.mutate = False
        self.last = b""

    def fileno(self):
        return self._near.fileno()

    def close(self):
        """The client hangs up; the wire stays for its next call."""

    def cut(self):
        self._near.close()
        self._far.close()

    def setblocking(self, blocking):
        self._near.setblocking(blocking)

    def recv(self, size):
        return self._near.recv(size)

    def send(self, request):
        if self._serial:
            self._near.setblocking(False)
            with suppress(BlockingIOError):  # as the serial client does: what has come before is dropped
                while self._near.recv(65536):
                    pass
        self._far.sendall(self._spoiled(self._answer(request)))
        return len(request)

    write = send

    def _answer(self, request):
        if self._serial:
            body = request[:1] + self._server.answer(request[1:-2])
            return body + crc(body)
        answer = self._server.answer(request[7:])
        return (
            struct.pack(">HHHB", int.from_bytes(request[:2], "big"), 0, len(answer) + 1, request[6]) + answer
        )

    def _spoiled(self, frame):
        if not self.mutate:
            return frame
        self.last = self._rng.choice(MUTATIONS)(self._rng, frame)
        if self._serial and len(self.last) >= 4 and self._rng.random() < 0.5:
            self.last = self.last[:-2] + crc(self.last[:-2])  # wrong, and with the right check sum
        return self.last

"""Modbus TCP framing of the emulated PLC."""

from __future__ import annotations

import socket
import struct
import threading
from contextlib import suppress

from tcr_hardware.emulators.modbus_server import ModbusServer
from tcr_hardware.emulators.plc_faults import PlcFaults
from tcr_hardware.errors import HardwareError

#: How often the acceptor looks whether it may listen [s].
LOOK_S = 0.02
#: How long a connection may need for an answer that it has begun, when it is reset [s].
LONGEST_ANSWER_S = 1.0
#: Unit numbers that a TCP server takes for itself ([MTI06], section 4.4.2.1).
ANY_UNIT = (0, 255)
LONGEST_BODY = 254


class TcpPort:
    """Accepts connections and answers on each, one thread per connection.

    Attributes:
        address: Host and port, as bound.
    """

    def __init__(self, server: ModbusServer, faults: PlcFaults, address: tuple[str, int]) -> None:
        """Bind and listen.

        Raises:
            HardwareError: The address cannot be used.
        """
        self._server, self._faults = server, faults
        self._stopped, self._lock = threading.Event(), threading.Lock()
        self._connections: dict[socket.socket, threading.Thread] = {}
        self._listener: socket.socket | None = _listen(address)
        self.address: tuple[str, int] = self._listener.getsockname()[:2]
        self._thread = threading.Thread(target=self._accept, name="plc-tcp", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening and drop all connections."""
        self._stopped.set()
        self._thread.join()
        self.reset()

    def reset(self) -> None:
        """Reset all connections, as a PLC does that is switched off; returns when they are gone."""
        with self._lock:
            connections, self._connections = self._connections, {}
        for connection, thread in connections.items():
            with suppress(OSError):
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                connection.shutdown(socket.SHUT_RD)  # wakes the thread, which closes
            thread.join(LONGEST_ANSWER_S)

    def _accept(self) -> None:
        """Take connections until stopped; while connections are refused, do not listen."""
        while not self._stopped.is_set():
            refused = self._faults.get("refuse") is not None
            if refused and self._listener is not None:
                self._listener.close()
                self._listener = None
                self.reset()
            elif not refused and self._listener is None:
                with suppress(HardwareError):
                    self._listener = _listen(self.address)
            if self._listener is None:
                self._stopped.wait(LOOK_S)
                continue
            with suppress(TimeoutError):
                connection, _ = self._listener.accept()
                thread = threading.Thread(target=self._serve, args=(connection,), daemon=True)
                with self._lock:
                    self._connections[connection] = thread
                thread.start()
        if self._listener is not None:
            self._listener.close()

    def _serve(self, connection: socket.socket) -> None:
        """Answer the requests of one connection until it ends or sends what is no Modbus."""
        with connection, connection.makefile("rb") as stream, suppress(OSError):
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            while len(header := stream.read(7)) == 7:
                transaction, protocol, length, unit = struct.unpack(">HHHB", header)
                if protocol or not 2 <= length <= LONGEST_BODY:
                    break
                body = stream.read(length - 1)
                if len(body) < length - 1 or connection not in self._connections:
                    break  # ended, or reset
                if unit not in (self._server.unit, *ANY_UNIT):
                    continue
                answer = self._server.answer(body)
                if answer is not None:
                    frame = struct.pack(">HHHB", transaction, 0, len(answer) + 1, unit) + answer
                    connection.sendall(self._server.spoil(frame))
        with self._lock:
            self._connections.pop(connection, None)


def _listen(address: tuple[str, int]) -> socket.socket:
    """Open a listening socket.

    Raises:
        HardwareError: The address cannot be used.
    """
    try:
        listener = socket.create_server(address)
    except OSError as error:
        raise HardwareError(
            f"cannot serve Modbus TCP at {address[0]}:{address[1]}: {error.strerror}",
            hint="Is another emulator running? Ports below 1024 need privileges.",
        ) from error
    listener.settimeout(LOOK_S)
    return listener

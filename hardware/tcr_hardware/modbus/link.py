"""One Modbus connection: blocks of registers in and out, with every failure named.

pymodbus does the framing. Its own retries and reconnects are off, because a cable command that is sent
again some seconds later is a hazard; no exception of pymodbus leaves this file.
"""

from __future__ import annotations

import logging
import os
import select
import socket
import struct
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException, ModbusException
from pymodbus.pdu import ModbusPDU

from tcr_hardware.modbus.errors import (
    GarbledAnswerError,
    LinkLostError,
    LinkTimeoutError,
    PlcExceptionError,
    StaleAnswerError,
    WrongEchoError,
)
from tcr_hardware.modbus.settings import RtuLink, TcpLink

READ, WRITE, READ_WRITE = 3, 16, 23
#: Pause after an answer that was not the one asked for [s].
SETTLE_S = 0.005
LONGEST_FRAME = 256
#: What the parser of pymodbus can raise on bytes that are no Modbus answer.
PARSER_ERRORS = (ModbusException, ValueError, IndexError, struct.error)

# Without a handler Python prints the library's warnings on stderr, in the middle of our own output.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())


Dial = Callable[[], Any]
"""Opens a connection; returns what the client of pymodbus takes for its socket."""


class ModbusLink:
    """A connection to one unit."""

    def __init__(
        self,
        link: TcpLink | RtuLink,
        unit: int,
        timeout_s: float,
        probe_address: int,
        dial: Dial | None = None,
    ) -> None:
        """Prepare a connection.

        Args:
            link: Where the PLC is.
            unit: Modbus unit number.
            timeout_s: How long one answer may take [s].
            probe_address: A register that can always be read, to settle a serial line.
            dial: Opens what stands for the socket or the serial device; None opens the real one.
        """
        self._link, self._unit = link, unit
        self._timeout_s = self._usual_timeout_s = timeout_s
        self._probe_address = probe_address
        self._client, self._dial = _client(link, timeout_s), dial
        self._unsure = False  # an answer may still be under way on a serial line
        self._late = self._most_late = 0  # answers in a row that only patience has heard

    @property
    def connected(self) -> bool:
        """Whether the connection is open."""
        return bool(self._client.connected)

    def open(self) -> None:
        """Connect.

        Raises:
            LinkLostError: The PLC or the serial device cannot be reached.
        """
        if self._dial is not None:
            self._client.socket = self._dial()
            self._unsure = isinstance(self._link, RtuLink)
            return
        if isinstance(self._link, RtuLink):
            if not self._client.connect():
                raise LinkLostError(f"cannot open {self._link}", hint=_why_no_device(self._link.device))
            self._unsure = True  # whatever a former owner of the line asked for
            return
        try:
            self._client.socket = socket.create_connection(
                (self._link.host, self._link.port), timeout=self._timeout_s
            )
        except OSError as error:
            raise LinkLostError(
                f"no connection to the PLC at {self._link}: {error}",
                hint="Is it on, and is the address right?",
            ) from error
        self._client.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def close(self) -> None:
        """Close the connection; never raises."""
        with suppress(OSError):
            self._client.close()  # type: ignore[no-untyped-call]

    @contextmanager
    def patience(self, timeout_s: float, most_late: int) -> Iterator[None]:
        """Wait longer for answers where nothing moves yet; never shorter than set.

        Args:
            timeout_s: How long one answer may take [s].
            most_late: So many in a row may come later than is set; the next one ends in `LinkTimeoutError`, because
                who is always late would never be heard in motion.
        """
        self._set_timeout(max(timeout_s, self._usual_timeout_s))
        self._late, self._most_late = 0, most_late
        try:
            yield
        finally:
            self._set_timeout(self._usual_timeout_s)

    def _set_timeout(self, timeout_s: float) -> None:
        self._timeout_s = self._client.comm_params.timeout_connect = timeout_s

    def distrust(self) -> None:
        """Settle a serial line before the next request."""
        self._unsure = True

    def read(self, address: int, count: int) -> list[int]:
        """Read registers (count,) from ``address`` on.

        Raises:
            LinkError: No valid answer.
            PlcExceptionError: The PLC refused.
        """
        self._settle()
        return self._read(address, count)

    def write(self, address: int, words: Sequence[int]) -> None:
        """Write registers (n,) from ``address`` on; errors as in `read`, and `WrongEchoError`."""
        self._settle()
        answer = self._ask(
            f"write {len(words)} registers at {address}",
            WRITE,
            lambda: self._client.write_registers(address, list(words), device_id=self._unit),
        )
        if (answer.address, answer.count) != (address, len(words)):
            self._unsure = True
            raise WrongEchoError((address, len(words)), (answer.address, answer.count))

    def read_write(self, address: int, count: int, write_address: int, words: Sequence[int]) -> list[int]:
        """Write registers, then read registers (count,), in one request; errors as in `read`."""
        self._settle()
        answer = self._ask(
            f"write {len(words)} registers at {write_address} and read {count} at {address}",
            READ_WRITE,
            lambda: self._client.readwrite_registers(
                read_address=address,
                read_count=count,
                write_address=write_address,
                values=list(words),
                device_id=self._unit,
            ),
        )
        return self._registers(answer, count)

    def _read(self, address: int, count: int) -> list[int]:
        answer = self._ask(
            f"read {count} registers at {address}",
            READ,
            lambda: self._client.read_holding_registers(address, count=count, device_id=self._unit),
        )
        return self._registers(answer, count)

    def _settle(self) -> None:
        """Make sure that no late answer is under way, after a failure on a serial line.

        Serial frames carry no transaction number, so that a late answer passes for the next one. Answers keep their
        order: once a probe is answered, all that was asked before it is answered or lost. No other request of ours
        reads a single register, so the answer of a probe is known by its length.
        """
        if not self._unsure or isinstance(self._link, TcpLink):
            return
        for last in (False, False, True):
            try:
                self._read(self._probe_address, 1)
            except (StaleAnswerError, GarbledAnswerError):
                if last:
                    raise
                time.sleep(SETTLE_S)  # the answer of the probe follows; it is dropped before the next request
            else:
                self._unsure = False
                return

    def _registers(self, answer: ModbusPDU, count: int) -> list[int]:
        """Return the registers of an answer if it has as many as were asked for."""
        if len(answer.registers) != count:
            self._unsure = True
            raise StaleAnswerError("number of registers", count, len(answer.registers))
        return list(answer.registers)

    def _ask(self, what: str, function: int, request: Callable[[], ModbusPDU]) -> ModbusPDU:
        """Send one request and return its answer, with every failure as an error of this package."""
        if not self.connected:
            raise LinkLostError(f"not connected to the PLC at {self._link}")
        began = time.monotonic()
        try:
            answer = request()
        except (ConnectionException, OSError) as error:
            self.close()
            raise LinkLostError(f"connection to the PLC at {self._link} lost: {error}") from error
        except PARSER_ERRORS as error:
            self._unsure = True
            waited = time.monotonic() - began
            if waited >= self._timeout_s:
                raise LinkTimeoutError(
                    f"no answer from the PLC at {self._link} within {1e3 * waited:.0f} ms", waited
                ) from error
            raise GarbledAnswerError(f"unreadable answer from the PLC at {self._link}: {error}") from error
        answered = answer.function_code & 0x7F
        if answered != function:
            self._unsure = True
            raise StaleAnswerError("function code", function, answered)
        if answer.isError():
            raise PlcExceptionError(int(getattr(answer, "exception_code", 0)), function, what)
        self._count_late(time.monotonic() - began)
        return answer

    def _count_late(self, waited: float) -> None:
        """Lose patience with a PLC whose answers all take longer than one may once drives move."""
        self._late = self._late + 1 if waited > self._usual_timeout_s else 0
        if self._late > self._most_late and self._timeout_s > self._usual_timeout_s:
            raise LinkTimeoutError(
                f"answers of the PLC come after {1e3 * waited:.0f} ms, "
                f"allowed are {1e3 * self._usual_timeout_s:.0f} ms",
                waited,
                hint="Its network, its scan time, another master? Or timeout_ms of the rig file is too short.",
            )


class PromptSerialClient(ModbusSerialClient):
    """Serial client that wakes up when bytes come, where the one of pymodbus looks every millisecond or more."""

    def recv(self, size: int | None) -> bytes:
        """Read the bytes that come within the time-out; none if none came."""
        line, timeout_s = self.socket, self.comm_params.timeout_connect
        if line is None:
            raise ConnectionException(str(self))
        if not select.select([line.fileno()], [], [], timeout_s)[0]:
            return b""
        if not (data := os.read(line.fileno(), size or LONGEST_FRAME)):
            raise ConnectionException(f"{self}: the device is gone")
        return data


def _client(link: TcpLink | RtuLink, timeout_s: float) -> ModbusTcpClient | ModbusSerialClient:
    """Make a client of pymodbus that neither retries nor waits longer than one answer may take."""
    if isinstance(link, TcpLink):
        return ModbusTcpClient(link.host, port=link.port, timeout=timeout_s, retries=0)
    return PromptSerialClient(
        link.device,
        baudrate=link.baud,
        parity=link.parity,
        stopbits=link.stop_bits,
        timeout=timeout_s,
        retries=0,
    )


def _why_no_device(device: str) -> str:
    """Say what keeps a serial device from being opened."""
    if not os.path.exists(device):
        return "There is no such device."
    if not os.access(device, os.R_OK | os.W_OK):
        return "No permission: add yourself to the group of the device (often dialout)."
    return "It is no serial device, or another program uses it."

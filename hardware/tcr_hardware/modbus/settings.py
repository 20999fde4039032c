"""How the PLC is reached, and what a serial line can carry."""

from __future__ import annotations

from dataclasses import dataclass, field

from tcr_hardware.modbus.registers import RegisterMap, register_map

EXCHANGES = ("auto", "fc23", "fc16_fc3")


@dataclass(frozen=True, slots=True)
class TcpLink:
    """Modbus TCP.

    Attributes:
        host: Name or address of the PLC.
        port: TCP port.
    """

    host: str
    port: int = 502

    def __str__(self) -> str:
        """Return the name for messages."""
        return f"{self.host}:{self.port}"


@dataclass(frozen=True, slots=True)
class RtuLink:
    """Modbus RTU over a serial line with 8 data bits.

    Attributes:
        device: Path of the serial device.
        baud: Bits per second.
        parity: ``N``, ``E`` or ``O``.
        stop_bits: 1 or 2.
    """

    device: str
    baud: int = 115200
    parity: str = "N"
    stop_bits: int = 1

    def __str__(self) -> str:
        """Return the name for messages."""
        return f"{self.device} at {self.baud} baud"


@dataclass(frozen=True, slots=True)
class BusSettings:
    """One PLC.

    Attributes:
        link: Where it is.
        unit: Modbus unit number.
        timeout_s: How long one answer may take [s].
        retries: How often a failed exchange is repeated, with the same SEQ.
        exchange: ``fc23`` writes and reads in one request, ``fc16_fc3`` in two; ``auto`` finds out.
        word_order: ``high_first`` or ``low_first``; checked against the PLC at open, ``auto`` takes the PLC's.
        byte_order: ``big`` or ``little``; likewise.
        map: Its registers.
    """

    link: TcpLink | RtuLink
    unit: int = 1
    timeout_s: float = 0.06
    retries: int = 1
    exchange: str = "auto"
    word_order: str = "high_first"
    byte_order: str = "big"
    map: RegisterMap = field(default_factory=register_map)

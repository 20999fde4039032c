"""What the program of the emulated PLC finds in its command registers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tcr_hardware.modbus.registers import Control


@dataclass(frozen=True, slots=True)
class PlcCommand:
    """What the program finds in its command registers at the start of a scan.

    Attributes:
        control: Control bits.
        heartbeat: HEARTBEAT.
        setpoints: SP (axes,) [um].
        vmax: VMAX [um/s].
        seq: SEQ.
    """

    control: Control
    heartbeat: int
    setpoints: tuple[float, ...]
    vmax: float
    seq: int


def command_of(values: Mapping[str, Sequence[float]]) -> PlcCommand:
    """Command from the values of the command registers by name."""
    return PlcCommand(
        Control(int(values["CTRL"][0]) & sum(Control)),
        int(values["HEARTBEAT"][0]),
        tuple(values["SP"]),
        values["VMAX"][0],
        int(values["SEQ"][0]),
    )

"""Where emulated drives are found: at a port, or at a serial device, a link to a pseudo-terminal."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TypeAlias

from tcr_hardware.emulators.plc import PlcEmulator
from tcrctl.emulate.winches import EmulatedWinches
from tcrctl.errors import DeviceError
from tcrctl.plant.rig.settings import Dynamixel, ModbusRtu, ModbusTcp

#: What moves the cables of an emulated bench.
EmulatedDrives: TypeAlias = PlcEmulator | EmulatedWinches


def open_line(plc: EmulatedDrives, where: ModbusTcp | ModbusRtu | Dynamixel, opened: ExitStack) -> None:
    """Start emulated drives where a rig file looks for them.

    Args:
        plc: Not started yet.
        where: Section of the rig file.
        opened: Takes how it is stopped.

    Raises:
        HardwareError: If it cannot be started.
        DeviceError: If the name of the serial device is taken.
    """
    if isinstance(plc, EmulatedWinches):
        opened.enter_context(plc.bus)
        opened.callback(_linked(Path(where.place), plc.bus.device).unlink, missing_ok=True)
    elif isinstance(where, ModbusTcp):
        plc.start(tcp=(where.host, where.port))
        opened.callback(plc.stop)
    elif isinstance(where, ModbusRtu):
        plc.start(tcp=None, rtu="pty", baud=where.baud)
        opened.callback(plc.stop)
        opened.callback(_linked(Path(where.device), plc.device).unlink, missing_ok=True)


def _linked(name: Path, device: str) -> Path:
    """Make a link, in the place of one that leads nowhere; what is there otherwise is left alone."""
    try:
        if name.is_symlink() and not name.exists():
            name.unlink()
        name.symlink_to(device)
    except OSError as error:
        raise DeviceError(
            f"a serial line cannot be emulated as {name}: {error.strerror}",
            hint="Give plc.device a name that is free, for instance /tmp/plc.",
        ) from error
    return name

"""Where an emulated PLC is found: at a port, or at a serial device, a link to a pseudo-terminal."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from tcr_hardware.emulators.plc import PlcEmulator
from tcrctl.errors import DeviceError
from tcrctl.plant.rig.settings import ModbusRtu, ModbusTcp


def open_line(plc: PlcEmulator, where: ModbusTcp | ModbusRtu, opened: ExitStack) -> None:
    """Start an emulated PLC where a rig file looks for it.

    Args:
        plc: Not started yet.
        where: Section of the rig file.
        opened: Takes how it is stopped.

    Raises:
        HardwareError: If it cannot be started.
        DeviceError: If the name of the serial device is taken.
    """
    if isinstance(where, ModbusTcp):
        plc.start(tcp=(where.host, where.port))
        opened.callback(plc.stop)
    else:
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

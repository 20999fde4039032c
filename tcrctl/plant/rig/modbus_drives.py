"""Cable drives behind a PLC as the rig plant wants them: axes of the register map on the cables of the robot."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcr_hardware.errors import HardwareError
from tcr_hardware.modbus.bus import PlcBus
from tcr_hardware.modbus.errors import (
    ImplausibleAnswerError,
    LinkLostError,
    LinkTimeoutError,
    MapError,
    PlcFrozenError,
    PlcMismatchError,
    PlcTakenError,
    RateError,
)
from tcr_hardware.modbus.registers import Control, FaultCode, Reject, Status, register_map
from tcr_hardware.modbus.settings import BusSettings, RtuLink, TcpLink
from tcrctl.config.settings import Settings
from tcrctl.errors import ArmingRefusedError, DeviceError, InputError, UntrustworthyDeviceError
from tcrctl.plant.rig.devices import DeviceLimits, DriveControl, DriveStatus, Identity
from tcrctl.plant.rig.finding import Finding
from tcrctl.plant.rig.loopback import emulate_hint
from tcrctl.plant.rig.mounting import CableAxis
from tcrctl.plant.rig.settings import ModbusRtu, ModbusTcp

_WRONG_FILE: Final = (MapError, PlcMismatchError, RateError)
_HOPELESS: Final = (ImplausibleAnswerError, PlcFrozenError)


#: A PLC that acknowledges a block this far from ours acknowledges one of somebody else.
FOREIGN: Final = 0x100
#: So many calls in a row with answers that were not for us: no late answer of a serial line.
STRANGE: Final = 3
#: What an exchange over a serial line has said is the status for so long [s]; a loop is faster, or has time to ask.
RECENT: Final = 0.1
#: Section and link of every ``plc.kind``.
LINKS: Final[Mapping[str, tuple[type[Settings], Callable[[Any], TcpLink | RtuLink]]]] = {
    "modbus_tcp": (ModbusTcp, lambda plc: TcpLink(plc.host, plc.port)),
    "modbus_rtu": (ModbusRtu, lambda plc: RtuLink(plc.device, plc.baud, plc.parity, plc.stop_bits)),
}


def bus_settings(plc: ModbusTcp | ModbusRtu) -> BusSettings:
    """Return the settings of a bus.

    Args:
        plc: Section of the rig file.

    Raises:
        InputError: If the register map of the rig file is impossible.
    """
    _, link_to = LINKS[plc.kind]
    try:
        registers = register_map(changes=plc.map)
    except MapError as error:
        raise InputError(f"plc.map: {error}", hint=error.hint) from error
    return BusSettings(
        link_to(plc),
        unit=plc.unit,
        timeout_s=plc.timeout_ms / 1e3,
        retries=plc.retries,
        exchange=plc.exchange,
        word_order=plc.word_order,
        byte_order=plc.byte_order,
        map=registers,
    )


class ModbusDrives:
    """The drives of one robot.

    Attributes:
        bus: The connection.
    """

    def __init__(self, plc: ModbusTcp | ModbusRtu, cables: tuple[CableAxis, ...]) -> None:
        """Connect and read what the PLC is; nothing is written.

        Args:
            plc: Section of the rig file.
            cables: Its cables in the order of the drives.

        Raises:
            DeviceError: If the PLC does not answer.
            InputError: If it is not what the rig file says.
        """
        self._where, self._cables = f"PLC at {plc.place}", cables
        self._axes = np.array([cable.axis - 1 for cable in cables])
        self._signs = np.array([cable.sign for cable in cables], dtype=np.int64)
        self._speed = math.ceil(max(cable.speed for cable in cables) / 100.0) * 100
        self._asks, self._told_ms = plc.prompt, plc.watchdog_ms
        self.bus = PlcBus(bus_settings(plc))
        try:
            self._call(self.bus.open)
            most = self.bus.info.limits
            if int(self._axes.max()) >= len(most.min_um):
                raise InputError(f"{self._where} has {len(most.min_um)} axes; the rig file names more")
            self._raw = list(self.bus.info.status.positions_um)
        except BaseException:
            self.bus.close()
            raise
        self._last: DriveStatus | None = None
        self._exchanged = -math.inf
        self._mine: bool | None = None  # not known before the first exchange
        self._strange = self._stale = 0

    @property
    def identity(self) -> Identity:
        """What the PLC said when the connection was opened."""
        info = self.bus.info
        told = {
            "map version": str(info.map_version),
            "words": info.word_order,
            "watchdog": f"{info.limits.watchdog_ms} ms",
        }
        return Identity("PLC", self._where, ", ".join(f"{key} {value}" for key, value in told.items()), told)

    @property
    def limits(self) -> DeviceLimits:
        """The PLC's limits, turned round for axes that count the other way."""
        limits = self.bus.info.limits
        ends = np.array([limits.min_um, limits.max_um], float)[:, self._axes] * self._signs
        return DeviceLimits(ends.min(axis=0), ends.max(axis=0), limits.vmax_um_s, limits.step_max_um)

    @property
    def watchdog(self) -> float | None:
        """That of the PLC's program [s]."""
        return 1e-3 * self.bus.info.limits.watchdog_ms

    def load(self, period: float) -> float:
        """Return the share of a control period [s] that the line is busy; 0 for TCP.

        Raises:
            InputError: If the period is too short for the line, or for the watchdog.
        """
        return float(self._call(lambda: self.bus.check_period(period)))

    def status(self) -> DriveStatus:
        """Read the status; over a serial line, where that costs wire time, what an exchange has said just now."""
        recent = time.monotonic() - self._exchanged < RECENT
        if self._last is not None and recent and not self._asks:
            return self._last
        return self._translated(self._asked(self.bus.read_status))

    def exchange(self, target: NDArray[np.int64], control: DriveControl) -> DriveStatus:
        """Send one block and get the status; axes without a cable stay where the PLC says they are.

        The first one that wants something claims the PLC. If another program has it, nothing is ever written.

        Raises:
            ArmingRefusedError: If another program writes to the PLC.
            DeviceError: If it does not answer.
        """
        if self._mine is None and control != DriveControl():
            self._claim()
        if not self._mine:
            return self.status()
        block = list(self._raw)
        for axis, value in zip(self._axes, self._signs * target, strict=True):
            block[axis] = int(value)
        bits = _bits(control)
        answer = self._asked(lambda: self.bus.exchange(block, bits, self._speed))
        self._last, self._exchanged = self._translated(answer), time.monotonic()
        return self._last

    def _asked(self, action: Callable[[], Any]) -> Any:
        """Do something while the drives may move, and notice who else speaks to the PLC.

        Raises:
            UntrustworthyDeviceError: If answers to somebody else have come ``STRANGE`` times in a row.
            DeviceError: If there is no good answer.
        """
        try:
            return self._call(action, moving=True)
        finally:
            stale = self.bus.statistics.stale_answers
            self._strange, self._stale = self._strange + 1 if stale > self._stale else 0, stale
            if self._mine and self._strange >= STRANGE:
                raise UntrustworthyDeviceError(f"{self._where}: another program writes to it")

    def _claim(self) -> None:
        try:
            self._call(lambda: self.bus.claim(self._raw, self._speed), moving=True)
        except ArmingRefusedError:
            self._mine = False
            raise
        self._mine = True

    def checks(self) -> tuple[Finding, ...]:
        """Say where the watchdog is another one than the rig file's; the rest was looked at on opening."""
        watchdog = self.bus.info.limits.watchdog_ms
        if watchdog == self._told_ms:
            return ()
        return (
            Finding("watchdog", f"{watchdog} ms; plc.watchdog_ms of the rig file is {self._told_ms:g} ms"),
        )

    def close(self) -> None:
        """End the connection."""
        self.bus.close()

    def _call(self, action: Callable[[], Any], *, moving: bool = False) -> Any:
        """Do something with the bus; a PLC that fitted the rig file and now does not has been exchanged."""
        try:
            return action()
        except _WRONG_FILE as error:
            if moving:
                raise UntrustworthyDeviceError(f"{self._where}: {error}", hint=error.hint) from error
            raise InputError(f"{self._where}: {error}", hint=error.hint) from error
        except _HOPELESS as error:
            raise UntrustworthyDeviceError(f"{self._where}: {error}", hint=error.hint) from error
        except PlcTakenError as error:
            raise ArmingRefusedError([f"{self._where}: {error}"], hint=error.hint) from error
        except HardwareError as error:
            silent = isinstance(error, LinkLostError) or (
                isinstance(error, LinkTimeoutError) and not error.hint
            )
            hint = (emulate_hint(self._where) if silent else "") or error.hint
            raise DeviceError(f"{self._where}: {error}", hint=hint) from error

    def _translated(self, answer: Any) -> DriveStatus:
        self._raw = list(answer.positions_um)
        bits, refused = answer.status, answer.reject is not Reject.NONE
        if self._mine and Status.ENABLED in bits and answer.ack_lag >= FOREIGN:
            raise UntrustworthyDeviceError(
                f"{self._where}: another program writes to it, SEQ {answer.seq_ack}, ours is {answer.seq}"
            )
        return DriveStatus(
            position=self._signs * np.array(answer.positions_um, dtype=np.int64)[self._axes],
            enabled=Status.ENABLED in bits,
            zeroed=Status.ZEROED in bits,
            stopping=Status.STOPPING in bits,
            estop=Status.ESTOP in bits,
            watchdog=Status.WATCHDOG in bits,
            fault=_fault(answer.fault) if Status.FAULT in bits else "",
            following_error=Status.FOLLOWING_ERROR in bits,
            remote=Status.REMOTE in bits,
            reject=self._reason(answer) if refused else "",
            acknowledged=answer.ack_lag <= 1,
            slack=Status.SLACK in bits,
            round_trip=answer.round_trip_s,
        )

    def _reason(self, answer: Any) -> str:
        text = answer.reject.name.lower().replace("_", " ")
        axes = {cable.axis: cable.name for cable in self._cables}
        return f"{text}, cable {axes.get(answer.reject_axis, f'of axis {answer.reject_axis}')}"


def _bits(control: DriveControl) -> Control:
    bits = Control(0)
    for wanted, bit in (
        (control.enable, Control.ENABLE),
        (control.follow, Control.FOLLOW),
        (control.permit, Control.RUN),
        (control.reset, Control.RESET),
        (control.zero, Control.ZERO),
    ):
        bits |= bit if wanted else Control(0)
    return bits


def _fault(code: int) -> str:
    try:
        return FaultCode(code).name.lower().replace("_", " ")
    except ValueError:
        return f"code {code}"

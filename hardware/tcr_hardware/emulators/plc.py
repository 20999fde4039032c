"""Emulated PLC with cable drives: Modbus TCP and RTU in front, program and servo dynamics behind.

    client --TCP--+                                              +-- faults
                  +-- ModbusServer -- PlcImage -- PlcProgram -- Servo x axes -- positions_um() -> simulated robot
    client --RTU--+

Time advances in whole scans whenever somebody looks: a request, a question for the positions, a button.
Between these nothing can change from outside, so that the result is that of a program which runs all the time.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from tcr_hardware.emulators.modbus_rtu import RtuPort
from tcr_hardware.emulators.modbus_server import ModbusServer
from tcr_hardware.emulators.modbus_tcp import TcpPort
from tcr_hardware.emulators.plc_command import command_of
from tcr_hardware.emulators.plc_faults import PlcFaults
from tcr_hardware.emulators.plc_image import PlcImage, Values, identity
from tcr_hardware.emulators.plc_limits import PlcLimitSettings
from tcr_hardware.emulators.plc_program import PlcProgram
from tcr_hardware.errors import HardwareError
from tcr_hardware.modbus.registers import RegisterMap, Status, register_map
from tcr_hardware.servo import ServoSettings

#: Most time that is made up for at once [s]: a machine that stood still is no fault of the client.
LONGEST_CATCH_UP_S = 0.05
#: How often time advances without a request [s].
TICK_S = 0.01
#: A cable below this tension is slack [N].
SLACK_N = 0.2


@dataclass(frozen=True, slots=True)
class PlcSettings:
    """One emulated PLC.

    Attributes:
        axes: Number of drives.
        unit: Modbus unit number.
        scan_s: Cycle time of its program [s].
        zeroed: Whether it knows the zero of its positions at the start.
        low_word_first: Order of the words of 32-bit registers.
        limits: What its program enforces.
        servo: Its drives, all alike or one by one.
        map: Its registers; for another number of axes the default is ``register_map(axes)``.
    """

    axes: int = 6
    unit: int = 1
    scan_s: float = 0.002
    zeroed: bool = True
    low_word_first: bool = False
    limits: PlcLimitSettings = field(default_factory=PlcLimitSettings)
    servo: ServoSettings | tuple[ServoSettings, ...] = field(default_factory=ServoSettings)
    map: RegisterMap | None = None


class PlcEmulator:
    """A PLC on loopback; thread-safe.

    Attributes:
        faults: What is wrong with it.
        address: Host and port of Modbus TCP once started; empty without.
        device: Serial device of Modbus RTU that the client opens; empty without.
    """

    def __init__(
        self, settings: PlcSettings | None = None, *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Build the PLC with all drives at rest at 0; nothing is opened yet.

        Raises:
            HardwareError: The register map is one for another number of axes.
        """
        self._settings = settings = settings or PlcSettings()
        rows = settings.map or register_map(settings.axes)
        if rows.axes != settings.axes:
            raise HardwareError(f"a PLC with {settings.axes} axes cannot serve a map of {rows.axes} axes")
        self._clock, self._lock = clock, threading.RLock()
        self._program = PlcProgram(settings.axes, settings.limits, settings.servo, zeroed=settings.zeroed)
        self._tensions: tuple[float, ...] = (0.0,) * settings.axes
        self._tensions_known = False
        self.faults = PlcFaults(self._fault_changed)
        self._image = PlcImage(rows, settings.low_word_first, self.faults, self._values)
        self._server = ModbusServer(settings.unit, self, self.faults)
        self._tcp: TcpPort | None = None
        self._rtu: RtuPort | None = None
        self.address: tuple[str, int] = ("", 0)
        self.device = ""
        self._now = clock()
        self._stopped = threading.Event()
        self._ticker: threading.Thread | None = None

    def __enter__(self) -> PlcEmulator:
        """Return the emulator, started or not."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Stop it."""
        self.stop()

    def start(
        self, *, tcp: tuple[str, int] | None = ("127.0.0.1", 0), rtu: str | None = None, baud: int = 0
    ) -> None:
        """Open the ports.

        Args:
            tcp: Host and port of Modbus TCP, port 0 for any free one; None for no TCP.
            rtu: ``pty`` for a new pseudo-terminal, or the path of a serial device; None for no RTU.
            baud: Serial answers come as late as on a line of this rate; 0: at once.

        Raises:
            HardwareError: A port cannot be opened, or the emulator runs already.
        """
        if self._ticker is not None:
            raise HardwareError("the PLC emulator runs already")
        self._now = self._clock()
        if tcp is not None:
            self._tcp = TcpPort(self._server, self.faults, tcp)
            self.address = self._tcp.address
        if rtu is not None:
            try:
                self._rtu = RtuPort(self._server, None if rtu == "pty" else rtu, baud)
            except HardwareError:
                self.stop()
                raise
            self.device = self._rtu.device
        self._stopped.clear()
        self._ticker = threading.Thread(target=self._tick, name="plc-scan", daemon=True)
        self._ticker.start()

    def stop(self) -> None:
        """Close the ports; does nothing if they are closed."""
        self._stopped.set()
        if self._ticker is not None:
            self._ticker.join()
        for port in (self._tcp, self._rtu):
            if port is not None:
                port.close()
        self._ticker = self._tcp = self._rtu = None

    def positions_um(self) -> tuple[float, ...]:
        """Return the cable taken in by every drive now (axes,) [um], independent of where the PLC has its zero."""
        with self._lock:
            self._advance()
            return tuple(servo.output for servo in self._program.servos)

    def set_tensions(self, newtons: Sequence[float]) -> None:
        """Tell the load cells what they feel (axes,) [N]."""
        with self._lock:
            self._tensions = tuple(float(value) for value in newtons)
            self._tensions_known = True

    def press_estop(self) -> None:
        """Press the e-stop button."""
        self.faults.set("estop")

    def release_estop(self) -> None:
        """Pull it out again."""
        self.faults.clear("estop")

    def restart(self, *, keep: bool = False) -> None:
        """Cycle the power: connections are reset, nothing is enabled, registers are 0 unless they are kept."""
        with self._lock:
            self._advance()
            if not keep:
                self._image.clear()
            self._program.power_up()
        if self._tcp is not None:
            self._tcp.reset()

    def snapshot(self) -> dict[str, object]:
        """Return the state for people and tests."""
        with self._lock:
            self._advance()
            program = self._program
            return {
                "status": program.status(),
                "fault": program.fault,
                "reject": program.reject,
                "positions_um": tuple(program.positions()),
                "active_um": tuple(program.active),
                "seq_ack": program.seq_ack,
                "heartbeat": program.heartbeat_echo,
                "cycle": program.cycle,
                "faults": self.faults.active,
            }

    def read(self, address: int, count: int) -> list[int]:
        """Read registers (count,) as a client would now."""
        with self._lock:
            self._advance()
            return self._image.read(address, count)

    def write(self, address: int, words: Sequence[int]) -> None:
        """Write command registers; the program sees them in its next scan."""
        with self._lock:
            self._advance()
            self._image.write(address, words)

    def _advance(self) -> None:
        """Run the scans that are due."""
        dt, now = self._settings.scan_s, self._clock()
        self._now = max(self._now, now - LONGEST_CATCH_UP_S)
        if now - self._now < dt:
            return
        hangs = self.faults.get("freeze_program") is not None
        measured = 0.0 if self.faults.get("dead_clock") is not None else None
        command = command_of(self._image.command())
        while now - self._now >= dt:
            self._now += dt
            if hangs:
                self._program.coast(dt)
            else:
                self._program.scan(command, dt, measured)

    def _tick(self) -> None:
        """Let time advance also when nobody asks."""
        while not self._stopped.wait(TICK_S):
            with self._lock:
                self._advance()

    def _values(self, block: str) -> Values:
        """Return the values of a read-only block by name."""
        program = self._program
        limits = self._settings.limits
        axes = self._settings.axes
        if block == "status":
            slack = self._tensions_known and min(self._tensions) < SLACK_N
            return {
                "STATUS": (program.status() | (Status.SLACK if slack else Status(0)),),
                "FAULT": (program.fault,),
                "HB_ECHO": (program.heartbeat_echo,),
                "SEQ_ACK": (program.seq_ack,),
                "REJECT": (program.reject[0] << 4 | program.reject[1],),
                "PLC_CYCLE": (program.cycle,),
                "ACT": program.positions(),
            }
        if block == "slow":
            return {**identity(), "SP_ACTIVE": program.active, "LOAD": self._tensions}
        return {
            "WD_MS": (limits.watchdog_ms,),
            "LIMITS_SPARE": (0,),
            "MIN": (limits.min_um,) * axes,
            "MAX": (limits.max_um,) * axes,
            "VMAX_LIMIT": (limits.vmax_um_s,),
            "STEPMAX": (limits.step_max_um,),
        }

    def _fault_changed(self, name: str, is_set: bool) -> None:
        """Carry out faults that are not looked up when a request is answered."""
        if name == "restart" and is_set:
            self.restart(keep=bool((self.faults.get(name) or {}).get("keep")))
        elif name == "reset" and is_set and self._tcp is not None:
            self._tcp.reset()
        if name == "refuse" and is_set and self._tcp is not None:
            self._tcp.reset()
        if name in ("reset", "restart") and is_set:
            self.faults.clear(name)
        with self._lock:
            self._advance()
            self._program.estop = self.faults.get("estop") is not None
            self._program.drive_lost = self.faults.get("drive") is not None
            deaf, jammed = self.faults.get("encoder"), self.faults.get("jam")
            self._program.deaf = frozenset() if deaf is None else frozenset({int(deaf["axis"] or 0)})
            for axis, servo in enumerate(self._program.servos, start=1):
                servo.jammed = jammed is not None and axis == int(jammed["axis"] or 0)

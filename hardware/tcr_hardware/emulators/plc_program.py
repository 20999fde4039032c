"""The program of the PLC, one scan at a time: the same rules as ``hardware/plc/tcr_plc.st``, in the same order.

                        ENABLE edge, READY                      FOLLOW
            disabled ------------------------> enabled, hold <----------> following
               ^   ^                                |                         |
               |   |  standstill                    +----------+--------------+
               |   +----------- stopping <---------------------+   RUN or ENABLE off
               |  RESET edge       |                           |
            fault latched <--------+ <-------------------------+   watchdog, e-stop, following error, drive

The drives hold in every state: letting go drops the robot. A stop wants a new ENABLE edge, a fault a RESET first.
What the registers hold at the first scan after power-up was written before: ENABLE has to be seen as 0 first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from tcr_hardware.emulators.plc_command import PlcCommand
from tcr_hardware.emulators.plc_limits import PlcLimitSettings
from tcr_hardware.modbus.registers import Control, FaultCode, Reject, Status
from tcr_hardware.servo import Servo, ServoSettings

#: Set-points are spread over the time between the last two sets, within these bounds [s].
SHORTEST_INTERVAL_S, LONGEST_INTERVAL_S = 0.002, 0.1
#: A drive within this distance of its set-point is in position [um].
IN_POSITION_UM = 50.0
#: Time between two scans beyond these is not counted, for motion and for silence [s].
LONGEST_SCAN_S, LONGEST_SILENCE_S = 0.1, 10.0
#: So many scans without time between them: the watchdog has no clock.
DEAD_CLOCK_SCANS = 1000
#: No encoder of a cable tells more [um].
LARGEST_UM = 1e9


class PlcProgram:
    """State of the PLC and its drives between two scans.

    Attributes:
        servos: The drives.
        estop: The e-stop button is pressed.
        drive_lost: The field bus to the drives is down.
        deaf: Axes, from 1, whose encoders tell no position.
        cycle: Scan counter.
        fault: Latched fault.
        enabled: Operation is enabled.
        stopping: The set-points are being brought to rest.
        zeroed: The zero of the positions is known.
        seq_ack: SEQ accepted last.
        heartbeat_echo: HEARTBEAT seen last.
        reject: Why the last set was refused, and the axis from 1.
        active: Set-points that the drives follow (axes,) [um].
    """

    def __init__(
        self,
        axes: int,
        limits: PlcLimitSettings,
        servo: ServoSettings | Sequence[ServoSettings],
        *,
        zeroed: bool,
    ) -> None:
        """Be at rest at 0, after scans in which all registers were 0."""
        self._limits = limits
        drives = [servo] * axes if isinstance(servo, ServoSettings) else servo
        self.servos = [Servo(drive) for drive in drives]
        self.estop = self.drive_lost = False
        self.deaf: frozenset[int] = frozenset()
        self._origin = [0.0] * axes
        self.power_up()
        self.zeroed, self._started = zeroed, True

    def power_up(self) -> None:
        """Start anew, where the drives stand; absolute encoders keep the zero."""
        self._started, self._blind, self._still_scans = False, False, 0
        self._position = [0.0] * len(self.servos)
        self.cycle = self.seq_ack = self.heartbeat_echo = 0
        self._seq_seen, self._silence_s, self._since_set_s = 0, 0.0, LONGEST_INTERVAL_S
        self._control = Control(0)
        self.fault, self.watchdog, self.following_error, self._tripped = FaultCode.NONE, False, False, False
        self.enabled = self.stopping = self._following = self.limited = False
        self.reject = (Reject.NONE, 0)
        self.active = self.positions()
        self._target, self._speed, self._time_left_s = list(self.active), [0.0] * len(self.servos), 0.0

    def readings(self) -> list[float]:
        """Return what the encoders tell (axes,) [um]."""
        return [
            math.nan if axis in self.deaf else servo.position
            for axis, servo in enumerate(self.servos, start=1)
        ]

    def positions(self) -> list[float]:
        """Return the positions reported (axes,), since tension zero [um]; the last one where there is none."""
        seen = zip(self.readings(), self._origin, self._position, strict=True)
        return [at - origin if abs(at) <= LARGEST_UM else last for at, origin, last in seen]

    def status(self) -> Status:
        """Return the status bits."""
        at_rest = all(
            abs(active - at) <= IN_POSITION_UM
            for active, at in zip(self.active, self.positions(), strict=True)
        )
        bits = (
            (Status.READY, self._ready()),
            (Status.ZEROED, self.zeroed),
            (Status.ENABLED, self.enabled),
            (Status.FAULT, self.fault is not FaultCode.NONE),
            (Status.ESTOP, self.estop),
            (Status.STOPPING, self.stopping),
            (Status.FOLLOWING_ERROR, self.following_error),
            (Status.LIMITED, self.limited),
            (Status.WATCHDOG, self.watchdog),
            (Status.REMOTE, True),
            (Status.IN_POSITION, at_rest and not self._moving()),
            (Status.DRIVE_COMM, self.drive_lost or self._blind),
        )
        return Status(sum(bit for bit, is_set in bits if is_set))

    def scan(self, command: PlcCommand, dt: float, measured: float | None = None) -> None:
        """Do one cycle of the program.

        Args:
            command: The command registers.
            dt: Time since the last one [s]; the drives move for as long.
            measured: That time as the program measures it [s]; anything, also no number; None: right.
        """
        measured = dt if measured is None else measured
        passed = min(measured, LONGEST_SILENCE_S) if measured > 0.0 else 0.0
        self._still_scans = 0 if measured > 0.0 else min(self._still_scans + 1, DEAD_CLOCK_SCANS)
        self._position = self.positions()
        self._blind = not all(abs(at) <= LARGEST_UM for at in self.readings())
        if not self._started:
            self._begin(command)
        self.cycle = (self.cycle + 1) & 0xFFFF
        rising = command.control & ~self._control
        self._control = command.control
        self._tripped = False
        self._watch(command, passed)
        self._find_faults()
        if self._tripped:
            self._stop()
        if Control.RESET in rising:
            self._reset()
        if Control.ZERO in rising:
            self._zero()
        self._permit(command, rising)
        scan_s = min(passed, LONGEST_SCAN_S)
        self._take(command, scan_s)
        self._move(command, scan_s)
        self.coast(dt)

    def _begin(self, command: PlcCommand) -> None:
        """Take bits written before power-up for no edges; stand where the drives stand, once they tell."""
        before = Control.ENABLE | Control.RESET | (Control.ZERO if self.zeroed else Control(0))
        self._control, self._started = command.control & before, not self._blind
        self.active, self._target = list(self._position), list(self._position)
        self._speed = [0.0] * len(self.servos)

    def coast(self, dt: float) -> None:
        """Let time pass for the drives alone: they follow their last set-points, also while the program hangs."""
        for servo, active, origin in zip(self.servos, self.active, self._origin, strict=True):
            servo.advance(active + origin if self._started else servo.position, dt)

    def _watch(self, command: PlcCommand, dt: float) -> None:
        """Watch that the host changes HEARTBEAT while operation is enabled."""
        alive = command.heartbeat != self.heartbeat_echo
        self.heartbeat_echo = command.heartbeat
        self._silence_s = 0.0 if alive else min(self._silence_s + dt, LONGEST_SILENCE_S)
        if self.enabled and 1e3 * self._silence_s >= self._limits.watchdog_ms:
            self.watchdog = True
            self._trip(FaultCode.WATCHDOG)
        if self.enabled and self._still_scans >= DEAD_CLOCK_SCANS:
            self._trip(FaultCode.CLOCK)

    def _find_faults(self) -> None:
        """Look for faults of the machine itself."""
        if self.estop:
            self._trip(FaultCode.ESTOP)
        if self.drive_lost or self._blind:
            self._trip(FaultCode.DRIVE)
        for axis, at in enumerate(self._position):
            if abs(self.active[axis] - at) > self._limits.following_um:
                self.following_error = True
                self.active[axis], self._speed[axis] = at, 0.0  # no jump when the axis comes free
                self._trip(FaultCode.FOLLOWING_ERROR)

    def _trip(self, fault: FaultCode) -> None:
        """Latch a fault, which stops; the first fault stays the one reported."""
        if self.fault is FaultCode.NONE:
            self.fault = fault
        self._tripped = True

    def _stop(self) -> None:
        """Bring the set-points to rest; they stay there."""
        self.enabled = self._following = False
        self.stopping = self.stopping or self._moving()

    def _reset(self) -> None:
        """Acknowledge a fault, once its cause is gone and everything stands."""
        if not (self.estop or self.drive_lost or self._blind or self._moving()):
            self.fault, self.watchdog, self.following_error = FaultCode.NONE, False, False

    def _zero(self) -> None:
        """Take the present positions as zero."""
        if self._following or self._moving() or self._blind:
            return
        self._origin = [servo.position for servo in self.servos]
        self.active = [0.0] * len(self.servos)
        self._position, self._target, self.zeroed = list(self.active), list(self.active), True

    def _ready(self) -> bool:
        """Tell whether an ENABLE edge would be obeyed, given RUN."""
        return self.fault is FaultCode.NONE and self.zeroed and not self.stopping

    def _permit(self, command: PlcCommand, rising: Control) -> None:
        """Enable on the edge, with the set-points that the drives hold already; stop without ENABLE or RUN."""
        wanted = Control.ENABLE in command.control and Control.RUN in command.control
        if self.enabled and not wanted:
            self._stop()
        elif Control.ENABLE in rising and wanted and self._ready():
            self.enabled = True
            self._silence_s = 0.0
        self._following = self.enabled and Control.FOLLOW in command.control

    def _take(self, command: PlcCommand, dt: float) -> None:
        """Take the set-points together when SEQ changes, or none of them."""
        self._since_set_s = min(self._since_set_s + dt, LONGEST_INTERVAL_S)
        if command.seq == self._seq_seen:
            return
        self._seq_seen = command.seq
        self.reject = self._verdict(command)
        if self.reject[0] is not Reject.NONE:
            return
        self.seq_ack = command.seq
        if self._following:
            self._target = list(command.setpoints)
            self._time_left_s = max(self._since_set_s, SHORTEST_INTERVAL_S)
        self._since_set_s = 0.0

    def _verdict(self, command: PlcCommand) -> tuple[Reject, int]:
        """Tell whether a set may be taken; without FOLLOW its set-points do not matter."""
        if Control.FOLLOW not in command.control:
            return Reject.NONE, 0
        if self.estop:
            return Reject.ESTOP, 0
        if not self.enabled:
            return Reject.NOT_ENABLED, 0
        limits = self._limits
        for axis, (wanted, last) in enumerate(zip(command.setpoints, self._target, strict=True), start=1):
            if not limits.min_um <= wanted <= limits.max_um:
                return Reject.RANGE, axis
            if abs(wanted - last) > limits.step_max_um:
                return Reject.STEP, axis
        if not 0 < command.vmax <= limits.vmax_um_s:
            return Reject.SPEED, 0
        return Reject.NONE, 0

    def _move(self, command: PlcCommand, dt: float) -> None:
        """Let the set-points of the drives advance by one scan."""
        if not self._following:
            self._brake(dt)
            return
        cap = min(command.vmax, self._limits.vmax_um_s) * dt
        share = min(dt / self._time_left_s, 1.0) if self._time_left_s > 0.0 else 1.0
        self._time_left_s = max(self._time_left_s - dt, 0.0)
        self.limited = False
        for axis, target in enumerate(self._target):
            wanted = (target - self.active[axis]) * share
            step = min(max(wanted, -cap), cap)
            self.limited = self.limited or step != wanted
            self.active[axis] += step
            if dt > 0.0:
                self._speed[axis] = step / dt  # in no time there is no new speed

    def _brake(self, dt: float) -> None:
        """Slow down to rest, within the strokes."""
        change, limits = self._limits.deceleration_um_s2 * dt, self._limits
        for axis, speed in enumerate(self._speed):
            if speed:
                slower = max(abs(speed) - change, 0.0) * (1.0 if speed > 0.0 else -1.0)
                ahead = self.active[axis] + slower * dt
                self.active[axis] = min(max(ahead, limits.min_um), limits.max_um)
                self._speed[axis] = slower if self.active[axis] == ahead else 0.0
        self._target = list(self.active)
        self.limited = False
        self.stopping = self.stopping and self._moving()

    def _moving(self) -> bool:
        """Tell whether a set-point of the drives moves."""
        return any(self._speed)

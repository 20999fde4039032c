"""The real robot: cameras measure it, drives move it, the supervisor decides whether they may.

    start:  connect -> measure -> ready? -> enable -> armed, set-points = present positions
    read:   drive status -> next camera frame -> supervisor
    write:  speed -> set-points within limits -> one exchange -> supervisor -> what was really sent
    close:  controlled stop -> standstill -> disarmed

Times are those of the run: a measurement carries the middle of its exposure. When the supervisor wants the run to
end, ``read`` or ``write`` raises its reason; ``close`` then brings the drives to rest whatever has happened.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from tcrctl.errors import ArmingRefusedError, DeviceError
from tcrctl.plant.rig.devices import Cameras, DriveControl, Drives, Sighting
from tcrctl.plant.rig.doubt_notes import DoubtNotes
from tcrctl.plant.rig.drive_line import DriveLine
from tcrctl.plant.rig.health import Health, Rules
from tcrctl.plant.rig.operation import Operation
from tcrctl.plant.rig.set_points import ClampNotes, DriveEnvelope, Micrometres, SetPoints
from tcrctl.plant.rig.supervisor import RESET_HINT, SafetyState, Supervisor
from tcrctl.signals import Array, Command, Measurement, Truth

#: How often the drives are written to while they are armed or stopped outside the control loop [s].
CYCLE: Final = 0.02
#: A drive that moves less than this in a cycle stands still [um].
STILL: Final = 20
#: Before arming is refused, usable frames are waited for so many times longer than in a run.
FIRST_LOOK: Final = 2.5
#: A tick waits for a frame at most this many frame intervals, then goes on with what it knows.
PATIENCE: Final = 1.5


@dataclass(frozen=True, slots=True)
class RigLimits:
    """What a rig must keep.

    Attributes:
        envelope: Limits of the set-points.
        rules: Limits of the supervisor.
        min_seen: Share of the mapped markers that makes a measurement usable.
        mapped: Number of ring nodes that carry a marker.
        nodes: Number of all ring nodes.
        arm_timeout: Time in which the drives must be on [s].
    """

    envelope: DriveEnvelope
    rules: Rules
    min_seen: float
    mapped: int
    nodes: int
    arm_timeout: float


class RigPlant:
    """See the module's docstring."""

    def __init__(
        self,
        cameras: Cameras,
        drives: Drives,
        limits: RigLimits,
        period: float,
        operation: Operation,
        *,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Take over open devices; they are closed with the plant.

        Args:
            cameras: Stream of marker frames.
            drives: The cable drives.
            limits: What must be kept.
            period: Control period [s].
            operation: The run.
            clock: Never jumps; that of the camera frames [s].
            sleep: Waits for a time [s].
        """
        self._cameras, self._line, self._limits = cameras, DriveLine(drives, clock), limits
        self._period, self._operation, self._clock, self._sleep = period, operation, clock, sleep
        self.supervisor = Supervisor(limits.rules, operation.report)
        self._points: SetPoints | None = None
        self._seen: Sighting | None = None
        self._refused, self._usable_at = 0, -np.inf
        self._clamps, self._doubts = ClampNotes(operation.report), DoubtNotes(operation.report, clock)

    # --- the loop ---

    def read(self) -> Measurement:
        """Return the next camera frame, and where the drives are.

        If no frame comes in time, it is the last one again, with the time at which it was taken.

        Raises:
            RigStopError: If the supervisor ends the run.
            DeviceError: If a device is lost.
        """
        if self._line.ask():
            self._count_refusals()
        measured = self._measurement(self._frame())
        self._supervise()
        return measured

    def write(self, command: Command) -> Command:
        """Send set-points for one period; returns what was really sent.

        While the supervisor holds, the last accepted set-points are sent again.

        Raises:
            RigStopError: If the supervisor ends the run.
            DeviceError: If a device is lost.
        """
        points = self._points
        if points is None:
            raise ArmingRefusedError(["the rig was never started"])
        self.supervisor.run()
        before = points.accepted
        if self.supervisor.state is SafetyState.RUNNING:
            target, clamps = points.propose(command.speed)
        else:
            points.start_again()
            target, clamps = points.propose(np.zeros_like(command.speed))
        self._clamps.note(clamps)
        if self._line.exchange(target, self.supervisor.control):
            points.accept()
        else:
            points.start_again()
        self._supervise()
        change = 1e-6 * (points.accepted - before) / self._period
        return Command(np.asarray(change, float), np.asarray(1e-6 * points.accepted, float))

    def truth(self) -> Truth | None:
        """Return None: a rig does not know more than it measures."""
        return None

    # --- before and after it ---

    def start(self) -> None:
        """Arm the drives without a bump: set-points begin where the drives are.

        Raises:
            ArmingRefusedError: If a condition is not met; nothing has moved.
            DeviceError: If the drives are lost.
        """
        health = self.look()
        self.supervisor.check_ready(health, confirmed=self._operation.confirmed, taken=health.enabled)
        self.arm(f"operator agreed; measurement {1e3 * self._health().age:.0f} ms old")
        self._measurement(self._frame())  # arming takes longer than a measurement stays fresh

    def arm(self, cause: str) -> None:
        """Switch the drives on and wait until they are; see :meth:`start`, which also looks at the cameras."""
        on, begun = DriveControl(enable=True, permit=True), self._clock()
        try:
            while True:
                position = self.position()
                if outside := self._limits.envelope.outside(position):
                    hint = "Bring it inside with the PLC's own manual mode."
                    raise ArmingRefusedError(outside, hint=hint)
                self._line.exchange(position, on)
                health = self._health()
                if health.silence > self._limits.rules.silence:
                    raise DeviceError(f"the drives do not answer: {health.trouble}")
                status = health.status
                if status is not None and status.enabled and status.acknowledged and not health.trouble:
                    break
                if self._clock() - begun > self._limits.arm_timeout:
                    why = (status.fault if status else "") or "they do not say why"
                    raise ArmingRefusedError(
                        [f"the drives are not on after {self._limits.arm_timeout:g} s: {why}"],
                        hint=RESET_HINT if status and (status.fault or status.watchdog) else "",
                    )
                self._sleep(CYCLE)
        except BaseException:
            self._line.exchange(self.position(), DriveControl())
            raise
        self._points = SetPoints(self._limits.envelope, self._period, self.position().tolist())
        self.supervisor.arm(cause)

    def close(self) -> None:
        """Bring the drives to rest, switch them off and end the connections.

        Raises:
            DeviceError: If the drives did not come to rest, and nothing else had gone wrong before.
        """
        before = self.supervisor.failure
        try:
            self._come_to_rest()
            if self._points is not None:
                self._line.exchange(self.position(), DriveControl())
        finally:
            self._cameras.close()
            self._line.close()
        if before is None and self.supervisor.failure is not None:
            raise self.supervisor.failure

    def position(self) -> Micrometres:
        """Return where the drives were when they answered last (m,) [um].

        Raises:
            DeviceError: If they never did.
        """
        return self._line.position()

    def look(self) -> Health:
        """Ask cameras and drives and return what is known, without any consequence.

        A frame that has waited here for too long is no sign of bad cameras, so others get their chance.
        """
        self._line.ask()
        end = self._clock() + FIRST_LOOK * self._limits.rules.stale_stop
        while True:
            self._measurement(self._frame())
            if self._health().age < self._limits.rules.stale or self._clock() >= end:
                return self._health()

    def _come_to_rest(self) -> None:
        """Let the PLC ramp down, and see the drives stand still from one cycle to the next.

        A PLC that takes no more commands may still tell that it has stopped.
        """
        self.supervisor.stop(self._clock(), "end of the run")
        before: Micrometres | None = None
        while self.supervisor.state is SafetyState.STOPPING:
            self._line.exchange(self.position(), self.supervisor.control)
            answered, now = self._line.ask(), self.position()
            moved, before = before is None or bool(np.any(np.abs(now - before) > STILL)), now
            health = replace(self._health(), silence=0.0) if answered else self._health()
            if self.supervisor.rest(self._clock(), health, moved=moved) is SafetyState.STOPPING:
                self._sleep(CYCLE)

    # --- devices ---

    def _count_refusals(self) -> None:
        """Take back set-points that the PLC has not taken since the last write."""
        points, status = self._points, self._line.status
        if points is None or status is None or not self.supervisor.control.follow:
            return
        refused = bool(status.reject) or not status.acknowledged
        if refused:
            points.take_back()
        self._refused = self._refused + 1 if refused else 0

    def _frame(self) -> Sighting | None:
        """Return the next frame if the cameras are much faster than the loop, else the newest."""
        interval = 1.0 / self._cameras.rate
        return self._cameras.next(PATIENCE * interval, fresh=interval <= 0.5 * self._period)

    def _measurement(self, sighting: Sighting | None) -> Measurement:
        now, run_time = self._clock(), self._operation.time()
        status = self._line.status
        drive = np.zeros(0) if status is None else np.asarray(1e-6 * status.position, float)
        if sighting is None:
            return self._last_seen(run_time - now, drive)
        self._seen = sighting
        self._doubts.note(sighting.doubts)
        if np.count_nonzero(sighting.valid) >= self._limits.min_seen * self._limits.mapped:
            self._usable_at = sighting.taken
        taken = run_time - (now - sighting.taken)
        return Measurement(taken, sighting.nodes, sighting.valid, drive, sighting.raw)

    def _last_seen(self, epoch: float, drive: Array) -> Measurement:
        """Return what is known if no frame came; ``epoch`` is the time of the run at time 0 of the clock."""
        seen = self._seen
        if seen is None:
            nobody = np.zeros(self._limits.nodes, np.bool_)
            return Measurement(epoch + self._clock(), np.zeros((nobody.size, 3), np.float32), nobody, drive)
        return Measurement(epoch + seen.taken, seen.nodes, seen.valid, drive)

    # --- supervision ---

    def _health(self) -> Health:
        now, following, laggard = self._clock(), 0, ""
        if self._points is not None and self._line.status is not None:
            error = np.abs(self._line.status.position - self._points.accepted)
            worst = int(np.argmax(error))
            following, laggard = int(error[worst]), self._limits.envelope.names[worst]
        return Health(
            age=now - self._usable_at,
            status=self._line.status,
            silence=self._line.silence(),
            trouble=self._line.trouble,
            following=following,
            laggard=laggard,
            hopeless=self._line.hopeless,
            refused=self._refused,
            doubts="" if self._seen is None else self._seen.doubts,
        )

    def _supervise(self) -> None:
        self.supervisor.watch(self._clock(), self._health())
        if self.supervisor.failure is not None:
            raise self.supervisor.failure

"""Safety supervisor of a rig: the one state machine that decides whether the drives may move.

        operator's zeroing            operator agrees; zeroed, fresh measurement, echo
    ZEROING <------------> DISARMED ------------------------------------------------> ARMED
       |                    ^  ^                                                       |
       |  operator's reset  |  | standstill                              first command |
       |                    |  |                                                       v
       |                    |  STOPPING <--stop asked, cameras or drives lost,---- RUNNING
       |                    |     |        drive lags, set-points refused            ^   |
       |                    |     | no standstill in time                   all well |   | doubt: stale, one
       |                    |     v                                                  |   v lost answer
       +------fault------> FAULTED <--e-stop, watchdog, PLC fault--- any of those -- HOLDING

What the states tell the drives:

    state     enable  follow  permit    set-points
    DISARMED                            none
    ZEROING                     x       present positions, tension-zero edge
    ARMED       x               x       present positions
    RUNNING     x       x       x       the controller's, inside all limits
    HOLDING     x       x       x       the last ones again, so that the watchdog is fed
    STOPPING    x                       none: the PLC ramps down and then holds
    FAULTED                             none; latched until an operator resets it

Rules: no motion is resumed after STOPPING or FAULTED without arming again; every transition is reported with its
cause. This is not a safety function: the emergency stop is hard-wired, and if this program dies the watchdog
in the PLC stops the drives. See docs/bench.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import StrEnum
from typing import Final

from tcrctl.errors import ArmingRefusedError, DeviceError, RigStopError, TcrctlError
from tcrctl.plant.rig.devices import DriveControl, DriveStatus
from tcrctl.plant.rig.health import Health, Rules

Report = Callable[[str, str, str], None]
"""Takes kind, level and text of an event."""

RESET_HINT: Final = "When the cause is removed: tcrctl rig reset"


class SafetyState(StrEnum):
    """States of the supervisor, see the module's docstring."""

    DISARMED = "disarmed"
    ZEROING = "zeroing"
    ARMED = "armed"
    RUNNING = "running"
    HOLDING = "holding"
    STOPPING = "stopping"
    FAULTED = "faulted"


_NEXT: Final = {
    SafetyState.DISARMED: {SafetyState.ZEROING, SafetyState.ARMED, SafetyState.FAULTED},
    SafetyState.ZEROING: {SafetyState.DISARMED, SafetyState.FAULTED},
    SafetyState.ARMED: {SafetyState.RUNNING, SafetyState.STOPPING, SafetyState.FAULTED},
    SafetyState.RUNNING: {SafetyState.HOLDING, SafetyState.STOPPING, SafetyState.FAULTED},
    SafetyState.HOLDING: {SafetyState.RUNNING, SafetyState.STOPPING, SafetyState.FAULTED},
    SafetyState.STOPPING: {SafetyState.DISARMED, SafetyState.FAULTED},
    SafetyState.FAULTED: {SafetyState.DISARMED},
}
_CONTROL: Final = {
    SafetyState.DISARMED: DriveControl(),
    SafetyState.ZEROING: DriveControl(permit=True),
    SafetyState.ARMED: DriveControl(enable=True, permit=True),
    SafetyState.RUNNING: DriveControl(enable=True, follow=True, permit=True),
    SafetyState.HOLDING: DriveControl(enable=True, follow=True, permit=True),
    SafetyState.STOPPING: DriveControl(enable=True),
    SafetyState.FAULTED: DriveControl(),
}
_MOVING: Final = (SafetyState.ARMED, SafetyState.RUNNING, SafetyState.HOLDING)


class Supervisor:
    """See the module's docstring.

    Attributes:
        state: The state now.
        failure: Why the run has to end; None while it need not.
    """

    def __init__(self, rules: Rules, report: Report) -> None:
        """Begin disarmed; ``report`` takes every transition with its cause."""
        self.state, self.failure = SafetyState.DISARMED, None
        self._rules, self._report = rules, report
        self._stopping_since = 0.0

    failure: TcrctlError | None

    @property
    def control(self) -> DriveControl:
        """What the drives are told in this state."""
        return _CONTROL[self.state]

    @property
    def armed(self) -> bool:
        """Whether the drives are on because of this program."""
        return self.state in (*_MOVING, SafetyState.ZEROING, SafetyState.STOPPING)

    def check_ready(self, health: Health, *, confirmed: bool, taken: bool = False) -> None:
        """Find out whether the drives may be armed.

        Args:
            health: What is known now.
            confirmed: The operator has agreed.
            taken: Another program has enabled them.

        Raises:
            ArmingRefusedError: With every condition that is not met.
        """
        reasons = list(_refusals(health, self._rules))
        reasons += ["the drives are enabled by somebody else"] if taken else []
        if not confirmed:
            reasons.append("the operator has not agreed (--yes)")
        if self.state is not SafetyState.DISARMED:
            reasons.append(f"the supervisor is {self.state}")
        if reasons:
            latched = health.status is not None and (health.status.fault or health.status.watchdog)
            raise ArmingRefusedError(reasons, hint=RESET_HINT if latched else "")

    def arm(self, cause: str) -> None:
        """Note that the drives are on and echo what they are sent."""
        self._go(SafetyState.ARMED, "info", cause)

    def begin_zeroing(self) -> None:
        """Let the drives be zeroed."""
        self._go(SafetyState.ZEROING, "info", "tension-zero asked for")

    def end_zeroing(self, cause: str) -> None:
        """Note that zeroing is over."""
        self._go(SafetyState.DISARMED, "info", cause)

    def run(self) -> None:
        """Note that the first command of the controller is about to be sent."""
        if self.state is SafetyState.ARMED:
            self._go(SafetyState.RUNNING, "info", "first command")

    def watch(self, now: float, health: Health) -> SafetyState:
        """Look at a cycle and return the state from now on; ``failure`` says why the run must end if it must.

        Args:
            now: Time of a clock that never jumps [s].
            health: What is known.
        """
        if self.state not in _MOVING:
            return self.state
        doubt = _doubt(health, self._rules)
        if fault := _fault(health.status):
            self._end(now, SafetyState.FAULTED, RigStopError(fault, hint=RESET_HINT))
        elif failure := self._reason_to_stop(health):
            self._end(now, SafetyState.STOPPING, failure)
        elif doubt and self.state is SafetyState.RUNNING:
            self._go(SafetyState.HOLDING, "warning", doubt)
        elif not doubt and self.state is SafetyState.HOLDING:
            self._go(SafetyState.RUNNING, "info", "cameras and drives are well again")
        return self.state

    def stop(self, now: float, cause: str) -> None:
        """Bring the drives to a controlled stop; nothing happens if they are not armed or stop already."""
        if self.state in _MOVING:
            self._stopping_since = now
            self._go(SafetyState.STOPPING, "info", cause)

    def rest(self, now: float, health: Health, *, moved: bool) -> SafetyState:
        """Follow a controlled stop to its end.

        Args:
            now: Time [s].
            health: What is known; the cameras do not matter any more.
            moved: Whether a drive has moved since the cycle before.
        """
        if self.state is not SafetyState.STOPPING:
            return self.state
        status = None if health.silence > 0.0 else health.status
        waited = now - self._stopping_since
        if fault := _fault(status, enabled=False):
            self._end(now, SafetyState.FAULTED, RigStopError(fault, hint=RESET_HINT))
        elif status is not None and not (status.stopping or status.enabled or moved):
            self._go(SafetyState.DISARMED, "info", f"standstill after {waited:.2f} s")
        elif waited > self._rules.standstill:
            why = health.trouble if status is None else "the drives are still moving"
            text = f"no standstill within {waited:.2f} s ({why}); the watchdog of the drives has to stop them"
            self._end(now, SafetyState.FAULTED, DeviceError(text, hint=RESET_HINT))
        return self.state

    def reset(self) -> None:
        """Note that an operator has removed the cause of a fault."""
        if self.state is SafetyState.FAULTED:
            self.failure = None
            self._go(SafetyState.DISARMED, "info", "reset by the operator")

    def _reason_to_stop(self, health: Health) -> TcrctlError | None:
        rules, status = self._rules, health.status
        if health.hopeless or health.silence >= rules.silence:
            return DeviceError(
                f"safety stop of the rig: the drives have not answered for {1e3 * health.silence:.0f} ms: "
                f"{health.trouble}"
            )
        if health.age >= rules.stale_stop:
            return RigStopError(
                f"no usable measurement for {1e3 * health.age:.0f} ms, limit {1e3 * rules.stale_stop:.0f} ms"
                f"{_doubts(health)}"
            )
        if health.following > rules.following or (status is not None and status.following_error):
            return RigStopError(
                f"cable {health.laggard} is {health.following / 1e3:.2f} mm from its set-point, "
                f"limit {rules.following / 1e3:.2f} mm"
            )
        if health.refused >= rules.rejects and status is not None:
            return RigStopError(
                f"the drives refused {health.refused} set-points in a row: {_refusal(status)}"
            )
        return None

    def _end(self, now: float, state: SafetyState, failure: TcrctlError) -> None:
        self.failure = self.failure or failure
        self._stopping_since = now
        self._go(state, "error", str(failure))

    def _go(self, state: SafetyState, level: str, cause: str) -> None:
        if state not in _NEXT[self.state]:
            raise RuntimeError(f"the supervisor cannot go from {self.state} to {state}: {cause}")
        before, self.state = self.state, state
        self._report("supervisor", level, f"{before} -> {state}: {cause}")


def _fault(status: DriveStatus | None, *, enabled: bool = True) -> str:
    """Say what of the drives' report ends a run at once and is latched; empty if all is well."""
    if status is None:
        return ""
    if status.estop:
        return "the emergency stop is pressed"
    if status.watchdog:
        return "the watchdog of the drives has tripped: they were not written to in time"
    if status.fault:
        return f"the drives report a fault: {status.fault}"
    if enabled and not status.enabled:
        return "the drives have switched themselves off"
    return ""


def _doubt(health: Health, rules: Rules) -> str:
    """Return why the drives shall be held for now; empty if all is well."""
    if health.trouble:
        return f"no answer of the drives: {health.trouble}"
    if health.age >= rules.stale:
        return f"no usable measurement for {1e3 * health.age:.0f} ms{_doubts(health)}"
    if health.refused and health.status is not None:
        return f"the drives refused a set-point: {_refusal(health.status)}"
    return ""


def _doubts(health: Health) -> str:
    return f"; markers that cannot be used: {health.doubts}" if health.doubts else ""


def _refusal(status: DriveStatus) -> str:
    return status.reject or "it was not acknowledged"


def _refusals(health: Health, rules: Rules) -> list[str]:
    """Return everything that stands against arming."""
    status, reasons = health.status, []
    if status is None or health.trouble:
        return [f"the drives do not answer {health.trouble}".strip()]
    if fault := _fault(status, enabled=False):
        reasons.append(fault)
    if not status.zeroed:
        reasons.append("tension-zero is not known (tcrctl rig zero)")
    if not status.remote:
        reasons.append("the drives are not switched to remote")
    if not status.acknowledged:
        reasons.append("the drives do not acknowledge")
    if health.age == math.inf:
        reasons.append(f"the cameras have shown no usable measurement{_doubts(health)}")
    elif not health.age < rules.stale:
        reasons.append(f"the newest usable measurement is {1e3 * health.age:.0f} ms old{_doubts(health)}")
    return reasons

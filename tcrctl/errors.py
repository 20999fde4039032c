"""Every error a user can meet: one base class, one exit code each, evidence in attributes.

Exit codes: 1 internal error, 2 usage or invalid input, 3 a criterion failed, 4 stopped by a safety
limit or divergence, 5 device, connection or file system, 130 Ctrl-C, 143 SIGTERM.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass

from tcrctl.visible import visible


class TcrctlError(Exception):
    """Base of all errors of tcrctl.

    Attributes:
        exit_code: Process exit code of this kind of error.
        hint: What the user can do about it; may be empty.
    """

    exit_code = 1

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(visible(message))
        self.hint = visible(hint)


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong in an input file.

    Attributes:
        where: ``file:line:column`` or ``--set key`` of the offending value.
        key: Dotted path of the value, for instance ``controller.horizon_s``.
        message: What is wrong, with the value and what was allowed.
    """

    where: str
    key: str
    message: str

    def __str__(self) -> str:
        """Return ``where: key: message``, without the key where it would stand twice."""
        if not self.key or self.where == f"--set {self.key}":
            return visible(f"{self.where}: {self.message}")
        return visible(f"{self.where}: {self.key}: {self.message}")


class InputError(TcrctlError):
    """A file, option or name given by the user cannot be used."""

    exit_code = 2


class SpecError(InputError):
    """A YAML file has problems; all of them are listed at once.

    Attributes:
        problems: Every problem found, in file order.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        super().__init__("\n".join(str(problem) for problem in problems))
        self.problems = tuple(problems)


class UnknownNameError(InputError):
    """A name was given that does not exist.

    Attributes:
        kind: What was looked for ("experiment", "robot", "node", ...).
        name: The name given.
        allowed: The names that exist.
    """

    def __init__(self, kind: str, name: str, allowed: Sequence[str]) -> None:
        name = name if len(name) <= 100 else f"{name[:100]}..."
        close = difflib.get_close_matches(name, allowed, n=1)
        hint = f"Did you mean {close[0]}?" if close else ""
        super().__init__(f"there is no {kind} named {name!r}; known: {', '.join(allowed)}", hint=hint)
        self.kind = kind
        self.name = name
        self.allowed = tuple(allowed)


class InfeasibleError(InputError):
    """The reference cannot be followed by this robot within its limits.

    Attributes:
        time: First offending time [s].
        quantity: Name of the quantity that breaks its limit.
        value: Its value.
        limit: The limit.
        unit: Unit of value and limit.
    """

    def __init__(
        self, time: float, quantity: str, value: float, limit: float, unit: str, *, hint: str = ""
    ) -> None:
        super().__init__(
            f"infeasible at t = {time:.3f} s: {quantity} is {value:.4g} {unit}, limit {limit:.4g} {unit}",
            hint=hint,
        )
        self.time = time
        self.quantity = quantity
        self.value = value
        self.limit = limit
        self.unit = unit


class NoEquilibriumError(InputError):
    """The static problem has no solution that the solver could find.

    Attributes:
        residual: Largest remaining nodal force [N].
        tolerance: Force accepted as equilibrium [N].
        iterations: Newton iterations spent.
    """

    def __init__(self, what: str, residual: float, tolerance: float, iterations: int) -> None:
        super().__init__(
            f"no equilibrium found for {what}: largest nodal force {residual:.3g} N after {iterations} "
            f"iterations, accepted {tolerance:.3g} N",
            hint="Check spring stiffness, initial tension and cone height; "
            "a slack or buckled robot has no stable shape.",
        )
        self.residual = residual
        self.tolerance = tolerance
        self.iterations = iterations


class StoppedError(TcrctlError):
    """The run was stopped by a safety limit or by divergence.

    Attributes:
        step: Control step k at which the run stopped.
    """

    exit_code = 4

    def __init__(self, message: str, step: int = -1, *, hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.step = step


class SafetyLimitError(StoppedError):
    """A quantity left the range in which the run may go on; the drives were held.

    Attributes:
        quantity: Name of the quantity.
        value: Its value.
        limit: The limit.
        unit: Unit of value and limit; empty for a count.
    """

    def __init__(self, step: int, quantity: str, value: float, limit: float, unit: str) -> None:
        of = f" {unit}" if unit else ""
        super().__init__(
            f"safety stop at step {step}: {quantity} is {value:.4g}{of}, limit {limit:.4g}{of}", step
        )
        self.quantity = quantity
        self.value = value
        self.limit = limit
        self.unit = unit


class PictureError(StoppedError):
    """Too little of what the cameras show can be believed; ``doubts`` says what is not, and why."""

    def __init__(self, step: int, doubts: str) -> None:
        text = f"safety stop at step {step}: the cameras' picture is not believed: {doubts}"
        super().__init__(text, step, hint="tcrctl rig check; limits: safety.picture, docs/bench.md.")
        self.doubts = doubts


class PluginStoppedError(StoppedError):
    """Code from elsewhere failed while it ran, or returned what cannot be used.

    Attributes:
        plugin: Section and kind.
        cause: What it did.
    """

    def __init__(self, plugin: str, cause: str) -> None:
        super().__init__(f"stopped by {plugin}: {cause}")
        self.plugin, self.cause = plugin, cause


class TimeLimitError(StoppedError):
    """A run took longer than it may.

    Attributes:
        limit_s: What it may take [s].
    """

    def __init__(self, limit_s: float) -> None:
        super().__init__(f"took longer than {limit_s:g} s")
        self.limit_s = limit_s


class DivergenceError(StoppedError):
    """The simulated plant could not complete an internal step.

    Attributes:
        time: Simulated time [s].
        residual: Largest remaining nodal force [N].
        smallest_h: Smallest internal step that was tried [s].
    """

    def __init__(self, time: float, residual: float, smallest_h: float) -> None:
        super().__init__(
            f"the simulated plant did not converge at t = {time:.4f} s: residual {residual:.3g} N "
            f"with sub-steps down to {smallest_h:.2g} s"
        )
        self.time = time
        self.residual = residual
        self.smallest_h = smallest_h


class RunInterruptedError(TcrctlError):
    """A signal asked the run to stop, and it did so between two control steps.

    Attributes:
        signal: Number of the signal.
        exit_code: 128 + number: 130 for Ctrl-C, 143 for SIGTERM.
    """

    def __init__(self, number: int, name: str) -> None:
        super().__init__(f"stopped by {name}")
        self.signal, self.exit_code = number, 128 + number


class DeviceError(TcrctlError):
    """A device, connection or the file system failed."""

    exit_code = 5


class LogError(DeviceError):
    """A log could not be written or read.

    Attributes:
        path: The log file.
    """

    def __init__(self, path: object, message: str, *, hint: str = "") -> None:
        super().__init__(f"{path}: {message}", hint=hint)
        self.path = str(path)


class RigStopError(StoppedError):
    """The rig was brought to a safe stop: emergency stop, watchdog, cameras or drives that cannot be trusted.

    Attributes:
        cause: What made the safety supervisor act.
    """

    def __init__(self, cause: str, *, hint: str = "") -> None:
        super().__init__(f"safety stop of the rig: {cause}", hint=hint)
        self.cause = cause


class ArmingRefusedError(StoppedError):
    """The drives were not armed; nothing has moved.

    Attributes:
        reasons: Every condition that is not met.
    """

    def __init__(self, reasons: Sequence[str], *, hint: str = "") -> None:
        super().__init__(f"the drives are not armed: {'; '.join(reasons)}", hint=hint)
        self.reasons = tuple(reasons)


class NotArrivedError(StoppedError):
    """Drives stand elsewhere than they were sent.

    Attributes:
        wanted_mm: Where they were sent (m,) [mm].
        reached_mm: Where they are (m,) [mm].
    """

    def __init__(self, names: Sequence[str], wanted_mm: Sequence[float], reached_mm: Sequence[float]) -> None:
        self.wanted_mm, self.reached_mm = tuple(wanted_mm), tuple(reached_mm)
        places = ", ".join(
            f"{name} is at {at:.3f} mm, sent to {to:.3f} mm"
            for name, to, at in zip(names, wanted_mm, reached_mm, strict=True)
            if abs(at - to) >= 0.05
        )
        super().__init__(
            f"the drives did not arrive: {places}",
            hint="Limits on speed or step, another program that writes, a drive that does not follow?",
        )


class UntrustworthyDeviceError(DeviceError):
    """A device answers, but what it says cannot be true; waiting or asking again does not help."""

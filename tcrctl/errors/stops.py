"""What stops a run, or does not let it begin, so that nothing is harmed: exit code 4."""

from __future__ import annotations

from collections.abc import Sequence

from tcrctl.errors.base import TcrctlError


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

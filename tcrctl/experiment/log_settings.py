"""The section ``log`` of an experiment file."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from tcrctl.config.settings import Settings, quantity

#: Control rate up to which ``full_state_s: auto`` means every step [Hz].
_RICH_RATE_HZ: Final = 20.0


class LogSettings(Settings):
    """How much of the steps is logged, and how often it reaches the disk: at the earlier of the two intervals."""

    flush_s: float = quantity("s", "longest time between two flushes", 0.5, gt=0)
    flush_steps: int = Field(default=500, ge=1, description="most control steps between two flushes")
    fsync: bool = Field(default=False, description="wait until the disk has the data, against power failure")
    full_state_s: Literal["auto"] | Annotated[float, Field(ge=0)] = quantity(
        "s",
        "time between two steps with all node positions, velocities and forces (0: every step), which replay "
        "computes again; auto: every step at up to 20 Hz, else 1 s",
        "auto",
    )

    def full_state(self, period: float) -> float:
        """Return the time between two steps that are logged in full at a control period [s]; 0: every step."""
        if self.full_state_s != "auto":
            return self.full_state_s
        return 0.0 if period * _RICH_RATE_HZ > 1.0 - 1e-9 else 1.0

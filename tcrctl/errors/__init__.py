"""Every error a user can meet: one base class, one exit code each, evidence in attributes.

Exit codes: 1 internal error, 2 usage or invalid input, 3 a criterion failed, 4 stopped by a safety
limit or divergence, 5 device, connection or file system, 130 Ctrl-C, 143 SIGTERM.
"""

from __future__ import annotations

from tcrctl.errors.base import RunInterruptedError, TcrctlError, with_hint
from tcrctl.errors.devices import DeviceError, LogError, UntrustworthyDeviceError
from tcrctl.errors.inputs import (
    InfeasibleError,
    InputError,
    NoEquilibriumError,
    Problem,
    SpecError,
    UnknownNameError,
)
from tcrctl.errors.stops import (
    ArmingRefusedError,
    DivergenceError,
    NotArrivedError,
    PictureError,
    PluginStoppedError,
    RigStopError,
    SafetyLimitError,
    StoppedError,
    TimeLimitError,
)

__all__ = [
    "ArmingRefusedError",
    "DeviceError",
    "DivergenceError",
    "InfeasibleError",
    "InputError",
    "LogError",
    "NoEquilibriumError",
    "NotArrivedError",
    "PictureError",
    "PluginStoppedError",
    "Problem",
    "RigStopError",
    "RunInterruptedError",
    "SafetyLimitError",
    "SpecError",
    "StoppedError",
    "TcrctlError",
    "TimeLimitError",
    "UnknownNameError",
    "UntrustworthyDeviceError",
    "with_hint",
]

"""A rig file and the control period, held against what the drives allow by themselves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tcrctl.errors import ArmingRefusedError, InputError
from tcrctl.plant.rig.devices import Drives
from tcrctl.plant.rig.mounting import CableAxis
from tcrctl.plant.rig.settings import SafetyRules

#: Why drives without a watchdog are not armed.
UNWATCHED: Final = "they have no watchdog: if this program dies, nobody stops them"


def check_drives(drives: Drives, cables: tuple[CableAxis, ...], rules: SafetyRules, period: float) -> None:
    """Do nothing if drives may be moved as the rig file says, once in a period.

    Args:
        drives: Are asked for what they allow.
        cables: What the rig file allows, in the order of the drives.
        rules: Its safety section.
        period: Time between two exchanges [s].

    Raises:
        InputError: If the drives do not allow it; all is listed.
        ArmingRefusedError: If they have no watchdog.
    """
    check_limits(drives, cables, rules)
    check_load(drives, period)
    if drives.watchdog is None:
        raise ArmingRefusedError([f"{drives.identity.where}: {UNWATCHED}"])


def check_limits(drives: Drives, cables: tuple[CableAxis, ...], rules: SafetyRules) -> None:
    """Hold the rig file against the drives' own limits.

    Raises:
        InputError: With everything that the drives would not allow.
    """
    wrong = list(_excesses(drives, cables, rules))
    if wrong:
        where = drives.identity.where
        raise InputError(f"the rig file allows more than the {where}: {'; '.join(wrong)}")


def check_load(drives: Drives, period: float) -> float:
    """Return the share of a control period [s] that the line is busy.

    Raises:
        InputError: If an exchange takes longer, or the watchdog is faster.
    """
    share = drives.load(period)
    if drives.watchdog is not None and drives.watchdog <= period:
        watchdog = f"watchdog of the {drives.identity.where}, {1e3 * drives.watchdog:g} ms"
        raise InputError(f"a period of {1e3 * period:g} ms is not shorter than the {watchdog}")
    return share


def _excesses(drives: Drives, cables: tuple[CableAxis, ...], rules: SafetyRules) -> Iterator[str]:
    own, name = drives.limits, drives.identity.name
    for cable, least, most in zip(cables, own.low, own.high, strict=True):
        if cable.low < least or cable.high > most:
            yield (
                f"cable {cable.name}: {cable.low / 1e3:g} to {cable.high / 1e3:g} mm on axis {cable.axis}, "
                f"{name} {least / 1e3:g} to {most / 1e3:g} mm"
            )
    fastest = max(cable.speed for cable in cables)
    if fastest > own.speed:
        yield f"speed {fastest / 1e3:g} mm/s, {name} {own.speed / 1e3:g} mm/s"
    if 1e3 * rules.max_step_mm > own.step:
        yield f"max_step_mm {rules.max_step_mm:g} mm, {name} {own.step / 1e3:g} mm"

"""``tcrctl rig zero`` and ``tcrctl rig reset``: single edges to the PLC, with proof of what they did."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final

from tcrctl.errors import ArmingRefusedError, DeviceError
from tcrctl.plant.rig.assembly import connect_drives, supervisor_rules
from tcrctl.plant.rig.devices import DriveControl, Drives, DriveStatus
from tcrctl.plant.rig.file import LoadedRig
from tcrctl.plant.rig.operation import Operation
from tcrctl.plant.rig.supervisor import Supervisor

#: How long the PLC has for what an edge asks for [s].
PATIENCE: Final = 2.0
CYCLE: Final = 0.02
#: Drives that are this near to 0 after zeroing are at 0 [um].
AT_ZERO: Final = 50
STILL: Final = 20


def zero_rig(
    loaded: LoadedRig, names: tuple[str, ...], operation: Operation, *, dry_run: bool
) -> dict[str, Any]:
    """Make the present positions of all drives zero.

    The operator has brought every cable to its rest tension before, with the PLC's own manual mode.

    Args:
        loaded: The rig file.
        names: Cables in the order of the drives.
        operation: Takes events, knows whether the operator has agreed.
        dry_run: Only look whether it could be done.

    Returns:
        Positions before and after [mm].

    Raises:
        ArmingRefusedError: If a condition is not met; nothing was written.
        DeviceError: If the PLC does not answer, or does not do it.
    """
    drives = connect_drives(loaded, names)
    supervisor = Supervisor(supervisor_rules(loaded.rig.safety), operation.report)
    try:
        before = _standing_still(drives, operation, dry_run=dry_run)
        result = {"before_mm": _positions(names, before), "zeroed": before.zeroed}
        if dry_run:
            return result
        supervisor.begin_zeroing()
        after = _edge(
            drives, before, DriveControl(permit=True, zero=True), lambda s: s.zeroed and _at_zero(s)
        )
        if after is None:
            supervisor.end_zeroing("the drives did not confirm")
            raise DeviceError(f"the drives did not confirm tension-zero within {PATIENCE:g} s")
        supervisor.end_zeroing("confirmed by the drives")
        return {**result, "after_mm": _positions(names, after), "zeroed": after.zeroed}
    finally:
        drives.close()


def reset_rig(
    loaded: LoadedRig, names: tuple[str, ...], operation: Operation, *, dry_run: bool
) -> dict[str, Any]:
    """Clear the latched fault of a PLC whose cause has been removed; nothing moves.

    Args:
        loaded: The rig file.
        names: Cables in the order of the drives.
        operation: Takes events, knows whether the operator has agreed.
        dry_run: Only say what is latched.

    Raises:
        ArmingRefusedError: If the emergency stop is still pressed, or nobody has agreed.
        DeviceError: If the PLC does not answer, or keeps its fault.
    """
    drives = connect_drives(loaded, names)
    try:
        before = drives.status()
        fault = before.fault or ("watchdog" if before.watchdog else "")
        if dry_run or not fault:
            return {"fault": fault or None, "cleared": False}
        reasons = ["the emergency stop is pressed"] if before.estop else []
        reasons += [] if operation.confirmed else ["the operator has not agreed (--yes)"]
        if reasons:
            raise ArmingRefusedError(reasons)
        after = _edge(drives, before, DriveControl(reset=True), lambda s: not (s.fault or s.watchdog))
        if after is None:
            raise DeviceError(f"the drives keep their fault: {fault}", hint="Its cause may still be there.")
        operation.report("rig", "info", f"fault cleared: {fault}")
        return {"fault": fault, "cleared": True}
    finally:
        drives.close()


def _standing_still(drives: Drives, operation: Operation, *, dry_run: bool) -> DriveStatus:
    first = drives.status()
    time.sleep(5 * CYCLE)
    status = drives.status()
    reasons = ["the emergency stop is pressed"] if status.estop else []
    reasons += [f"the drives report a fault: {status.fault}"] if status.fault else []
    reasons += ["a drive is moving"] if abs(status.position - first.position).max() > STILL else []
    reasons += ["the drives are enabled by somebody else"] if status.enabled else []
    reasons += [] if operation.confirmed or dry_run else ["the operator has not agreed (--yes)"]
    if reasons:
        raise ArmingRefusedError(reasons)
    return status


def _edge(
    drives: Drives, status: DriveStatus, control: DriveControl, done: Callable[[DriveStatus], bool]
) -> DriveStatus | None:
    """Send the bits low, high and low again; the status in which it is done, None if it never is."""
    low = DriveControl(permit=control.permit)
    drives.exchange(status.position, low)
    time.sleep(CYCLE)
    end, found = time.monotonic() + PATIENCE, None
    while found is None and time.monotonic() < end:
        status = drives.exchange(status.position, control)
        found = status if done(status) else None
        time.sleep(CYCLE)
    drives.exchange(status.position, low)
    time.sleep(CYCLE)
    drives.exchange(status.position, DriveControl())
    return found


def _at_zero(status: DriveStatus) -> bool:
    return bool(abs(status.position).max() <= AT_ZERO)


def _positions(names: tuple[str, ...], status: DriveStatus) -> dict[str, float]:
    return {name: int(um) / 1e3 for name, um in zip(names, status.position, strict=True)}

"""``tcrctl rig check``: is everything as the rig file says, and ready to be armed? Only reads."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from typing import Final

import numpy as np

from tcrctl.commissioning.picture import judged_picture
from tcrctl.errors import DeviceError, InputError, with_hint
from tcrctl.plant.rig.assembly import connect_cameras, connect_drives
from tcrctl.plant.rig.devices import Cameras, Drives, DriveStatus, Sighting
from tcrctl.plant.rig.file import LoadedRig
from tcrctl.plant.rig.finding import NOT_READY, Finding
from tcrctl.plant.rig.mounting import CableAxis, cable_axes, mounting
from tcrctl.plant.rig.own_limits import UNWATCHED, check_limits, check_load
from tcrctl.plant.rig.settings import SafetyRules
from tcrctl.robot.module import ring_rows
from tcrctl.robot.robot import Robot

#: How long the cameras are watched [s].
WATCHED: Final = 1.0
#: Status reads whose round trips are measured.
READS: Final = 100
#: Measured rings further from the robot at rest than this mean a wrong calibration [m].
ELSEWHERE: Final = 0.1
#: Sides of measured rings may differ so much from those of the robot; more means a wrong unit or label.
SIDE_ERROR: Final = 0.05
WRONG_FILE: Final = InputError.exit_code
NO_DEVICE: Final = DeviceError.exit_code


def check_rig(loaded: LoadedRig, robot: Robot, period: float) -> Iterator[Finding]:
    """Yield what is found, line by line.

    Args:
        loaded: The rig file.
        robot: The robot that hangs there.
        period: Control period that shall be possible [s].
    """
    wanted = mounting(loaded.mounted, robot)
    seen: list[Sighting] = []
    try:
        cameras = connect_cameras(loaded, wanted)
    except (DeviceError, InputError) as error:
        yield Finding("cameras", with_hint(error), error.exit_code)
    else:
        try:
            yield from _check_cameras(cameras, len(wanted.markers), robot, loaded.rig.safety, seen)
        except DeviceError as error:
            yield Finding("cameras", with_hint(error), error.exit_code)
        finally:
            cameras.close()
    try:
        drives = connect_drives(loaded, robot.cable_names)
    except (DeviceError, InputError) as error:
        yield Finding(loaded.mounted.plc.called, with_hint(error), error.exit_code)
        return
    try:
        axes = cable_axes(loaded.mounted, robot.cable_names)
        status = yield from _check_drives(drives, axes, loaded, period)
        if seen:
            yield from judged_picture(robot, seen, status)
        yield from readiness(status)
    except DeviceError as error:
        yield Finding(loaded.mounted.plc.called, with_hint(error), error.exit_code)
    finally:
        drives.close()


def _check_cameras(
    cameras: Cameras, mapped: int, robot: Robot, rules: SafetyRules, seen: list[Sighting]
) -> Iterator[Finding]:
    """Check the stream; frames are added to ``seen``."""
    if cameras.identity.text:
        yield Finding("cameras", f"{cameras.identity.text}, {cameras.rate:g} Hz")
    end = time.monotonic() + WATCHED
    while time.monotonic() < end:
        sighting = cameras.next(0.1, fresh=True)
        if sighting is not None:
            seen.append(sighting)
    if not seen:
        yield Finding("frames", f"none within {WATCHED:g} s", NO_DEVICE)
        return
    counts = cameras.status()
    text = f"{len(seen)} in {WATCHED:g} s, {counts.lost} lost, {counts.malformed} malformed"
    yield Finding("frames", text, 0 if len(seen) > 0.5 * cameras.rate * WATCHED else NOT_READY)
    yield _age(cameras, 1e3 * float(np.median([sighting.raw.delay for sighting in seen])), rules)
    yield from cameras.checks(seen)
    valid = np.mean([sighting.valid for sighting in seen], axis=0)
    always = int(np.count_nonzero(valid == 1.0))
    doubts = f"; last frame: {seen[-1].doubts}" if seen[-1].doubts else ""
    text = f"{always} of {mapped} in every frame{doubts}"
    yield Finding("markers", text, 0 if always == mapped else NOT_READY)
    yield from _check_places(seen[-1], robot)


def _age(cameras: Cameras, delay: float, rules: SafetyRules) -> Finding:
    """Judge how old frames are when they arrive; ``delay`` is the median [ms]."""
    if cameras.clock:
        return Finding("age", f"{cameras.clock}; counted from the arrival")
    impossible = cameras.status().impossible
    text = f"{delay:.1f} ms on arrival"
    if impossible:
        return Finding("age", f"{impossible} frames with impossible time stamps; otherwise {text}", NOT_READY)
    if not 0.0 <= delay < rules.stale_after_ms:
        return Finding("age", f"{text}, limit {rules.stale_after_ms:g} ms (safety.stale_after_ms)", NOT_READY)
    return Finding("age", text)


def _check_places(sighting: Sighting, robot: Robot) -> Iterator[Finding]:
    """Check sizes, which tell the unit and the labels, and places, which tell the calibration."""
    rest = robot.rest.q.reshape(-1, 3)[ring_rows(robot.n_modules)].reshape(-1, 3, 3)
    rings = sighting.nodes.astype(float).reshape(-1, 3, 3)
    whole = sighting.valid.reshape(-1, 3).all(axis=1)
    if not whole.any():
        yield Finding("rings", "none is seen whole", NOT_READY)
        return
    sides = np.linalg.norm(rings - np.roll(rings, 1, axis=1), axis=2)[whole]
    wanted = np.linalg.norm(rest - np.roll(rest, 1, axis=1), axis=2)[whole]
    error = float(np.abs(sides / wanted - 1.0).max())
    text = (
        f"{np.count_nonzero(whole)} seen whole, sides differ from the robot's by at most {100 * error:.2f} %"
    )
    yield Finding("rings", text, 0 if error < SIDE_ERROR else WRONG_FILE)
    away = float(np.linalg.norm(rings[whole] - rest[whole], axis=2).max())
    text = f"nodes are at most {1e3 * away:.1f} mm from the robot at rest"
    yield Finding("calibration", text, 0 if away < ELSEWHERE else WRONG_FILE)


def _check_drives(
    drives: Drives, cables: tuple[CableAxis, ...], loaded: LoadedRig, period: float
) -> Generator[Finding, None, DriveStatus]:
    """Check the drives and the line to them; return what they say."""
    identity = drives.identity
    yield Finding(identity.name, identity.text)
    try:
        check_limits(drives, cables, loaded.rig.safety)
        yield Finding("limits", f"the rig file's are inside the {identity.name}'s")
        share = check_load(drives, period)
        yield Finding("period", f"{1e3 * period:g} ms; the line is busy {100 * share:.0f} % of it")
    except InputError as error:
        yield Finding("limits", with_hint(error), error.exit_code)
    if drives.watchdog is None:
        yield Finding("watchdog", UNWATCHED, NOT_READY)
    yield from drives.checks()
    trips = []
    for _ in range(READS):
        status = drives.status()
        trips.append(1e3 * status.round_trip)
    p50, p99 = np.quantile(trips, [0.5, 0.99])
    yield Finding("round trip", f"p50 {p50:.2f} ms, p99 {p99:.2f} ms")
    positions = ", ".join(f"{1e-3 * um:.3f}" for um in status.position)
    yield Finding("drives", f"at {positions} mm")
    return status


def readiness(status: DriveStatus) -> Iterator[Finding]:
    """Yield what the drives say that matters for arming."""
    yield Finding("emergency stop", *(("pressed", NOT_READY) if status.estop else ("released", 0)))
    latched = status.fault or ("watchdog" if status.watchdog else "")
    reset = f"{latched}; when its cause is removed: tcrctl rig reset"
    yield Finding("fault", *((reset, NOT_READY) if latched else ("none", 0)))
    yield Finding("zeroed", *(("yes", 0) if status.zeroed else ("no; tcrctl rig zero", NOT_READY)))
    yield Finding("remote", *(("yes", 0) if status.remote else ("no", NOT_READY)))
    yield Finding("enabled", "yes" if status.enabled else "no")

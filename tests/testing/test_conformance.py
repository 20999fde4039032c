"""The conformance suite: good devices pass, and every way to break a promise fails the check of that promise."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from support.conformance_fakes import CameraWorld, DriveWorld, GoodCameras, GoodDrives
from tcrctl.plant.rig.devices import DeviceLimits, Identity
from tcrctl.plant.rig.finding import Finding
from tcrctl.testing import (
    CAMERA_CHECKS,
    DRIVE_CHECKS,
    BrokenPromiseError,
    CameraConformance,
    DriveConformance,
    Untried,
)


class TestGoodCameras(CameraConformance):
    @pytest.fixture
    def bench(self):
        return CameraWorld().bench()


class TestGoodDrives(DriveConformance):
    @pytest.fixture
    def bench(self):
        return DriveWorld().bench()


def changed(**changes):
    """A method of cameras that changes their frames."""
    return {"frame": lambda self, k: replace(GoodCameras.frame(self, k), **changes)}


def raw(**changes):
    def frame(self, k):
        seen = GoodCameras.frame(self, k)
        return replace(seen, raw=replace(seen.raw, **changes))

    return {"frame": frame}


def shifted(seconds):
    def frame(self, k):
        seen = GoodCameras.frame(self, k)
        return replace(seen, taken=seen.taken + seconds)

    return {"frame": frame}


def queued(self, timeout, *, fresh):
    """One frame after the other, however old."""
    self.last = self.last + 1 if self.last >= 0 else self.number()
    self.world.clock.time = max(self.world.clock.time, self.last / self.rate + self.age)
    return self.frame(self.last)


def twice(self, timeout, *, fresh):
    return self.frame(max(0, self.number())) if not fresh else GoodCameras.next(self, timeout, fresh=fresh)


def waiting(self, timeout, *, fresh):
    return GoodCameras.next(self, timeout, fresh=False)


def patient(self, timeout, *, fresh):
    return GoodCameras.next(self, timeout + 3.0, fresh=fresh)


def made_up(self, timeout, *, fresh):
    silent, self.world.silent = self.world.silent, False
    try:
        return GoodCameras.next(self, timeout, fresh=fresh)
    finally:
        self.world.silent = silent


def deaf(self, timeout, *, fresh):
    """Once silent, for ever silent."""
    self.open = self.open and not self.world.silent
    return GoodCameras.next(self, timeout, fresh=fresh)


def lossy(self, timeout, *, fresh):
    self.last = max(self.last, self.number()) + 3
    return GoodCameras.next(self, timeout, fresh=fresh)


def raising(error):
    def action(self, *given, **named):
        raise error

    return action


def after_close(self, timeout, *, fresh):
    if not self.open:
        raise AttributeError("no socket")
    return GoodCameras.next(self, timeout, fresh=fresh)


def closed_once(self):
    if not self.open:
        raise OSError("closed")
    self.open = False


WRONG = Finding("lens", "dirty", 4)
BROKEN_CAMERAS = {
    "identity is a text": ("identity", {"identity": "me"}, "identity is an Identity, not a str"),
    "details are numbers": ("identity", {"identity": Identity("a", "b", "", {"v": 4})}, "is text"),
    "nameless": ("identity", {"identity": Identity("", "")}, "what the device is called"),
    "no clock": ("identity", {"clock": None}, "clock is a text"),
    "another rate than it says": ("rate", {"rate": 100.0, "next": lossy}, "not 50"),
    "no rate": ("rate", {"rate": 0.0}, "a number of frames per second"),
    "frames are maps": ("frames", {"frame": lambda self, k: {}}, "next returns a Sighting, not a dict"),
    "nodes in doubles": ("frames", changed(nodes=np.zeros((6, 3))), "nodes are float32"),
    "nodes of others": ("frames", changed(nodes=np.zeros((5, 3), np.float32)), "nodes are float32 (6, 3)"),
    "valid as numbers": ("frames", changed(valid=np.ones(6, int)), "valid is bool"),
    "valid NaN": ("frames", changed(nodes=np.full((6, 3), np.nan, np.float32)), "nodes that are valid are finite"),
    "silent about lost markers": ("frames", changed(valid=np.arange(6) > 0), "doubts says why 1 are not valid"),
    "lost markers": ("frames", changed(valid=np.arange(6) > 0, doubts="1 lost"), "all 6 markers are valid, not 5"),
    "no raw frame": ("raw_frames", changed(raw=None), "raw is a RawFrame"),
    "raw in doubles": ("raw_frames", raw(positions=np.zeros((2, 3))), "raw.positions is float32"),
    "raw ids in 64 bits": ("raw_frames", raw(ids=np.zeros(2, np.int64)), "int32"),
    "raw number -1": ("raw_frames", raw(number=-1), "are counts"),
    "names as a list": ("raw_frames", raw(names=["a"]), "raw.names is a text"),
    "from the future": ("time_of_frames", shifted(0.02), "no frame is taken in the future"),
    "too old": ("time_of_frames", shifted(-0.1), "at most 10 ms"),
    "all at one time": ("time_of_frames", changed(taken=50.0), "taken after the one before"),
    "negative delay": ("time_of_frames", raw(delay=-0.01), "raw.delay is not negative"),
    "delay of other units": ("time_of_frames", raw(delay=3.0), "not more than the age now"),
    "a queue": ("newest_first", {"next": queued}, "after a pause the newest frame comes first"),
    "frames twice": ("every_frame_once", {"next": twice}, "is returned once"),
    "fresh ones that wait here": ("fresh_frames", {"next": waiting}, "a fresh frame arrives after"),
    "made up while silent": ("silence", {"next": made_up}, "no frame is made up"),
    "waits too long": ("silence", {"next": patient}, "while no frame comes"),
    "deaf after silence": ("silence", {"next": deaf}, "a frame comes within 2 s"),
    "frozen frames are new": ("frozen", {"repeated": lambda self: False}, "repeats the last one bit for bit"),
    "hidden markers are valid": ("hidden", changed(valid=np.ones(6, np.bool_)), "some markers are not valid"),
    "hidden without a word": ("hidden", changed(doubts=""), "doubts says why markers"),
    "status is a map": ("status", {"status": lambda self: {}}, "status returns a CameraStatus"),
    "checks find something": ("own_checks", {"checks": lambda self, seen: [WRONG]}, "but lens: dirty"),
    "checks find a text": ("own_checks", {"checks": lambda self, seen: ["dirty"]}, "Findings and nothing else"),
    "raises after close": ("closing", {"next": after_close}, "raises AttributeError, not a DeviceError"),
    "goes on after close": ("closing", {"close": lambda self: None}, "no frame comes after close"),
}  # fmt: skip


def exchanging(change):
    """An exchange that goes on as a good one with other arguments."""
    return {"exchange": lambda self, target, control: GoodDrives.exchange(self, *change(target, control))}


def telling(**changes):
    return {"told": lambda self: replace(GoodDrives.told(self), **changes)}


def moving_when_read(self):
    self.world.position += 50.0
    return GoodDrives.status(self)


def feeding(self):
    self.world.fed = self.world.clock()
    return GoodDrives.status(self)


def jumping(self, target, control):
    if control.enable and not self.world.on:
        self.world.position += 500.0
    return GoodDrives.exchange(self, target, control)


def spoiling(self, target, control):
    target += 1
    return GoodDrives.exchange(self, target, control)


def coasting(self, target, control):
    """Goes on without permit."""
    return GoodDrives.exchange(self, target, replace(control, permit=True, follow=True))


def leaving(self):
    self.world.position[:] = 0.0


def slow(self, target, control):
    self.world.clock.sleep(0.5)
    return GoodDrives.exchange(self, target, control)


def instant(self, target):
    self.reject, self.world.position = "", np.clip(target, self.world.low, self.world.high).astype(float)
    return True


def beyond(self, target):
    self.world.position = target.astype(float)
    return True


def quiet_limits(self, target):
    taken = GoodDrives.taken(self, target)
    self.reject = ""
    return taken


def unlatched(self):
    self.on, self.tripped = False, False


def no_stop(self):
    """A watchdog that does nothing."""


def silent_values(self):
    if self.world.silent:
        raise ValueError("no answer")
    GoodDrives.call(self)


def silent_success(self):
    self.world.silent = False
    GoodDrives.call(self)


def hanging(self):
    if self.world.silent:
        self.world.clock.sleep(2.0)
    GoodDrives.call(self)


def lost(self):
    self.gone = getattr(self, "gone", False) or self.world.silent
    self.world.silent = self.gone
    GoodDrives.call(self)


def no_edges(self, control):
    """Knows no reset and no zero."""


def limits_of(**changes):
    good = {"low": np.full(3, -3e4), "high": np.full(3, 3e4)}
    return {"limits": property(lambda self: DeviceLimits(**{**good, **changes}), lambda self, value: None)}


def told_watchdog(value):
    return {"watchdog": property(lambda self: value, lambda self, given: None)}


BROKEN_DRIVES = {
    "identity is a text": ("identity", {"identity": "me"}, "identity is an Identity"),
    "limits of others": ("limits", limits_of(low=np.zeros(2)), "low and high are of shape (3,)"),
    "limits turned round": ("limits", limits_of(low=np.full(3, 4e4)), "low is less than high"),
    "no room": ("limits", limits_of(speed=0.0), "leave room to move"),
    "outside of its limits": ("limits", limits_of(low=np.full(3, 1e3)), "stand inside their limits"),
    "no watchdog": ("watchdog", told_watchdog(None), "the drives have a watchdog"),
    "watchdog of a minute": ("watchdog", told_watchdog(60.0), "at most 5 s"),
    "watchdog faster than a loop": ("watchdog", told_watchdog(0.01), "longer than a period"),
    "exchanges longer than a period": ("load", {"load": lambda self, period: 1.5}, "less than a period"),
    "status is a map": ("reading", {"status": lambda self: {}}, "status returns a DriveStatus, not a dict"),
    "positions in millimetres": ("reading", telling(position=np.zeros(3)), "whole micrometres, not float64"),
    "positions of others": ("reading", telling(position=np.zeros(2, int)), "positions of 3 cables"),
    "moves when read": ("reading", {"status": moving_when_read}, "nothing moves"),
    "on when opened": ("reading", telling(enabled=True), "the drives are off"),
    "slow": ("answers_in_time", {"exchange": slow}, "an exchange takes at most 0.2 s"),
    "round trip of other units": ("answers_in_time", telling(round_trip=2.0), "the time of the exchange"),
    "never on": ("enabling", telling(enabled=False), "the drives are on within 3 s"),
    "jumps when switched on": ("enabling", {"exchange": jumping}, "switching on moves nothing, not 500"),
    "changes what it is given": ("enabling", {"exchange": spoiling}, "as they are"),
    "wrong sign": ("following", exchanging(lambda target, control: (-target, control)), "drives arrive within"),
    "wrong axis": ("following", exchanging(lambda target, control: (target[::-1], control)), "drives arrive"),
    "stands still": ("following", {"taken": lambda self, target: False}, "drives arrive within"),
    "refuses all": ("following", telling(reject="no"), "set-points inside all limits are taken"),
    "follows unasked": ("needs_follow", exchanging(
        lambda target, control: (target, replace(control, follow=control.enable))), "without follow nothing moves"),
    "follows when off": ("needs_enable", exchanging(
        lambda target, control: (target, replace(control, enable=True))), "without enable nothing moves"),
    "knows no permit": ("stopping", {"exchange": coasting}, "a stop ends within 0.5 s"),
    "reading feeds the watchdog": ("watchdog_stops", {"status": feeding}, "off when nobody writes"),
    "watchdog without a word": ("watchdog_stops", telling(watchdog=False), "the watchdog has stopped them"),
    "no reset": ("watchdog_stops", {"edges": no_edges}, "reset clears the watchdog"),
    "leaves its limits": ("outside_limits", {"taken": beyond}, "no drive leaves its limits"),
    "refuses without a word": ("outside_limits", {"taken": quiet_limits}, "reject says why"),
    "jumps": ("too_far_at_once", {"taken": instant}, "no faster than their limit"),
    "no zero": ("zeroing", {"edges": no_edges}, "the positions are zero, not 1000"),
    "zero not told": ("zeroing", telling(zeroed=False), "zeroed says that zero is known"),
    "silence is a ValueError": ("silence", {"call": silent_values}, "raises ValueError, not a DeviceError"),
    "silence is an answer": ("silence", {"call": silent_success}, "without an answer is a DeviceError"),
    "silence hangs": ("silence", {"call": hanging}, "it is told within 0.2 s"),
    "silent for ever": ("silence", {"call": lost}, "heard again"),
    "emergency stop without a word": ("emergency_stop", telling(estop=False), "estop says"),
    "checks find something": ("own_checks", {"checks": lambda self: [WRONG]}, "but lens: dirty"),
    "lets go when closed": ("closing", {"close": leaving}, "closing and opening moves nothing"),
}  # fmt: skip
BROKEN_WORLDS = {
    "no watchdog in fact": ("watchdog_stops", {"trip": no_stop}, "off when nobody writes"),
    "watchdog that is not latched": ("watchdog_stops", {"trip": unlatched}, "the watchdog has stopped them"),
}


@pytest.mark.parametrize("name", BROKEN_CAMERAS)
def test_broken_cameras_fail_the_check_of_the_promise_that_they_break(name):
    check, members, message = BROKEN_CAMERAS[name]
    kind = type("Broken", (GoodCameras,), members)
    with pytest.raises(BrokenPromiseError, match=re.escape(message)):
        CAMERA_CHECKS[check](CameraWorld().bench(kind))


@pytest.mark.parametrize("name", [*BROKEN_DRIVES, *BROKEN_WORLDS])
def test_broken_drives_fail_the_check_of_the_promise_that_they_break(name):
    if name in BROKEN_DRIVES:
        check, members, message = BROKEN_DRIVES[name]
        bench = DriveWorld().bench(type("Broken", (GoodDrives,), members))
    else:
        check, members, message = BROKEN_WORLDS[name]
        bench = type("World", (DriveWorld,), members)().bench()
    with pytest.raises(BrokenPromiseError, match=re.escape(message)):
        DRIVE_CHECKS[check](bench)


def test_every_check_has_a_way_to_fail():
    assert {check for check, *_ in BROKEN_CAMERAS.values()} == set(CAMERA_CHECKS)
    assert {check for check, *_ in (*BROKEN_DRIVES.values(), *BROKEN_WORLDS.values())} == set(DRIVE_CHECKS)


def test_what_a_bench_cannot_do_is_not_tried():
    cameras = CameraWorld().bench(silence=None, freeze=None, hide=None)
    for name in ("silence", "frozen", "hidden"):
        with pytest.raises(Untried, match="the bench has no"):
            CAMERA_CHECKS[name](cameras)
    drives = DriveWorld().bench(silence=None, estop=None, emulated=False)
    for name in ("silence", "emergency_stop", "outside_limits", "too_far_at_once", "zeroing"):
        with pytest.raises(Untried):
            DRIVE_CHECKS[name](drives)


def test_drives_are_switched_off_and_closed_whatever_a_check_finds():
    world, closed = DriveWorld(), []
    kind = type("Broken", (GoodDrives,), {"taken": beyond, "close": lambda self: closed.append(True)})
    with pytest.raises(BrokenPromiseError):
        DRIVE_CHECKS["outside_limits"](world.bench(kind))
    assert (world.on, closed) == (False, [True])

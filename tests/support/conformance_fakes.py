"""Cameras and drives on a clock of their own, good ones; tests break one member after the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tcrctl.errors import DeviceError
from tcrctl.plant.rig.devices import CameraStatus, DeviceLimits, DriveStatus, Identity, Sighting
from tcrctl.signals import RawFrame
from tcrctl.testing import CameraBench, DriveBench

N, M = 6, 3


class Clock:
    """Time passes while somebody sleeps, and a little in every call."""

    def __init__(self):
        self.time = 50.0

    def __call__(self):
        self.time += 1e-6
        return self.time

    def sleep(self, seconds):
        self.time += seconds


class GoodCameras:
    """Frames at a rate, each 3 ms old when it arrives; ``world`` holds clock and faults."""

    identity = Identity("cameras", "cameras of a test", "1.0", {"version": "1.0"})
    rate = 100.0
    clock = ""
    age = 0.003

    def __init__(self, world):
        self.world, self.last, self.open, self.frozen = world, -1, True, None

    def number(self):
        """Of the newest frame that has arrived."""
        return int((self.world.clock() - self.age) * self.rate)

    def next(self, timeout, *, fresh):
        end = self.world.clock() + timeout
        k = self.number()
        if fresh or k <= self.last:
            k = max(k, self.last) + 1
        arrives = k / self.rate + self.age
        if self.world.silent or not self.open or arrives > end or self.repeated():
            self.world.clock.time = max(self.world.clock.time, end)
            return None
        self.world.clock.time = max(self.world.clock.time, arrives)
        self.last = k
        return self.frame(k)

    def repeated(self):
        """Whether a frozen stream has nothing new."""
        before, self.frozen = self.frozen, self.world.frozen
        return bool(before and self.frozen)

    def frame(self, k):
        valid = np.ones(N, np.bool_)
        valid[:2] = not self.world.hidden
        nodes = np.full((N, 3), 0.1, np.float32)
        none = np.zeros(0, np.int32)
        raw = RawFrame(k, 0, self.age, none, nodes[valid], none, names="a\nb")
        return Sighting(k / self.rate, nodes, valid, "2 occluded" if self.world.hidden else "", raw)

    def status(self):
        return CameraStatus(markers=N)

    def checks(self, seen):
        return ()

    def close(self):
        self.open = False


class CameraWorld:
    """Clock and faults of cameras."""

    def __init__(self):
        self.clock, self.silent, self.frozen, self.hidden = Clock(), False, False, False

    def bench(self, kind=GoodCameras, **changes):
        def hook(name):
            return lambda wrong: setattr(self, name, wrong)

        made = CameraBench(
            open=lambda: kind(self),
            size=N,
            latency=0.01,
            silence=hook("silent"),
            freeze=hook("frozen"),
            hide=hook("hidden"),
            clock=self.clock,
            sleep=self.clock.sleep,
        )
        return replace(made, **changes)


class DriveWorld:
    """Clock, faults, and the PLC with its motors, which go on between two connections."""

    low, high, speed, step, watchdog = -30_000.0, 30_000.0, 50_000.0, 3_000.0, 0.2

    def __init__(self):
        self.clock, self.silent, self.estop = Clock(), False, False
        self.position, self.target = np.zeros(M), np.zeros(M)
        self.on = self.tripped = False
        self.fed = self.moved = self.clock()

    def advance(self):
        """Let the motors run until now."""
        now = self.clock()
        for end in sorted((min(now, self.fed + self.watchdog), now)):
            if self.on and end > self.fed + self.watchdog:
                self.trip()
            if self.estop:
                self.on, self.tripped = False, True
            reach = self.speed * max(0.0, end - self.moved)
            if self.on:
                self.position += np.clip(self.target - self.position, -reach, reach)
            self.moved = max(self.moved, end)

    def trip(self):
        """End as the watchdog ends."""
        self.on, self.tripped = False, True

    def bench(self, kind=None, **changes):
        def hook(name):
            return lambda wrong: setattr(self, name, wrong)

        made = DriveBench(
            open=lambda: (kind or GoodDrives)(self),
            cables=M,
            stop=0.5,
            emulated=True,
            silence=hook("silent"),
            estop=hook("estop"),
            clock=self.clock,
            sleep=self.clock.sleep,
        )
        return replace(made, **changes)


class GoodDrives:
    """The connection to a :class:`DriveWorld`."""

    identity = Identity("drives", "drives of a test", "1.0")
    took = 0.002
    reject = ""

    def __init__(self, world):
        self.world, self.was_zero = world, False
        self.limits = DeviceLimits(np.full(M, world.low), np.full(M, world.high), world.speed, world.step)
        self.watchdog = world.watchdog

    def load(self, period):
        return self.took / period

    def status(self):
        self.call()
        return self.told()

    def exchange(self, target, control):
        self.call()
        world = self.world
        world.fed = world.clock()
        self.edges(control)
        world.on = control.enable and control.permit and not world.tripped and not world.estop
        if not (world.on and control.follow):
            world.target = world.position.copy()
        elif self.taken(target):
            world.target = target.astype(float)
        return self.told()

    def edges(self, control):
        if control.zero and not self.was_zero:
            self.world.position[:] = 0.0
        self.was_zero = control.zero
        if control.reset and not self.world.estop:
            self.world.tripped = False

    def taken(self, target):
        world = self.world
        inside = (target <= world.high).all() and (target >= world.low).all()
        near = (abs(target - world.target) <= world.step).all()
        self.reject = "" if inside and near else "out of limits" if near else "step"
        return inside and near

    def call(self):
        self.world.clock.sleep(self.took)
        self.world.advance()
        if self.world.silent:
            self.world.clock.sleep(0.06)
            raise DeviceError("no answer")

    def told(self):
        world = self.world
        return DriveStatus(
            np.round(world.position).astype(np.int64),
            enabled=bool(world.on),
            zeroed=True,
            estop=world.estop,
            watchdog=world.tripped,
            reject=self.reject,
            round_trip=self.took,
        )

    def checks(self):
        return ()

    def close(self):
        pass

"""Parts of a control loop that do what a test tells them, and a clock that only they move."""

from __future__ import annotations

import numpy as np

from tcrctl.signals import Command, ControlInfo, Estimate, Measurement, Truth

CABLES = 3
PERIOD = 0.05


class Clock:
    """Time passes only while somebody sleeps, or when a test says so."""

    def __init__(self):
        self.time = 100.0
        self.naps = []

    def __call__(self):
        return self.time

    def sleep(self, duration):
        assert duration > 0.0
        self.naps.append(duration)
        self.time += duration


class StraightLine:
    """A trajectory along x at 10 mm/s."""

    duration = 1.0

    def position(self, t):
        return np.stack([0.01 * t, 0.0 * t, 0.0 * t - 0.5], axis=1)

    def normal(self, t):
        return None


class FakePlant:
    """A plant that takes time, and fails in a step if asked to."""

    def __init__(self, clock=None, *, seconds=0.0, slow_steps=(), fails_at=None, error=None):
        self.clock, self.seconds, self.slow_steps = clock, seconds, slow_steps
        self.fails_at, self.error = fails_at, error
        self.written, self.calls, self.closed = [], [], 0

    def read(self):
        self.calls.append("read")
        return Measurement(
            len(self.written) * PERIOD, np.zeros((3, 3), np.float32), np.ones(3, bool), np.full(CABLES, 0.25)
        )

    def write(self, command):
        self.calls.append("write")
        if len(self.written) == self.fails_at:
            raise self.error
        if self.clock is not None:
            slow = len(self.written) in self.slow_steps
            self.clock.time += 3.5 * PERIOD if slow else self.seconds
        self.written.append(command)
        return Command(0.5 * command.speed, command.drive)  # a plant may send less than was wanted

    def truth(self):
        self.calls.append("truth")
        return Truth(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.ones(CABLES), np.zeros(12))

    def close(self):
        self.closed += 1


class FakeEstimator:
    """Sees the robot exactly where it is wanted, unless told otherwise for a step."""

    def __init__(self, *, tension=None, offset=None, failing=()):
        self.tension, self.offset, self.failing = tension or {}, offset or {}, failing
        self.applied = []

    def update(self, measured, applied):
        k = len(self.applied)
        self.applied.append(applied)
        position = np.array([0.01 * k * PERIOD + self.offset.get(k, 0.0), 0.0, -0.5])
        return Estimate(
            measured.t,
            np.zeros(12),
            np.zeros(12),
            measured.drive,
            np.full(CABLES, self.tension.get(k, 5.0)),
            position,
            np.array([0.0, 0.0, 1.0]),
            np.zeros(12),
            k not in self.failing,
        )


class FakeController:
    """Wants a speed that tells the step, unless told to fail."""

    ahead = np.array([0.1, 0.2])

    def __init__(self, *, failing=(), speeds=None):
        self.failing, self.speeds = failing, speeds or {}
        self.references = []

    def control(self, estimate, reference):
        k = len(self.references)
        self.references.append(reference)
        speed = np.full(CABLES, self.speeds.get(k, 1e-3 * k))
        info = ControlInfo(
            k not in self.failing,
            3,
            1e-9,
            1e-12,
            5,
            np.zeros(CABLES, bool),
            np.full(CABLES, 5.0),
            np.zeros(3),
            "no solution found" if k in self.failing else "",
        )
        return Command(speed, estimate.drive + PERIOD * speed), info

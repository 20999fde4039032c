"""A bench without wires: cameras and drives that do what a test tells them, on a clock that only they move."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from support.loop_fakes import Clock
from tcrctl.errors import DeviceError
from tcrctl.plant.rig.devices import DriveControl, DriveStatus, Sighting
from tcrctl.plant.rig.health import Rules
from tcrctl.plant.rig.operation import Operation
from tcrctl.plant.rig.plant import RigLimits, RigPlant
from tcrctl.plant.rig.set_points import AntagonistGroup, DriveEnvelope
from tcrctl.signals import RawFrame

M, N = 3, 6
PERIOD = 0.05
STEP, LOW, HIGH = 3000, -10_000, 40_000
RULES = Rules(stale=0.05, stale_stop=0.2, silence=0.1, rejects=3, following=5000, standstill=1.0)
NO_FRAME = RawFrame(0, 0, 0.0, np.zeros(0, np.int32), np.zeros((0, 3), np.float32), np.zeros(0, np.int32))


def envelope(**changes):
    made = DriveEnvelope(
        names=("c1", "c2", "c3"),
        low=np.full(M, LOW),
        high=np.full(M, HIGH),
        change=np.full(M, STEP),
        speed=np.full(M, 50_000.0),
        acceleration=np.full(M, np.inf),
        groups=(AntagonistGroup((0, 1, 2), -15_000, 60_000),),
    )
    return replace(made, **changes)


@dataclass
class FakeCameras:
    """Frames at a rate, each 3 ms old when it arrives."""

    clock: Clock
    rate: float = 250.0
    seen: int = N
    silent: bool = False
    doubts: str = ""
    closed: int = 0
    last: float = -1.0
    error: DeviceError | None = None

    def next(self, timeout, *, fresh):
        if self.error is not None:
            raise self.error
        if self.silent:
            self.clock.time += timeout
            return None
        self.clock.time += 1.0 / self.rate
        valid = np.arange(N) < self.seen
        return Sighting(self.clock.time - 0.003, np.ones((N, 3), np.float32), valid, self.doubts, NO_FRAME)

    def close(self):
        self.closed += 1


@dataclass
class FakeDrives:
    """Drives that are where they are told to be one exchange later, and a PLC with its answers."""

    clock: Clock
    status_now: DriveStatus = field(
        default_factory=lambda: DriveStatus(np.zeros(M, np.int64), zeroed=True, enabled=False)
    )
    sent: list = field(default_factory=list)
    closed: int = 0
    error: DeviceError | None = None
    error_takes: float = 0.06
    follows: bool = True
    enables: bool = True

    def status(self):
        self._fail()
        return self.status_now

    def exchange(self, target, control):
        self.sent.append((self.clock.time, np.array(target), control))
        self._fail()
        on = self.enables and control.enable and control.permit and not self.status_now.fault
        position = np.array(target) if self.follows and control.follow else self.status_now.position
        self.status_now = replace(self.status_now, enabled=on, position=position)
        return self.status_now

    def _fail(self):
        if self.error is not None:
            self.clock.time += self.error_takes
            raise self.error

    def close(self):
        self.closed += 1

    def say(self, **changes):
        self.status_now = replace(self.status_now, **changes)


class FakeRig:
    """A rig plant on fakes, its events, and a loop that paces itself on the fake clock."""

    def __init__(self, *, confirmed=True, limits=None, rules=RULES, seen_share=0.3):
        self.clock = Clock()
        self.cameras, self.drives = FakeCameras(self.clock), FakeDrives(self.clock)
        self.events = []
        operation = Operation(self.clock, lambda *event: self.events.append(event), confirmed)
        limits = RigLimits(limits or envelope(), rules, seen_share, N, N, arm_timeout=1.0)
        self.plant = RigPlant(
            self.cameras, self.drives, limits, PERIOD, operation, clock=self.clock, sleep=self.clock.sleep
        )

    @property
    def state(self):
        return str(self.plant.supervisor.state)

    @property
    def transitions(self):
        return [text for kind, _, text in self.events if kind == "supervisor"]

    def targets(self):
        """Every set-point that was to be followed (n, M) [um]."""
        return np.array([target for _, target, control in self.drives.sent if control.follow]).reshape(-1, M)

    def step(self, command):
        measured = self.plant.read()
        applied = self.plant.write(command)
        self.clock.time = max(self.clock.time, PERIOD * np.ceil(self.clock.time / PERIOD + 1e-9))
        return measured, applied

    def run(self, command, steps):
        return [self.step(command) for _ in range(steps)]


OFF = DriveControl()

"""The fault matrix: real sockets between the rig plant and both emulators; one fault, in one phase, one ending.

The robot behind the emulators stands still but for the noise of its markers: what counts here is what the drives
are told. Every set-point that reaches the PLC is kept and held against the limits.
"""

from __future__ import annotations

import dataclasses
import json
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tcr_hardware.emulators.motive import MotiveEmulator, MotiveFaults, MotiveSettings
from tcr_hardware.emulators.plc import PlcEmulator, PlcSettings
from tcr_hardware.emulators.plc_limits import PlcLimitSettings
from tcr_hardware.modbus.registers import Control
from tcrctl.errors import TcrctlError
from tcrctl.experiment.first_look import build_picture, check_picture, first_frames
from tcrctl.loop.pacing import RealTime
from tcrctl.picture.picture import Unjudged
from tcrctl.picture.settings import PictureSettings
from tcrctl.plant.rig.assembly import build_rig
from tcrctl.plant.rig.file import LoadedRig
from tcrctl.plant.rig.operation import Operation
from tcrctl.plant.rig.plant import RigPlant
from tcrctl.plant.rig.settings import RigFile
from tcrctl.robot.module import ring_rows
from tcrctl.signals import Command

PERIOD, SPEED = 0.02, 0.01
MAX_STEP_UM, LOW_UM, HIGH_UM = 500, -20_000, 20_000
BEFORE = 0.15
"""Time that a robot moves before a fault in phase ``moving`` or ``stopping`` [s]."""
WATCHED = 0.4
"""Time that a fault which shall do no harm is watched [s]."""
AFTER_END = 5.0

#: ``stop_s`` of the judged picture [s].
PICTURE_STOP = PictureSettings().stop_s

#: What real benches get; a busy test computer is given more time.
STRICT = {"stale_after_ms": 50, "stale_stop_ms": 200, "silence_stop_ms": 100}
PATIENT = {"stale_after_ms": 100, "stale_stop_ms": 400, "silence_stop_ms": 150}


@dataclass(frozen=True)
class Case:
    """One fault and its endings.

    Attributes:
        name: For the table.
        cameras: Attributes of ``MotiveFaults``; or the name of a method of the emulator, and its arguments.
        plc: Name of a PLC fault, and its arguments.
        connect, armed, moving, stopping: State in which the supervisor ends, by the phase in which the fault
            begins; empty where the phase is not tried.
        says: Part of the reason; empty if there is none.
        rule: What bounds the time to the end, see :func:`bound`; empty if nothing ends.
        exit_code: That of the error.
    """

    name: str
    cameras: Any = None
    plc: tuple[str, dict[str, float]] | None = None
    connect: str = ""
    armed: str = ""
    moving: str = ""
    stopping: str = ""
    says: str = ""
    rule: str = ""
    exit_code: int = 4

    def phases(self):
        return {p: getattr(self, p) for p in ("connect", "armed", "moving", "stopping") if getattr(self, p)}


def harmless(name, *, cameras=None, plc=None):
    return Case(name, cameras, plc, moving="running")


def blinding(name, **faults):
    return Case(
        name,
        faults,
        connect="disarmed",
        armed="disarmed",
        moving="disarmed",
        stopping="disarmed",
        says="usable measurement",
        rule="stale",
    )


def wrong_picture(name, **faults):
    """A picture that is wrong all at once; what of it jumps far is no measurement at all."""
    return Case(name, faults, connect="disarmed", armed="disarmed", moving="disarmed", rule="picture")


def drifting(name, what):
    """Something that comes loose is left out."""
    return harmless(name, cameras={"drifting": frozenset((what,)), "drift_mm_s": (20.0, 0.0, 0.0)})


def plc_lost(name, fault, says, **arguments):
    return Case(
        name,
        plc=(fault, arguments),
        connect="disarmed",
        armed="faulted",
        moving="faulted",
        stopping="faulted",
        says=says,
        rule="silence",
        exit_code=5,
    )


NAMES = [f"m{ring}.n{node}" for ring in range(1, 6) for node in (1, 2, 3)]
MARKERS = frozenset(NAMES)
RINGS = frozenset(f"m{ring}" for ring in range(1, 6))
FEW = frozenset(("m1.n1", "m3.n2", "m5.n3"))

CASES = [
    harmless("loss of 10 % of the frames", cameras={"loss": 0.1}),
    harmless("loss of 50 %", cameras={"loss": 0.5}),
    harmless("frames in wrong order", cameras={"reorder": 3}),
    harmless("every other frame twice", cameras={"duplicate": 0.5}),
    harmless("flipped bits in 20 %", cameras={"corrupt": 0.2}),
    harmless("20 % cut off", cameras={"truncate": 0.2}),
    harmless("20 % lie about their size", cameras={"wrong_size": 0.2}),
    harmless("three markers occluded", cameras={"occluded": FEW}),
    harmless("three markers not listed", cameras={"missing": FEW}),
    harmless("three markers are NaN", cameras={"nan": FEW}),
    harmless("two labels exchanged", cameras={"swap": (("m2.n1", "m2.n2"),)}),
    harmless("rigid bodies untracked", cameras={"untracked": True}),
    blinding("frozen frame", freeze=True),
    blinding("no frames", silent=True),
    blinding("all markers occluded", occluded=MARKERS),
    blinding("all markers not listed", missing=MARKERS),
    blinding("all markers are NaN", nan=MARKERS),
    blinding("no marker has a label", unlabelled=True),
    blinding("a second source of frames", second_source=1.0),
    harmless("models announced anew", cameras=("change_models", NAMES)),
    harmless("stream changes to NatNet 3.1", cameras=("change_version", "3.1")),
    Case("markers renamed", ("change_models", [f"{name}?" for name in NAMES]), moving="disarmed",
         says="usable measurement", rule="stale"),
    Case("Motive restarts", ("restart",), moving="disarmed", says="usable measurement", rule="stale"),
    Case("origin jumps by 100 mm", {"offset_m": (0.1, 0.0, 0.0)}, moving="disarmed",
         says="usable measurement", rule="stale"),
    wrong_picture("frame turned by 20 deg", turned_deg=(0.0, 0.0, 20.0)),
    wrong_picture("frame tilted by 10 deg", turned_deg=(10.0, 0.0, 0.0)),
    wrong_picture("frame mirrored", mirrored=(1, 0, 0)),
    wrong_picture("all labels of all rings turned", moved_labels=RINGS),
    Case("frame turns by 30 deg/s", {"turning_deg_s": (0.0, 0.0, 30.0)}, moving="disarmed", says="picture",
         rule="turning"),
    Case("rings 2 and 5 swapped", {"exchanged": (("m2", "m5"),)}, connect="disarmed", moving="running"),
    Case("labels of ring 3 turned", {"moved_labels": frozenset(("m3",))}, connect="disarmed", moving="running"),
    drifting("end ring drifts by 20 mm/s", "m5"),
    drifting("a marker drifts by 20 mm/s", "m3.n2"),
    Case("frames 0.5 s late", {"delay_s": 0.5}, moving="disarmed", says="usable measurement", rule="stale"),
    harmless("one exception answer", plc=("exception", {"code": 6, "count": 1})),
    harmless("one lost answer", plc=("silence", {"count": 1})),
    harmless("one cut answer", plc=("truncate", {"count": 1})),
    harmless("answers 10 ms late", plc=("delay", {"seconds": 0.01})),
    harmless("TCP reset", plc=("reset", {})),
    plc_lost("exception 1", "exception", "function", code=1),
    plc_lost("exception 2", "exception", "address", code=2),
    plc_lost("exception 4", "exception", "failure", code=4),
    plc_lost("silent PLC", "silence", "no answer"),
    plc_lost("answers 0.3 s late", "delay", "", seconds=0.3),
    plc_lost("cut answers", "truncate", ""),
    Case("wrong echo", plc=("wrong_echo", {}), moving="disarmed", rule="silence", exit_code=5),
    Case("PLC program hangs", plc=("freeze_program", {}), moving="faulted", says="not acknowledged", rule="frozen"),
    Case("SEQ_ACK stands still", plc=("freeze_ack", {}), moving="disarmed", says="not acknowledged", rule="frozen"),
    Case("heartbeat echo stands still", plc=("freeze_heartbeat", {}), moving="disarmed", rule="frozen",
         exit_code=5),
    Case("words exchanged", plc=("word_swap", {}), connect="disarmed", moving="faulted", says="", rule="silence",
         exit_code=5),
    Case("another device", plc=("wrong_magic", {}), connect="disarmed", exit_code=2),
    Case("another map", plc=("wrong_version", {}), connect="disarmed", exit_code=2),
    Case("e-stop", plc=("estop", {}), connect="disarmed", armed="faulted", moving="faulted", stopping="faulted",
         says="emergency stop", rule="now"),
    Case("drives fail", plc=("drive", {}), connect="disarmed", armed="faulted", moving="faulted",
         stopping="faulted", says="fault", rule="now"),
    Case("a drive is jammed", plc=("jam", {"axis": 2}), moving="disarmed", says="set-point", rule="following"),
    Case("PLC power cycle", plc=("restart", {}), armed="faulted", moving="faulted", rule="silence"),
    Case("PLC power cycle, registers survive", plc=("restart", {"keep": 1}), armed="faulted", moving="faulted",
         rule="silence"),
    Case("an encoder fails", plc=("encoder", {"axis": 2}), connect="disarmed", armed="faulted", moving="faulted",
         stopping="faulted", says="fault", rule="now"),
]  # fmt: skip


@dataclass
class Outcome:
    """What happened.

    Attributes:
        state: State of the supervisor at the end.
        error: What ended the run.
        seconds: From the fault to the decision [s].
        events: Transitions.
        sent: Set-points that were to be followed, as they reached the PLC (n, axes) [um].
        rest_um: Largest motion of a drive in 0.1 s after the end [um].
    """

    state: str
    error: TcrctlError | None
    seconds: float
    events: list[str]
    sent: np.ndarray
    rest_um: float


@dataclass
class WatchedEmulators:
    """Both emulators, and everything that reaches the PLC."""

    robot: Any
    rules: dict[str, Any]
    watchdog_ms: int = 200
    high_mm: float = HIGH_UM / 1e3
    motive_settings: MotiveSettings = field(
        default_factory=lambda: MotiveSettings(command_port=0, rate_hz=200.0)
    )
    timeout_ms: float = 60
    sent: list = field(default_factory=list)
    events: list = field(default_factory=list)

    def __post_init__(self):
        random, rest = np.random.default_rng(0), self.robot.rest.q.reshape(-1, 3)[ring_rows(5)]
        self.motive = MotiveEmulator(
            NAMES,
            lambda: rest + 5e-5 * random.standard_normal(rest.shape),
            self.motive_settings,
        )
        self.watch_drives()

    def watch_drives(self):
        limits = PlcLimitSettings(min_um=-25_000, max_um=25_000, watchdog_ms=self.watchdog_ms)
        self.plc = PlcEmulator(PlcSettings(limits=limits))
        write = self.plc.write

        def noted(address, words):
            if len(words) == 16 and Control.FOLLOW in Control(words[0]):
                pairs = np.array(words[2:14], dtype=np.uint32).reshape(-1, 2)
                self.sent.append((pairs[:, 0] << 16 | pairs[:, 1]).astype(np.uint32).view(np.int32))
            write(address, words)

        self.plc.write = noted

    def section(self):
        """Where the drives are, for the rig file."""
        return {
            "kind": "modbus_tcp",
            "host": self.plc.address[0],
            "port": self.plc.address[1],
            "timeout_ms": self.timeout_ms,
        }

    def __enter__(self):
        self.plc.start()
        self.motive.start()
        return self

    def __exit__(self, *error):
        self.motive.stop()
        self.plc.stop()

    def loaded(self):
        cables = {f"c{i}": {"axis": i, "min_mm": -20, "max_mm": self.high_mm} for i in range(1, 5)}
        rig = RigFile.model_validate_json(
            json.dumps(
                {
                    "name": "matrix",
                    "cameras": {
                        "kind": "natnet",
                        "transport": "unicast",
                        "command_port": self.motive.address[1],
                    },
                    "robots": {
                        "tcr5x4": {
                            "plc": self.section(),
                            "cables": cables,
                            "markers": {"labels": "m{ring}.n{node}"},
                        }
                    },
                    "safety": {
                        "max_step_mm": MAX_STEP_UM / 1e3,
                        "following_mm": 2.0,
                        "standstill_s": 0.4,
                        "arm_timeout_s": 0.5,
                        **self.rules,
                    },
                }
            )
        )
        return LoadedRig(rig, "tcr5x4", None, b"")

    def plant(self) -> RigPlant:
        operation = Operation(time.monotonic, lambda *event: self.events.append(event), confirmed=True)
        return build_rig(self.loaded(), self.robot, PERIOD, operation)

    def picture(self, plant: RigPlant):
        """Judge the picture as a run does before the drives are armed; returns who judges it in motion."""
        settings, frames = PictureSettings(), first_frames(plant)
        check_picture(settings, self.robot, frames)
        report = lambda *event: self.events.append(event)  # noqa: E731
        return build_picture(settings, self.robot, PERIOD, frames, report)

    def fail(self, case: Case):
        if isinstance(case.cameras, tuple):
            method, *given = case.cameras
            getattr(self.motive, method)(*given)
        elif case.cameras is not None:
            for name, value in case.cameras.items():
                setattr(self.motive.faults, name, value)
        if case.plc is not None:
            self.plc.faults.set(case.plc[0], **case.plc[1])

    def heal(self):
        for attribute in dataclasses.fields(MotiveFaults):
            setattr(self.motive.faults, attribute.name, getattr(MotiveFaults(), attribute.name))
        self.plc.faults.clear(None)


class Loop:
    """Drives at a constant speed in real time, until an error or the time is up."""

    def __init__(self, plant, picture=None):
        self.plant, self.picture = plant, picture or Unjudged()
        self.pace, self.k = RealTime(PERIOD), 0

    def run(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.pace.wait(self.k * PERIOD)
            self.picture.judged(self.plant.read(), self.pace.elapsed())
            if broken := self.picture.broken(self.k):
                raise broken
            speed = 0.0 if self.picture.doubt else SPEED * (1 if self.k % 100 < 50 else -1)
            self.plant.write(Command(np.full(4, speed), np.zeros(4)))
            self.k += 1


def play(
    case: Case,
    phase: str,
    robot: Any,
    rules: dict[str, Any],
    watchdog_ms: int = 200,
    bench: Any = WatchedEmulators,
) -> Outcome:
    """Let a fault happen in a phase."""
    with bench(robot, rules, watchdog_ms) as emulators:
        if phase == "connect":
            emulators.fail(case)
        plant, error, begun = None, None, time.monotonic()
        decided = begun
        try:
            plant = emulators.plant()
            picture = emulators.picture(plant)
            plant.start()
            loop = Loop(plant, picture)
            if phase in ("moving", "stopping"):
                loop.run(BEFORE)
            begun = decided = time.monotonic()
            if phase != "connect":
                emulators.fail(case)
            if phase != "stopping":
                harmless_case = case.phases()[phase] == "running"
                loop.run(WATCHED if harmless_case else AFTER_END)
        except TcrctlError as failure:
            error, decided = failure, time.monotonic()
        state = "disarmed" if plant is None else str(plant.supervisor.state)
        if plant is not None:
            error, state = _closed(plant, error, "" if phase == "stopping" else state)
        moved = _moves(emulators.plc)
        return Outcome(
            state,
            error,
            decided - begun,
            [text for kind, _, text in emulators.events if kind == "supervisor"],
            np.array(emulators.sent).reshape(-1, 6 if bench is WatchedEmulators else 4),
            moved,
        )


def _closed(plant, error, state):
    """Close the plant; the state it ends in, or that in which it was if nothing had ended it."""
    went_on = error is None and state in ("running", "holding")
    try:
        plant.close()
    except TcrctlError as failure:
        error = error or failure
    end = str(plant.supervisor.state)
    return error, state if went_on and end == "disarmed" else end


def _moves(plc: PlcEmulator) -> float:
    time.sleep(0.05)
    before = np.array(plc.positions_um())
    time.sleep(0.05)
    return float(np.abs(np.array(plc.positions_um()) - before).max())


def all_cells() -> list[tuple[Case, str]]:
    """Every fault in every phase in which it is tried."""
    return [(case, phase) for case in CASES for phase in case.phases()]


#: Faults that the test suite tries in every phase; the others only while the robot moves.
THOROUGH = (
    "no frames",
    "silent PLC",
    "words exchanged",
    "another device",
    "another map",
    "e-stop",
    "drives fail",
)


#: Faults for which the test suite has no time: each has a near relative in it.
LEFT_OUT = ("exception 1", "exception 2", "all markers occluded", "all markers not listed", "cut answers")


def suite_cells() -> list[tuple[Case, str]]:
    """Faults that end a run, as far as the test suite has time for them."""
    return [
        (case, phase)
        for case, phase in all_cells()
        if case.moving != "running"
        and case.name not in LEFT_OUT
        and (phase == "moving" or case.name in THOROUGH)
    ]


def bound(case: Case, phase: str, rules: dict[str, Any], timeout_ms: float = 60.0) -> float:
    """Longest time from the fault to the decision to stop [s], on a computer that is not late."""
    cycle = 3 * PERIOD
    if phase == "connect":
        return 2.5 * rules["stale_stop_ms"] / 1e3 + 1.0
    return {
        "": np.inf,
        "now": cycle,
        "stale": rules["stale_stop_ms"] / 1e3 + cycle,
        "silence": max(rules["silence_stop_ms"], 2 * timeout_ms) / 1e3 + cycle,
        "frozen": 0.2 + cycle,
        "picture": max(rules["stale_stop_ms"] / 1e3, PICTURE_STOP) + 2 * cycle,
        "turning": 15.0 / 30.0 + PICTURE_STOP + 2 * cycle,
        "following": 2e-3 / SPEED + 0.1 + cycle,
    }[case.rule]


def violations(outcome: Outcome) -> list[str]:
    """What the set-points that reached the PLC have done that they must never do."""
    found, used = [], outcome.sent[:, :4]
    if used.size and not ((used >= LOW_UM) & (used <= HIGH_UM)).all():
        found.append(f"set-points from {used.min()} to {used.max()} um")
    step = int(np.abs(np.diff(used, axis=0)).max(initial=0))
    if step > MAX_STEP_UM:
        found.append(f"a step of {step} um")
    if outcome.rest_um > 200.0 and outcome.state not in ("running", "holding"):
        found.append(f"a drive still moves by {outcome.rest_um:.0f} um in 50 ms")
    return found

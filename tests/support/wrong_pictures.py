"""Runs on the emulated bench whose cameras show a wrong picture, and what the robot really does meanwhile.

The emulated bench runs in a process of its own, which writes down where the end of the robot is. Both processes
read the same clock.
"""

from __future__ import annotations

import multiprocessing
import re
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from support.loopback import free_ports
from tcrctl.config import shipped
from tcrctl.emulate.bench import EmulatedBench, emulate
from tcrctl.emulate.fault_script import FaultScript
from tcrctl.emulate.settings import EmulationSettings
from tcrctl.experiment.run import run_experiment
from tcrctl.log.reader import read_log
from tcrctl.plant.rig.file import read_rig
from tcrctl.robot.module import module_of

ROBOT = "tcr600"
#: A computer that runs bench and controller is late now and then; that is not what is tried here.
PATIENT = "safety: {stale_after_ms: 300, stale_stop_ms: 1200, silence_stop_ms: 1000, following_mm: 20}"
PIVOT = f"{ROBOT}_base"
#: Seconds of motion before a fault in mid-run.
BEFORE_S = 6.0


@dataclass(frozen=True)
class Row:
    """One wrong picture, and what may come of it.

    Attributes:
        name: For the table.
        cameras: Faults of the cameras.
        at_start: Before the run, or in the middle of it.
        refused: The drives must not be armed.
        end_mm: Largest true distance of the end from its path when the run ends [mm].
        drift_mm_s: Speed of what drifts [mm/s].
        noticed_mm: What may have drifted when it is noticed [mm].
    """

    name: str
    cameras: dict[str, Any]
    at_start: bool = False
    refused: bool = False
    end_mm: float = np.inf
    drift_mm_s: float = 0.0
    noticed_mm: float = np.inf

    @property
    def allowed(self) -> str:
        """What may come of it."""
        if self.refused:
            return "refused"
        noticed = f", noticed by {self.noticed_mm:g} mm" if np.isfinite(self.noticed_mm) else ""
        return (f"at most {self.end_mm:g} mm" if np.isfinite(self.end_mm) else "left out") + noticed

    def wrong(self, outcome: Outcome) -> list[str]:
        """What must not be."""
        found = []
        if self.refused != (outcome.ends == "refused"):
            found.append("must be refused" if self.refused else "must not be refused")
        if outcome.error_mm > self.end_mm:
            found.append(f"more than {self.end_mm:g} mm")
        if self.drift_mm_s and not outcome.noticed_mm <= self.noticed_mm:
            found.append("noticed too late")
        return found


def _drift(name: str, what: str, *way: float, noticed_mm: float = 3.0) -> Row:
    speed = float(np.linalg.norm(way))
    faults = {"drifting": [f"{ROBOT}_{what}"], "drift_mm_s": list(way)}
    return Row(name, faults, end_mm=6.0, drift_mm_s=speed, noticed_mm=noticed_mm)


def _ring(number: int) -> str:
    return f"{ROBOT}_m{number}"


#: Axes are those of the cameras, y up.
ROWS = [
    Row("as it is", {}, end_mm=6.0),
    Row("calibration 20 deg off", {"turned_deg": [0, 20, 0], "pivot": PIVOT}, at_start=True, refused=True),
    Row("calibration 90 deg off", {"turned_deg": [0, 90, 0], "pivot": PIVOT}, at_start=True, refused=True),
    Row(
        "calibration tilted by 20 deg",
        {"turned_deg": [20, 0, 0], "pivot": PIVOT},
        at_start=True,
        refused=True,
    ),
    Row("calibration 12 deg off", {"turned_deg": [0, 12, 0], "pivot": PIVOT}, at_start=True, refused=True),
    Row("mirrored", {"mirrored": [1, 0, 0], "pivot": PIVOT}, at_start=True, refused=True),
    Row("rings 4 and 7 swapped", {"exchanged": [[_ring(4), _ring(7)]]}, at_start=True, refused=True),
    Row("rings 10 and 11 swapped", {"exchanged": [[_ring(10), _ring(11)]]}, at_start=True, refused=True),
    Row("labels of ring 5 turned", {"moved_labels": [_ring(5)]}, at_start=True, refused=True),
    Row("labels of the end ring turned", {"moved_labels": [_ring(11)]}, at_start=True, refused=True),
    Row("calibration 20 deg off, in mid-run", {"turned_deg": [0, 20, 0], "pivot": PIVOT}, end_mm=10.0),
    Row("calibration 90 deg off, in mid-run", {"turned_deg": [0, 90, 0], "pivot": PIVOT}, end_mm=10.0),
    Row("calibration tilted by 20 deg, in mid-run", {"turned_deg": [20, 0, 0], "pivot": PIVOT}, end_mm=10.0),
    Row("calibration turns by 2 deg/s", {"turning_deg_s": [0, 2, 0], "pivot": PIVOT}, end_mm=20.0),
    Row("calibration tilts by 1 deg/s", {"turning_deg_s": [1, 0, 0], "pivot": PIVOT}, end_mm=30.0),
    Row("mirrored, in mid-run", {"mirrored": [1, 0, 0], "pivot": PIVOT}, end_mm=10.0),
    Row("rings 4 and 7 swapped, in mid-run", {"exchanged": [[_ring(4), _ring(7)]]}, end_mm=3.0),
    Row("rings 10 and 11 swapped, in mid-run", {"exchanged": [[_ring(10), _ring(11)]]}, end_mm=3.0),
    Row("labels of ring 5 turned, in mid-run", {"moved_labels": [_ring(5)]}, end_mm=3.0),
    _drift("end ring drifts sideways", "m11", 0.5, 0.0, 0.0),
    _drift("end ring drifts the other way", "m11", 0.0, 0.0, -0.5),
    _drift("end ring drifts up", "m11", 0.0, 0.5, 0.0, noticed_mm=6.0),
    _drift("ring 6 drifts sideways", "m6", 0.0, 0.0, 0.5),
    _drift("marker 6.2 drifts", "m6.n2", 0.5, 0.0, 0.0),
    _drift("marker 11.3 drifts", "m11.n3", 0.0, 0.0, 0.5),
]


@dataclass
class Outcome:
    """What came of it.

    Attributes:
        exit_code: That of the run.
        ends: ``refused``, ``stopped`` or ``success``.
        error_mm: True distance of the end from its path when the run ended [mm].
        largest_mm: Largest one since the fault [mm].
        noticed_mm: What had drifted when it was first said [mm]; infinite if it never was.
        noticed: How long after the fault that was, or what had drifted.
        said: What was said first of the picture, or why the run ended.
    """

    exit_code: int
    ends: str
    error_mm: float
    largest_mm: float
    noticed_mm: float
    noticed: str
    said: str


@dataclass
class Watched:
    """The times of a run: of its steps, and of what was said."""

    steps: list[float] = field(default_factory=list)
    said: list[tuple[float, str]] = field(default_factory=list)

    def progress(self, done: int, total: int) -> None:
        self.steps.append(time.time())

    def notify(self, text: str) -> None:
        self.said.append((time.time(), text))


def write_rig(path: Path) -> None:
    """Write the shipped loopback rig with one robot, on ports of its own."""
    text = shipped.rigs()["loopback"].read_text()
    text = re.sub(r"^safety:.*$", PATIENT, text, flags=re.MULTILINE)
    text = re.sub(r"^  tcr700:.*?(?=^#|^safety)", "", text, flags=re.MULTILINE | re.DOTALL)
    for old, new in zip(("15510", "15511", "15600"), free_ports(3), strict=True):
        text = text.replace(old, str(new))
    path.write_text(re.sub(r"(port: \d+)}", r"\1, timeout_ms: 400}", text))


def script(row: Row) -> FaultScript | None:
    """The fault script of a row."""
    if not row.cameras:
        return None
    when = {"at_s": 0.0} if row.at_start else {"at_s": BEFORE_S, "after": "moving"}
    return FaultScript.model_validate({"faults": ({**when, "cameras": row.cameras},)})


def serve(rig_path: str, faults: FaultScript | None, pipe: Any) -> None:
    """Emulate a bench until something comes through a pipe; then send the end's path and the time of the fault."""
    rig, *_ = read_rig(rig_path)
    bench = EmulatedBench(rig, EmulationSettings(watchdog_ms=1500))
    robot, path, begun = bench.robots[ROBOT], [], []
    tip, rings = 3 * module_of(robot.robot.tip), robot.rings

    def watched() -> Any:
        nodes = rings()
        path.append((time.time(), *nodes[tip : tip + 3].mean(axis=0)))
        return nodes

    robot.rings = watched  # type: ignore[method-assign]
    with bench:
        pipe.send("ready")
        emulate(bench, faults, pipe.poll, lambda text: begun.append(time.time()))
    pipe.send((np.array(path), begun[0] if begun else np.inf))


def play(row: Row, prepared: Any, rig: Path) -> Outcome:
    """Run an experiment on a bench with a wrong picture.

    Args:
        row: What is wrong.
        prepared: Returns the prepared experiment for ``--set`` arguments.
        rig: Where the rig file is written.
    """
    write_rig(rig)
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=serve, args=(str(rig), script(row), there), daemon=True)
    process.start()
    try:
        experiment = prepared(("plant.kind=rig", f"plant.rig={rig}"))
        assert here.recv() == "ready"
        time.sleep(0.2)
        watched = Watched()
        summary = run_experiment(
            experiment,
            out=rig.parent / "logs",
            confirmed=True,
            notify=watched.notify,
            progress=watched.progress,
        )
        here.send("end")
        path, begun = here.recv()
    finally:
        process.join(timeout=10.0)
        process.kill()
    return _outcome(row, summary, watched, path, begun)


def _outcome(row: Row, summary: Any, watched: Watched, path: Any, begun: float) -> Outcome:
    steps = list(read_log(summary.log).steps())
    refused = not steps and "not armed" in summary.reason
    wanted = np.array([step.reference.position for step in steps]).reshape(-1, 3)
    times = np.array(watched.steps[: len(wanted)])
    truly = np.stack([np.interp(times, path[:, 0], path[:, 1 + i]) for i in range(3)], axis=-1).reshape(-1, 3)
    error = 1e3 * np.linalg.norm(truly - wanted, axis=1)
    rest = 1e3 * float(np.linalg.norm(path[-1, 1:] - (wanted[-1] if steps else path[0, 1:])))
    first = [(at, text) for at, text in watched.said if at > begun and "not believed" in text][:1]
    after = first[0][0] - begun if first else np.inf
    drifted = f"{row.drift_mm_s * after:.1f} mm" if row.drift_mm_s else f"{1e3 * after:.0f} ms"
    return Outcome(
        summary.exit_code,
        "refused" if refused else "success" if summary.status == "success" else "stopped",
        rest,
        float(error[times > begun].max(initial=0.0)),
        row.drift_mm_s * after,
        drifted if first else "-",
        first[0][1] if first else summary.reason or "-",
    )

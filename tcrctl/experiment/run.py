"""Composition root: a prepared experiment is run and recorded, and leaves a folder with log and summary.

LoadedSpec -> prepare -> plan -> run_experiment: folder, log, parts -> loop -> summary -> stop record
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from tcrctl.errors import DeviceError, InputError, LogError, StoppedError, TcrctlError
from tcrctl.experiment.first_look import check_picture, first_frames
from tcrctl.experiment.metrics import Metrics
from tcrctl.experiment.outcome import summary_of
from tcrctl.experiment.prepare import Experiment, Notify, build_parts, build_plant, make_task, silent
from tcrctl.experiment.provenance import attachments, own_files, start_metadata, versions
from tcrctl.experiment.run_folder import (
    LOG,
    SUMMARY,
    RunFolder,
    check_writable,
    make_run_folder,
)
from tcrctl.experiment.summary import Summary
from tcrctl.log.geometry import CableHoles, LogGeometry
from tcrctl.log.mcap_file import Opening, Tap
from tcrctl.log.writer import Flushing, LogWriter
from tcrctl.loop.interruption import Interruption
from tcrctl.loop.loop import Parts, run_loop
from tcrctl.loop.pacing import Pace, RealTime, Unpaced
from tcrctl.loop.quiet import quiet_interpreter
from tcrctl.loop.telling import unfailing
from tcrctl.plant.plant import RunnablePlant
from tcrctl.plant.rig.journal import Journal
from tcrctl.plant.rig.operation import Operation
from tcrctl.robot.module import RIGID_BARS, module_of, ring_rows
from tcrctl.robot.robot import Robot
from tcrctl.signals import Measurement, StepRecord
from tcrctl.task.settings import TaskSettings
from tcrctl.task.task import task_drawing
from tcrctl.trajectory.start_blend import StartBlend
from tcrctl.trajectory.trajectory import Trajectory

#: Points of the drawn path of the reference: as far apart in time as this [s], but no more than these.
PATH_SPACING_S: Final = 0.1
MOST_PATH_POINTS: Final = 1000

Progress = Callable[[int, int], None]
Check = Callable[[], None]


def _no_progress(done: int, total: int) -> None:
    """Show nothing."""


def no_check() -> None:
    """Find nothing."""


def run_experiment(
    experiment: Experiment,
    *,
    out: Path,
    realtime: bool = False,
    confirmed: bool = False,
    notify: Notify = silent,
    progress: Progress = _no_progress,
    tap: Tap | None = None,
    check: Check = no_check,
) -> Summary:
    """Run an experiment and record it.

    However the run ends, the plant is left safe, the log is finished and the signals are given back.

    Args:
        experiment: What :func:`tcrctl.experiment.prepare.prepare` made.
        out: Where the run's folder is made.
        realtime: Pace a simulated plant by the clock; a rig is always paced.
        confirmed: The operator has agreed that the rig moves; without it a rig is measured, not armed.
        notify: Takes messages for the user; that it fails changes nothing.
        progress: Takes the number of steps done and their total, after every step; as ``notify``.
        tap: Takes every message of the log, in the log's thread; see :class:`tcrctl.view.live.LiveView`.
        check: Called before every step; what it raises ends the run.

    Returns:
        The result; also of a run that was stopped by a limit, a signal or a device.

    Raises:
        DeviceError: If the run cannot be recorded or the plant not be reached; no folder is left behind.
    """
    check_writable(out)
    notify, progress = unfailing(notify), unfailing(progress)
    realtime = realtime or experiment.paced
    with Interruption() as interruption:

        def checked() -> None:
            interruption.check()
            check()

        pace = RealTime(experiment.period, checked) if realtime else Unpaced(checked)
        journal = Journal(pace.moment, notify)
        plant, state = build_plant(experiment, Operation(pace.time, journal.report, confirmed))
        try:
            frames = first_frames(plant)
            parts, start_offset = build_parts(experiment, plant, state, journal.report, frames)
            folder = make_run_folder(out, experiment.spec.name)
            log = _open_log(experiment, folder, realtime=realtime, tap=tap)
            journal.attach(log.event)
            started = parts.trajectory
            approach = started.approach if isinstance(started, StartBlend) else 0.0
            journal.report("start", *_start_message(start_offset, approach))
        except BaseException:
            plant.close()
            raise
        run = _Run(experiment, replace(parts, pace=pace), plant, frames)
        summary = _recorded_run(run, folder, log, progress)
    try:
        folder.write(SUMMARY, (json.dumps(summary.as_json(), indent=2) + "\n").encode())
    except DeviceError as error:  # the run is over and in the log
        notify(f"warning: {error}")
    return summary


def _open_log(experiment: Experiment, folder: RunFolder, *, realtime: bool, tap: Tap | None) -> LogWriter:
    """Write what is known before the first step; on failure the folder is as if it had never been."""
    spec, loaded = experiment.spec, experiment.loaded
    try:
        for name, content in own_files(loaded, spec).items():
            folder.write(name, content)
        return LogWriter(
            folder.path / LOG,
            Opening(
                attachments=attachments(loaded, spec),
                start=start_metadata(folder.run_id, loaded, spec, realtime=realtime),
                geometry=log_geometry(experiment.robot, experiment.trajectory, spec.task),
                epoch_ns=time.time_ns(),
                period_s=experiment.period,
                full_state_s=spec.full_state_s,
            ),
            Flushing(spec.log.flush_s, spec.log.flush_steps, spec.log.fsync),
            wait_when_full=not realtime,
            tap=tap,
        )
    except BaseException:
        folder.discard()
        raise


def log_geometry(
    robot: Robot, trajectory: Trajectory | None = None, task: TaskSettings | None = None
) -> LogGeometry:
    """Return the names and the topology that the log needs to draw a robot, the path of its end, and its task."""
    model, routes = robot.model, []
    for c, name in enumerate(robot.cable_names):
        holes = slice(model.first_hole[c], model.first_hole[c + 1])
        routes.append(CableHoles(name, model.hole_nodes[holes], model.hole_weights[holes]))
    duration = 0.0 if trajectory is None else trajectory.duration
    points = np.linspace(0.0, duration, min(MOST_PATH_POINTS, 2 + int(duration / PATH_SPACING_S)))
    return LogGeometry(
        robot.n_modules,
        tuple(routes),
        tuple(ring_rows(robot.n_modules)),
        module_of(robot.tip),
        springs=model.bar_nodes[RIGID_BARS * robot.n_modules :],
        reference_path=np.zeros((0, 3)) if trajectory is None else trajectory.position(points),
        drawing=task_drawing(task),
    )


@dataclass(frozen=True, slots=True)
class _Run:
    """What is run.

    Attributes:
        experiment: The experiment.
        parts: The loop.
        plant: Is started and closed.
        frames: Measurements of the plant at rest.
    """

    experiment: Experiment
    parts: Parts
    plant: RunnablePlant
    frames: Sequence[Measurement]


def _recorded_run(run: _Run, folder: RunFolder, log: LogWriter, progress: Progress) -> Summary:
    """Run, close the plant, finish the log."""
    experiment, parts = run.experiment, run.parts
    metrics = Metrics(parts.steps, paced=isinstance(parts.pace, RealTime))
    task = make_task(experiment)

    def record(step: StepRecord) -> None:
        log.step(step)
        metrics.add(step)
        for event in () if task is None else task.observe(step):
            log.event(event.t, event.kind, event.level, event.message)
        progress(step.k + 1, parts.steps)

    with log:
        failure = _drive(replace(run, parts=replace(parts, record=record)), log)
        summary = summary_of(
            experiment,
            folder.run_id,
            metrics,
            {} if task is None else task.result(),
            failure,
            folder.path / LOG,
        )
        summary = replace(summary, versions=versions())
        try:
            if failure is not None:
                kind = "limit" if isinstance(failure, StoppedError) else "stop"
                log.event(parts.pace.moment(), kind, "error", str(failure))
            stop = {"status": summary.status, "reason": summary.reason}
            log.finish({**stop, "summary": json.dumps(summary.as_json())})
        except LogError as error:
            if failure is None:
                summary = replace(summary, status="error", reason=str(error), exit_code=error.exit_code)
    return summary


def _drive(run: _Run, log: LogWriter) -> TcrctlError | None:
    """Go through all steps and leave the plant safe; return why it ended before the end, if it did."""
    failure: TcrctlError | None = None
    experiment, plant, started = run.experiment, run.plant, False
    try:
        with _pace_kept(experiment, run.parts.pace, log):
            if experiment.paced:
                check_picture(experiment.spec.safety.picture, experiment.robot, run.frames)
            plant.start()
            started = True
            run_loop(run.parts)
    except TcrctlError as error:
        failure = _in_mid_run(error) if started else error
        _note_stall(run.parts, log)
    finally:
        run.parts.pace.end()
        try:
            plant.close()
        except TcrctlError as error:  # what ended the run first is the reason
            failure = failure or error
    return failure


def _note_stall(parts: Parts, log: LogWriter) -> None:
    """Say how long the step has kept the run in which it ended: of all steps it alone is not recorded."""
    behind = parts.pace.behind()
    if behind > parts.period:
        with suppress(LogError):  # a log that cannot be written to is told elsewhere
            text = f"the run ended {behind:.3f} s after its last step was due"
            log.event(parts.pace.moment(), "late", "warning", text)


def _in_mid_run(error: TcrctlError) -> TcrctlError:
    """Return an error of the input, which was right when the run began, as one of whatever has changed since."""
    return DeviceError(str(error), hint=error.hint) if isinstance(error, InputError) else error


def _pace_kept(experiment: Experiment, pace: Pace, log: LogWriter) -> AbstractContextManager[None]:
    """Keep the interpreter quiet in runs that the clock paces."""
    if not isinstance(pace, RealTime):
        return nullcontext()
    rig = experiment.loaded.rig
    priority = None if rig is None else rig.rig.fifo_priority
    return quiet_interpreter(priority, lambda text: log.event(0.0, "start", "warning", text))


def _start_message(offset: float, approach: float) -> tuple[str, str]:
    """Return level and text of what is known about the start: offset [m], and time [s] that the way there takes."""
    if math.isnan(offset):
        return (
            "warning",
            "the tip ring is not measured: the run begins at the trajectory's start, not the robot's",
        )
    beside = f"the robot starts {1e3 * offset:.3f} mm beside the trajectory"
    return ("warning", f"{beside} and first goes there, {approach:.1f} s") if approach else ("info", beside)

"""Replay of one log; see :mod:`tcrctl.replay`."""

from __future__ import annotations

import itertools
import json
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from tcrctl.controller.controller import Controller, build_controller
from tcrctl.errors import StoppedError
from tcrctl.estimator.estimator import build_estimator
from tcrctl.experiment.plugged import origins
from tcrctl.experiment.prepare import Experiment, believed_drives, make_trajectory
from tcrctl.log.checksums import checksums
from tcrctl.log.comparison import Comparison, quantities
from tcrctl.log.reader import Log, read_log
from tcrctl.loop.loop import Parts, tick
from tcrctl.loop.safety import NO_LIMITS, SafetyGuard
from tcrctl.plant.recorded import Limits, Recorded, RecordingEndedError
from tcrctl.plant.settings import PlantSettings, SimulatedSettings
from tcrctl.plant.stroke import within_stroke
from tcrctl.replay.environment import Change, changes, plugin_changes
from tcrctl.replay.rebuild import Origin, rebuild
from tcrctl.replay.recorded_picture import RecordedPicture
from tcrctl.replay.replayed_log import open_replayed
from tcrctl.replay.result import ALL_STEPS, EXACT, Replay, Tolerance, Window, what_if
from tcrctl.robot.robot import Robot, build_robot
from tcrctl.signals import StepRecord
from tcrctl.trajectory.start_blend import StartBlend
from tcrctl.trajectory.trajectory import Trajectory

Progress = Callable[[int, int | None], None]
Announce = Callable[[Sequence[Change]], None]
Record = Callable[[StepRecord], None]
Watch = Callable[[StepRecord, StepRecord], None]

#: What a plant of each kind makes of a command, where it depends on nothing but where its drives shall be.
LIMITS: Final[Mapping[str, Callable[[Robot, float], Limits]]] = {
    "simulated": lambda robot, period: (
        lambda command, set_point: within_stroke(command, set_point, period, robot.stroke)
    ),
}
#: Parts of a step that are fed to the replay, or measured with a clock.
GIVEN: Final = ("k", "measurement.", "truth.", "timing.")


def _quiet(done: int, total: int | None) -> None:
    """Show nothing."""


def _silent(found: Sequence[Change]) -> None:
    """Say nothing."""


def replay(  # noqa: PLR0913  # options of one verb, all but the first by name
    path: str | os.PathLike[str],
    *,
    overrides: Sequence[str] = (),
    window: Window = ALL_STEPS,
    tolerance: Tolerance = EXACT,
    out: Path | None = None,
    plugins: Path | None = None,
    watch: Watch | None = None,
    announce: Announce = _silent,
    progress: Progress = _quiet,
) -> Replay:
    """Rebuild estimator and controller from a log, feed them what was recorded, and compare what they do.

    Args:
        path: The log, finished or not.
        overrides: Assignments ``a.b=c`` that change controller, estimator or safety limits.
        window: Steps that are compared.
        tolerance: By bytes if left out.
        out: Log to be written with what was replayed.
        plugins: Folder that holds the files of kinds from elsewhere; see :func:`tcrctl.replay.rebuild.rebuild`.
        watch: Takes every compared step, as recorded and as replayed.
        announce: Takes what differs from the recording machine, before the first step.
        progress: Takes the number of steps done, and their total if it is known.

    Raises:
        InputError: If the file is no log, or lacks something that the replay needs.
        LogError: If it is damaged inside, or ``out`` cannot be written.
    """
    log = read_log(path)
    origin = rebuild(log, overrides, plugins)
    environment = (*changes(log), *plugin_changes(log, origins(origin.recorded.spec)))
    announce(environment)
    work = _Replay(log, origin, window, tolerance, watch)
    begin = time.perf_counter()
    with ExitStack() as stack:
        writer = None if out is None else stack.enter_context(open_replayed(out, log, origin, work.robot))
        ended = work.run(None if writer is None else writer.step, progress)
        result = work.result(ended, environment, time.perf_counter() - begin, out)
        if writer is not None:
            found = {"status": "success", "reason": "", "replay": json.dumps(result.as_json())}
            writer.finish(found)
    return result


class _Replay:
    """One replay in progress."""

    def __init__(
        self, log: Log, origin: Origin, window: Window, tolerance: Tolerance, watch: Watch | None
    ) -> None:
        spec, self._watch = origin.wanted.spec, watch
        self._log = log
        self._origin = origin
        self._window = window
        self._kind, self._period = spec.plant.kind, float(spec.controller.period_s)
        self.robot = build_robot(origin.wanted.robot)
        reports = _reports_set_points(origin.recorded.spec.plant)
        limits = LIMITS[self._kind](self.robot, self._period) if self._kind in LIMITS else None
        unknown = () if limits is not None else ("applied.",)
        self._comparison = Comparison(quantities(*GIVEN, *unknown), tolerance.atol, tolerance.rtol)
        self._steps, first = _peeked(log.steps())
        self._plant = Recorded(self._steps, limits, reports_set_points=reports)
        self._controller = build_controller(spec.controller, self.robot)
        self._estimator = build_estimator(
            spec.estimator, self.robot, self._period, self._plant.state, believed_drives(spec)
        )
        self._trajectory = self._references(first)
        self._done = 0

    def _references(self, first: StepRecord | None) -> Trajectory:
        """Return recorded references; those of the trajectory itself if the controller looks at other instants."""
        recorded = self._origin.recorded.spec
        if first is None or self._origin.wanted is self._origin.recorded:
            return self._plant
        if _same_instants(build_controller(recorded.controller, self.robot), self._controller):
            return self._plant
        trajectory = make_trajectory(recorded, self.robot)
        normal = self.robot.rest_normal if first.reference.normal is None else first.reference.normal
        start, rest = recorded.start, recorded.controller.settling
        return StartBlend(
            trajectory,
            first.reference.position,
            normal,
            start.blend_s,
            start.approach,
            rest,
            first.reference.drive,
        )

    def run(self, record: Record | None, progress: Progress) -> RecordingEndedError | str:
        """Replay to the end of the window or of what there is; return why it ended."""
        parts = self._parts()
        total = _total(self._log, self._window)
        applied = None
        for k in itertools.count():
            try:
                step, broken = tick(parts, k, applied)
            except RecordingEndedError as error:
                return error
            except StoppedError as error:
                return "" if next(self._steps, None) is None else str(error)
            self._take(step, record)
            progress(self._done, total)
            if k == self._window.last:
                break
            if broken is not None:
                return "" if next(self._steps, None) is None else str(broken)
            applied = step.applied if self._plant.limited is None else self._plant.limited
        return ""

    def _parts(self) -> Parts:
        """Build the parts: recorded plant and references, estimator and controller; a changed one may fail."""
        experiment = Experiment(self._origin.wanted, self._origin.wanted.spec, self.robot, self._trajectory)
        limits = experiment.safety if self._origin.wanted is self._origin.recorded else NO_LIMITS
        return Parts(
            trajectory=self._trajectory,
            plant=self._plant,
            estimator=self._estimator,
            controller=self._controller,
            period=self._period,
            steps=0,  # as many as are recorded
            guard=SafetyGuard(limits),
            picture=RecordedPicture(self._plant),
        )

    def _take(self, step: StepRecord, record: Record | None) -> None:
        """Compare a replayed step with the recorded one, if it lies in the window."""
        recorded, limited = self._plant.step, self._plant.limited
        replayed = step if limited is None else replace(step, applied=limited)
        # of the recorded input, which may differ from what it was when it was logged
        fed = replace(replayed, measurement=recorded.measurement, reference=recorded.reference)
        replayed = replace(replayed, checksums=checksums(fed))
        self._done += 1
        if step.k in self._window:
            self._comparison.add(recorded, replayed)
            if self._watch is not None:
                self._watch(recorded, replayed)
            if record is not None:
                record(replayed)

    def result(
        self,
        ended: RecordingEndedError | str,
        environment: tuple[Change, ...],
        seconds: float,
        out: Path | None,
    ) -> Replay:
        """Return what was found, given why the replay ended."""
        found = self._comparison
        gap = isinstance(ended, RecordingEndedError) and ended.found is not None
        stopped = ended if isinstance(ended, str) else ""
        reason = ""
        if found.first is not None:
            changed = self._origin.wanted is not self._origin.recorded
            reason = what_if(found.deviations) if changed else str(found.first)
        elif stopped:
            reason = f"the replay was stopped, the recorded run went on: {stopped}"
        elif gap:
            reason = f"{ended}; what comes after a gap cannot be replayed"
        elif not self._log.complete and self._window.last is None:
            reason = "the log is unfinished: the end of the run is missing"
        elif not found.steps:
            reason = "no step was compared"
        status = (
            "different" if found.first is not None or stopped else "incomplete" if reason else "identical"
        )
        return Replay(
            log=self._log.path,
            status=status,
            reason=reason,
            steps=self._done,
            compared=found.steps,
            different=found.different,
            whole=not (gap or stopped) and found.steps > 0,
            first_difference=found.first,
            deviations=tuple(found.deviations.values()),
            environment=environment,
            not_compared=self._not_compared(),
            duration_s=self._done * self._period,
            seconds=seconds,
            out=out,
        )

    def _not_compared(self) -> tuple[str, ...]:
        if self._kind in LIMITS:
            return ()
        return (f"applied: the limits of plant.kind: {self._kind} are not known here",)


def _reports_set_points(plant: PlantSettings) -> bool:
    """Return whether the drives of a recorded plant were measured to be where they should be."""
    drives = plant.drives if isinstance(plant, SimulatedSettings) else None
    return drives is None or drives.reports == "set_point"


def _peeked(steps: Iterator[StepRecord]) -> tuple[Iterator[StepRecord], StepRecord | None]:
    first = next(steps, None)
    return (steps, None) if first is None else (itertools.chain([first], steps), first)


def _same_instants(one: Controller, other: Controller) -> bool:
    return np.array_equal(one.ahead, other.ahead)


def _total(log: Log, window: Window) -> int | None:
    """Return the number of steps to be replayed, if the log says how many it has."""
    written = (log.stop or {}).get("steps", "")
    if not written.isdecimal():
        return None
    return int(written) if window.last is None else min(int(written), window.last + 1)

"""Self-calibration of one log, from beginning to end."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import InputError
from tcrctl.identify.calibration.answer_of_drives import find_answer
from tcrctl.identify.calibration.body import Body
from tcrctl.identify.calibration.fit import Calibrator
from tcrctl.identify.calibration.rests import read_rests
from tcrctl.identify.calibration.result import CalibrationResult, Errors, end_markers
from tcrctl.identify.calibration.rubbing import NOTHING, find_friction
from tcrctl.identify.calibration.settings import SelfCalibrationSpec
from tcrctl.identify.calibration.unknowns import make_unknowns
from tcrctl.log.file_names import RESOLVED
from tcrctl.log.reader import Log, read_log
from tcrctl.log.run_files import RunFiles
from tcrctl.robot.robot import build_robot

Notify = Callable[[str], None]
Progress = Callable[[int, int | None], None]
#: Fewest rests from which anything can be found.
FEWEST: Final = 6
#: Without an excitation, one in so many rests is kept.
KEPT: Final = 6


@dataclass(frozen=True, slots=True)
class Calibrated:
    """A log with what was found in it.

    Attributes:
        log: The log.
        spec: How it was looked for.
        body: The robot that ran, and what is unknown of it.
        result: What was found.
    """

    log: Log
    spec: SelfCalibrationSpec
    body: Body
    result: CalibrationResult


def calibrate(
    path: Path,
    spec: SelfCalibrationSpec,
    notify: Notify = lambda text: None,
    progress: Progress = lambda done, most: None,
) -> Calibrated:
    """Find robot, cameras and drives of the log of an excitation.

    Args:
        path: The log.
        spec: What is assumed.
        notify: Takes messages for the user.
        progress: Takes how many steps are done, and how many there are at most.

    Raises:
        InputError: If it is no log with a robot, or has too few rests.
        LogError: If it is damaged.
        NoEquilibriumError: If the robot has no stable shape at a rest.
    """
    begin, log = time.perf_counter(), read_log(path)
    files = RunFiles(log)
    description = files.robot()
    body = Body(description, build_robot(description), make_unknowns(description, spec))
    every = read_rests(log, spec.rest)
    rests = every.only(every.shaken)
    if len(rests.t) < FEWEST:
        raise InputError(
            f"{path}: has {len(rests.t)} rests after a shake; at least {FEWEST} are needed",
            hint="Calibrate from the log of an excitation: tcrctl run excitation",
        )
    kept = _kept(len(rests.t), spec.held_out, files.data(RESOLVED))
    others = np.setdiff1d(np.arange(len(rests.t)), kept)
    notify(f"{len(rests.t)} rests, {len(kept)} of them held out; {len(body.unknowns)} unknowns")
    end, zero = end_markers(description.tip.ring), np.zeros(len(body.unknowns))
    most = spec.iterations
    first = Calibrator(body, rests.only(others), spec).fit(told=lambda k: progress(k, 2 * most))
    notify(f"without those held out: {first.iterations} steps, misfit {first.misfit:.2f}")
    whole = Calibrator(body, rests, spec)
    before, without = whole.residual(zero), Calibrator(body, rests.only(kept), spec).residual(first.x)
    for residual, who in ((before, "as described"), (without, "as found without those held out")):
        unstable = int(np.isnan(residual).all(axis=1).sum())
        if unstable:
            notify(
                f"no stable shape of the robot {who} at {unstable} of {len(residual)} rests: they do not count"
            )
    done = first.iterations
    fit = whole.fit(first.x, told=lambda k: progress(done + k, done + most))
    notify(f"with all: {fit.iterations} steps, misfit {fit.misfit:.2f}")
    rubbing = find_friction(log, every, body, fit.x, spec.rest) if spec.friction else NOTHING
    result = CalibrationResult(
        unknowns=body.unknowns,
        fit=fit,
        drives=find_answer(log),
        rubbing=rubbing,
        rests=len(rests.t),
        before=Errors.of(before, end),
        after=Errors.of(fit.residual, end),
        held_out_before=Errors.of(before[kept], end),
        held_out=Errors.of(without, end),
        seconds=time.perf_counter() - begin,
    )
    return Calibrated(log, spec, body, result)


def _kept(count: int, wanted: int | None, resolved: Any) -> NDArray[np.intp]:
    """Which rests are kept to judge the result: the last poses before the end, or one in six."""
    if wanted is None:
        trajectory = resolved.get("trajectory", {}) if isinstance(resolved, dict) else {}
        given = trajectory.get("held_out") if trajectory.get("kind") == "excitation" else None
        if not isinstance(given, int):
            return np.arange(KEPT // 2, count, KEPT)
        wanted = given
    return np.arange(max(1, count - 1 - wanted), count - 1)

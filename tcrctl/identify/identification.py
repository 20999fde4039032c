"""The identification itself: regression -> swarm -> least squares -> certainty, held-out errors -> result."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import RunInterruptedError
from tcrctl.executors.engine import Engine, physical_cores
from tcrctl.experiment.compilation import announced_compilation
from tcrctl.identify.best import Best
from tcrctl.identify.building import assumed_forces, build_regression, choose_frame
from tcrctl.identify.certainty import Certainty, certainty
from tcrctl.identify.coordinate_frame import CoordinateFrame
from tcrctl.identify.evaluation import Evaluator
from tcrctl.identify.held_out import held_out_errors
from tcrctl.identify.loading import LoadedIdentification
from tcrctl.identify.parameters import start_of, values, with_values
from tcrctl.identify.polish import Residuals, polish
from tcrctl.identify.regression import MM, Regression, distances
from tcrctl.identify.result import Group, Result, Stage
from tcrctl.identify.swarm import search
from tcrctl.loop.interruption import Interruption
from tcrctl.signals import Array

#: Change of assumed forces for their sensitivity, relative.
FORCE_STEP = 1e-3
#: Nearer to a bound than this part of the range, a parameter stands at it.
AT_BOUND = 1e-3

Notify = Callable[[str], None]
Progress = Callable[[str, int, float, int | None], None]


def silent(text: str) -> None:
    """Discard a message for the user."""


def no_progress(what: str, evaluations: int, best_mm: float, most: int | None) -> None:
    """Show nothing."""


@dataclass
class Work:
    """An identification under way.

    Attributes:
        loaded: What is to be done.
        regression: Data and model.
        start: Prediction of the robot as given (n, 3) [m].
        frame: Coordinate frame that fits it.
        evaluator: Evaluates the model.
        best: Best answer so far.
        stages: Methods done.
        doing: What is being done, for the progress display.
        most: Evaluations after which that will have ended at the latest; None if nobody knows.
    """

    loaded: LoadedIdentification
    regression: Regression
    start: Array
    frame: CoordinateFrame
    evaluator: Evaluator
    best: Best
    stages: list[Stage] = field(default_factory=list)
    doing: str = ""
    most: int | None = None

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which coordinates are measured (n, 3)."""
        return ~np.isnan(self.regression.measured)

    def errors(self, frame: CoordinateFrame, predicted: Array) -> Array:
        """Return the distances of all measured points [mm]."""
        return distances(frame, predicted, self.regression.measured)[self.used.any(axis=1)]


def identify(
    loaded: LoadedIdentification,
    *,
    engine: Engine | None = None,
    notify: Notify = silent,
    progress: Progress = no_progress,
) -> Result:
    """Find the parameters.

    A signal ends the search; the best answer until then is the result, with status ``aborted``.

    Args:
        loaded: What is to be done.
        engine: Where the model is evaluated; on the cores of this machine if None.
        notify: Takes messages for the user.
        progress: Takes what is being done, the number of evaluations and the best mean error [mm] so far, and the
            number at which that ends at the latest; None if nobody knows.

    Raises:
        InputError: If data, robot and parameters do not go together.
        NoEquilibriumError: If the robot as given has no stable shape.
        LogError: If a log is damaged.
    """
    begin = time.perf_counter()
    with announced_compilation(notify):
        regression, strung_by = build_regression(loaded)
        frame, predicted, remark = choose_frame(loaded, regression)
    best = Best.none(start_of(regression.parameters), frame)
    interruption = Interruption()
    evaluator = Evaluator(regression, engine or Engine(physical_cores()), interruption.check)
    work = Work(loaded, regression, predicted, frame, evaluator, best)
    evaluator.progress = lambda count: progress(work.doing, count, _shown(work), work.most)
    held_out = np.full(len(regression.group_names), np.nan)
    judged = None
    failure = None
    with interruption, evaluator:
        try:
            _search(work)
            work.doing, work.most = "certainty", None
            answer = np.concatenate([best.x, best.frame.unknowns])
            residuals = Residuals(evaluator, best.frame, work.used, Best.none(best.x, best.frame))
            judged = _judge(work, residuals, answer)
            work.doing = "held-out error"
            held_out = held_out_errors(evaluator, residuals, answer)
        except RunInterruptedError as error:
            failure = error
    remarks = [remark] * bool(remark) + list(_at_bounds(work))
    return _result(work, strung_by, held_out, judged, failure, tuple(remarks), time.perf_counter() - begin)


def _search(work: Work) -> None:
    """Run all methods one after the other, each from the answer of the one before."""
    spec = work.loaded.spec
    for method in spec.method.split("+"):
        work.doing = method
        begin, before = time.perf_counter(), work.evaluator.evaluations
        work.most = None
        if method == "pso":
            work.most = before + spec.pso.particles * spec.pso.iterations
            search(work.evaluator, work.frame, work.best.x, spec.pso, spec.seed, work.best)
        else:
            polish(work.evaluator, work.used, work.best)
        took = work.evaluator.evaluations - before
        work.stages.append(_stage(work, method, took, time.perf_counter() - begin))


def _stage(work: Work, method: str, evaluations: int, seconds: float) -> Stage:
    predicted = work.regression.predict(work.best.x)
    error = float(work.errors(work.best.frame, predicted).mean())
    found = values(work.regression.parameters, work.best.x)
    return Stage(method, found, error, evaluations, seconds)


def _shown(work: Work) -> float:
    """Return the mean error of the best answer so far [mm], for the progress display; in least squares an rms."""
    if work.doing == "pso":
        return work.best.cost
    count = max(1, int(work.used.any(axis=1).sum()))
    return float(np.sqrt(work.best.cost / count))


def _judge(work: Work, residuals: Residuals, answer: Array) -> Certainty:
    """Return the sensitivities at the answer, in the parameters' own units, and what they mean."""
    regression = work.regression
    best = work.best
    spec = work.loaded.spec
    residual, jacobian = residuals.value(answer), residuals.jacobian(answer)
    n = len(best.x)
    value = np.array(list(values(regression.parameters, best.x).values()))
    slope = np.array([p.slope(float(u)) for p, u in zip(regression.parameters, best.x, strict=True)])
    return certainty(
        regression.parameters,
        value,
        jacobian[:, :n] / slope,
        jacobian[:, n:],
        residual,
        spec.noise_mm,
        spec.tolerance_percent / 100.0,
        _assumed(work),
    )


def _assumed(work: Work) -> tuple[str, Array] | None:
    """Return the derivative by the scale of the forces that are assumed to be known; None without them."""
    regression, best = work.regression, work.best
    free = [p.path for p in regression.parameters]
    forces = assumed_forces(regression.robot, free, moving=bool(regression.recordings))
    if not forces:
        return None
    ends = []
    for factor in (1.0 - FORCE_STEP, 1.0 + FORCE_STEP):
        changed = with_values(regression.robot, {path: factor * value for path, value in forces.items()})
        predicted = Evaluator(
            replace(regression, robot=changed), Engine(jobs=1), work.evaluator.check
        ).predict(best.x)
        work.evaluator.count(1)
        if predicted is None:
            return None
        ends.append(MM * best.frame.place(predicted)[work.used])
    return ", ".join(forces), (ends[1] - ends[0]) / (2.0 * FORCE_STEP)


def _at_bounds(work: Work) -> list[str]:
    said = []
    for p, u in zip(work.regression.parameters, work.best.x, strict=True):
        if min(u, 1.0 - u) < AT_BOUND:
            bound, which = (p.low, "lower") if u < 0.5 else (p.high, "upper")
            said.append(f"{p.path} stands at its {which} bound, {bound:g}: the true value may lie beyond")
    return said


def _result(
    work: Work,
    strung_by: str,
    held_out: Array,
    judged: Certainty | None,
    failure: RunInterruptedError | None,
    remarks: tuple[str, ...],
    seconds: float,
) -> Result:
    regression = work.regression
    best = work.best
    spec = work.loaded.spec
    predicted = regression.predict(best.x)
    errors = [
        distances(f, p, regression.measured) for f, p in ((work.frame, work.start), (best.frame, predicted))
    ]
    seen = work.used.any(axis=1)
    groups = []
    for i, name in enumerate(regression.group_names):
        members = seen & (regression.group == i)
        before, after = (float(e[members].mean()) if members.any() else np.nan for e in errors)
        groups.append(Group(name, before, after, float(held_out[i])))
    return Result(
        spec=spec.name,
        robot=work.loaded.robot.name,
        base=regression.robot,
        new_robot=f"{work.loaded.robot.name}_identified",
        status="success" if failure is None else "aborted",
        reason="" if failure is None else str(failure),
        exit_code=0 if failure is None else failure.exit_code,
        method=spec.method,
        seed=spec.seed,
        strung_by=strung_by,
        parameters=regression.parameters,
        values=np.array(list(values(regression.parameters, best.x).values())),
        frame=best.frame,
        certainty=judged,
        groups=tuple(groups),
        mean_error_before_mm=float(errors[0][seen].mean()),
        mean_error_after_mm=float(errors[1][seen].mean()),
        stages=tuple(work.stages),
        remarks=remarks,
        evaluations=work.evaluator.evaluations,
        seconds=seconds,
        data_sha256=work.loaded.data_sha256,
    )

"""What a log contains: completeness, timing, outcome and provenance of a run."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcrctl.analysis.result import paced, run_result
from tcrctl.log.reader import Log, read_log
from tcrctl.log.run_files import RunFiles, json_map
from tcrctl.loop.measured_time import begun

_COLUMNS = ("k", "t", "period", "timing_lateness")


@dataclass(frozen=True, slots=True)
class Spread:
    """Median, 99th percentile and maximum of a duration [ms]."""

    p50: float
    p99: float
    max: float


@dataclass(frozen=True, slots=True)
class LogInfo:
    """Facts about a log. What cannot be told of a log without steps is None.

    Attributes:
        path: The file.
        size_bytes: Its size.
        bytes_per_step: Size divided by steps.
        complete: Stop record and index are there.
        recovered: The file was made by a lossy ``tcrctl recover``.
        status: ``success``, ``failed``, ``aborted``, ``error``, or ``unfinished`` without a stop record.
        reason: Why, or empty.
        steps: Steps that can be read.
        lost_steps: Step indices missing between 0 and the last one.
        paced: Whether the clock paced the run; the following times are then measured ones, else those of the steps.
        duration_s: Time from the first step to the end of the last one [s].
        rate_hz: Mean step rate [Hz].
        period_s: Median time between two steps [s].
        jitter_ms: Deviation of the time between two steps from the control period.
        overruns: Steps that began late by more than a period or took longer than one; 0 if not paced.
        lateness_ms: By how much.
        control_ms: Duration of estimator and controller, as in ``run --json``.
        unconverged_steps: Steps in which controller or estimator found no solution.
        events: Number of events by level.
        attachments: Names of the attached files.
        start: Metadata of the start: who, when, what ran.
        versions: Versions of packages, Python, processor.
        summary: Result of the run as in ``run --json``; empty if it was not recorded.
        result: The same, measured from the steps where the log does not say it.
    """

    path: str
    size_bytes: int
    bytes_per_step: float | None
    complete: bool
    recovered: bool
    status: str
    reason: str
    steps: int
    lost_steps: int
    paced: bool
    duration_s: float
    rate_hz: float | None
    period_s: float | None
    jitter_ms: Spread | None
    overruns: int
    lateness_ms: Spread | None
    control_ms: Spread | None
    unconverged_steps: int
    events: dict[str, int]
    attachments: list[str]
    start: dict[str, str]
    versions: dict[str, str]
    summary: dict[str, Any]
    result: dict[str, Any]

    @property
    def criteria(self) -> list[dict[str, Any]]:
        """Criteria of the run with value and verdict, as in ``run --json``; a stopped run has passed none."""
        found: list[dict[str, Any]] = self.result["criteria"]
        return found

    def as_json(self) -> dict[str, Any]:
        """Return one object for ``info --json``; keys are the attributes, and ``criteria``."""
        facts = {name: value for name, value in asdict(self).items() if name != "result"}
        return {**facts, "criteria": self.criteria}


def inspect(path: str | os.PathLike[str]) -> LogInfo:
    """Read a log and describe it.

    Args:
        path: The log, finished or not.

    Raises:
        InputError: If it is not a log of tcrctl.
        LogError: If it is damaged inside.
    """
    log = read_log(path)
    columns = log.columns(_COLUMNS)
    steps = len(columns["k"])
    size = log.path.stat().st_size
    stop = log.stop or {"status": "unfinished", "reason": "the log has no stop record"}
    return LogInfo(
        path=str(log.path),
        size_bytes=size,
        bytes_per_step=size / steps if steps else None,
        complete=log.complete,
        recovered=stop.get("recovered") == "true",
        status=stop.get("status", ""),
        reason=stop.get("reason", ""),
        steps=steps,
        **_timing(columns, paced=paced(log)),
        **_measures(log),
        events=dict(Counter(event.level for event in log.events())),
        attachments=list(log.attachments),
        start=log.start,
        versions=RunFiles(log).versions(),
        summary=json_map((log.stop or {}).get("summary", "{}")),
    )


def _timing(columns: dict[str, NDArray[Any]], *, paced: bool) -> dict[str, Any]:
    k, t, period = columns["k"], columns["t"], columns["period"]
    lateness = columns["timing_lateness"]
    if not len(k):
        empty = dict.fromkeys(("rate_hz", "period_s", "jitter_ms", "lateness_ms"))
        return {"lost_steps": 0, "paced": paced, **empty}
    at = begun(t, lateness, period) if paced else t
    neighbours = np.diff(k) == 1
    between = np.diff(at)[neighbours]
    span = float(at[-1] - at[0])
    return {
        "lost_steps": int(k.max()) + 1 - len(np.unique(k)),
        "paced": paced,
        "rate_hz": float(k[-1] - k[0]) / span if span > 0.0 else None,
        "period_s": float(np.median(between if paced and len(between) else period)),
        "jitter_ms": _spread(np.abs(between - period[:-1][neighbours])),
        "lateness_ms": _spread(lateness),
    }


def _measures(log: Log) -> dict[str, Any]:
    """Return what the result of the run says too, with the same numbers."""
    result = run_result(log)
    control = result.get("control_ms")
    known = isinstance(control, dict) and all(
        isinstance(control.get(n), float) for n in ("p50", "p99", "max")
    )
    return {
        "result": result,
        "duration_s": float(result.get("duration_s") or 0.0),
        "overruns": int(result.get("overruns") or 0),
        "unconverged_steps": int(result.get("unconverged_steps") or 0),
        "control_ms": Spread(**{n: control[n] for n in ("p50", "p99", "max")}) if control and known else None,
    }


def _spread(seconds: NDArray[np.float64]) -> Spread | None:
    known = seconds[np.isfinite(seconds)]
    if not len(known):
        return None
    median, high, most = (1e3 * np.quantile(known, [0.5, 0.99, 1.0])).tolist()
    return Spread(median, high, most)

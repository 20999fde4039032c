"""Result of a run as its log says; measured again from its steps if the log has not all of them, or no end.

Everything that shows numbers of a run takes them from here: ``info``, reports, and with the same functions figures.
"""

from __future__ import annotations

import dataclasses
from typing import Any, Final

import numpy as np

from tcrctl.experiment.judgement import STOPPED
from tcrctl.experiment.metrics import Metrics
from tcrctl.experiment.summary import UNITS
from tcrctl.log.file_names import RESOLVED
from tcrctl.log.reader import Log
from tcrctl.log.run_files import RunFiles, json_map
from tcrctl.loop.measured_time import beyond

_BUSY: Final = ("timing_read", "timing_estimate", "timing_control", "timing_write")


def run_result(log: Log) -> dict[str, Any]:
    """Return the object of ``run --json``; of an unfinished run its measures, status and reason only.

    Measures of a log that lacks steps are those of the steps that it has: a recovered one says what it holds.

    Args:
        log: The log.

    Raises:
        LogError: If the log is damaged inside.
    """
    result = _by_the_clock(_with_relations(_result(log), log), log)
    if result["status"] in STOPPED:  # also where an older version said that they had been passed
        result["criteria"] = [{**item, "passed": False} for item in result["criteria"]]
    return result


def paced(log: Log) -> bool:
    """Tell whether the clock paced the run."""
    return log.start.get("realtime") == "true"


def _by_the_clock(result: dict[str, Any], log: Log) -> dict[str, Any]:
    """Take the duration of a paced run from its steps: older versions left out what was missed."""
    columns = log.columns(("t", "period", *_BUSY, "timing_lateness")) if paced(log) else {}
    if not columns or not len(columns["t"]):
        return result
    t, period = columns["t"], columns["period"]
    busy = np.sum([columns[name] for name in _BUSY], axis=0)
    more = beyond(columns["timing_lateness"], busy, period)
    return {**result, "duration_s": float(t[-1] - t[0] + period[-1]) + more}


def _result(log: Log) -> dict[str, Any]:
    stop = log.stop or {"status": "unfinished", "reason": "the log has no stop record"}
    found = _of_known_types(json_map(stop.get("summary", "")))
    if "steps" in found and stop.get("recovered") != "true":
        return found
    steps = list(log.steps())
    late = any(
        step.timing.lateness > 0.0 for step in steps
    )  # logs of others need not say that a clock paced them
    metrics = Metrics(len(steps), paced=late or paced(log))
    for step in steps:
        metrics.add(step)
    head = {"status": stop.get("status", "unfinished"), "reason": stop.get("reason", "")}
    asked = {"criteria": found["criteria"], "task": found.get("task") or {}}
    return {**found, **head, **dataclasses.asdict(metrics.measures()), **asked}


def _with_relations(result: dict[str, Any], log: Log) -> dict[str, Any]:
    """Take from the experiment how values and limits are compared, where an older result does not say."""
    asked = RunFiles(log).data(RESOLVED)
    texts = asked.get("criteria") if isinstance(asked, dict) else None
    known = {}
    for text in texts if isinstance(texts, list) else ():
        name, _, rest = str(text).partition(" ")
        known[name] = rest.partition(" ")[0]
    told = [{**item, **_relation(item, known)} for item in result["criteria"]]
    return {**result, "criteria": told}


def _relation(item: dict[str, Any], known: dict[str, str]) -> dict[str, str]:
    relation = item.get("relation") or known.get(str(item.get("name")))
    return {"relation": str(relation)} if relation else {}


def _of_known_types(found: dict[str, Any]) -> dict[str, Any]:
    """Return what of a recorded summary is what the name says; others may have written the log."""
    measures = {name.partition(".")[0] for name in UNITS}
    criteria = found.get("criteria")
    kept = {name: value for name, value in found.items() if name not in measures or _is_measure(value)}
    return {
        **kept,
        "status": str(found.get("status", "")),
        "reason": str(found.get("reason", "")),
        "criteria": [c for c in criteria if isinstance(c, dict)] if isinstance(criteria, list) else [],
    }


def _is_measure(value: Any) -> bool:
    if isinstance(value, dict):
        return all(_is_measure(part) for part in value.values() if part is not None)
    return isinstance(value, int | float)

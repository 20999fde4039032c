"""Result of a run as its log says; measured again from its steps if the log has not all of them, or no end.

Everything that shows numbers of a run takes them from here: ``info``, reports, and with the same functions figures.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from tcrctl.experiment.metrics import Metrics
from tcrctl.experiment.summary import UNITS
from tcrctl.log.file_names import RESOLVED
from tcrctl.log.reader import Log
from tcrctl.log.run_files import RunFiles, json_map


def run_result(log: Log) -> dict[str, Any]:
    """Return the object of ``run --json``; of an unfinished run its measures, status and reason only.

    Measures of a log that lacks steps are those of the steps that it has: a recovered one says what it holds.

    Args:
        log: The log.

    Raises:
        LogError: If the log is damaged inside.
    """
    return _with_relations(_result(log), log)


def _result(log: Log) -> dict[str, Any]:
    stop = log.stop or {"status": "unfinished", "reason": "the log has no stop record"}
    found = _of_known_types(json_map(stop.get("summary", "")))
    if "steps" in found and stop.get("recovered") != "true":
        return found
    steps = list(log.steps())
    metrics = Metrics(len(steps), paced=any(step.timing.lateness > 0.0 for step in steps))
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

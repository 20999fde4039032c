"""Result of a run: as its log says, or worked out from its steps if the run did not come to its end."""

from __future__ import annotations

import dataclasses
from typing import Any

from tcrctl.experiment.metrics import Metrics
from tcrctl.experiment.summary import UNITS
from tcrctl.log.reader import Log
from tcrctl.log.run_files import json_map


def run_summary(log: Log) -> dict[str, Any]:
    """Return the object of ``run --json``; of an unfinished run its measures, status and reason only.

    Args:
        log: The log.

    Raises:
        LogError: If the log is damaged inside.
    """
    stop = log.stop or {"status": "unfinished", "reason": "the log has no stop record"}
    found = json_map(stop.get("summary", ""))
    if "steps" in found:
        return _of_known_types(found)
    steps = list(log.steps())
    metrics = Metrics(len(steps), paced=log.start.get("realtime") == "true")
    for step in steps:
        metrics.add(step)
    head = {"status": stop.get("status", "unfinished"), "reason": stop.get("reason", "")}
    return {**head, **dataclasses.asdict(metrics.measures()), "criteria": [], "task": {}}


def _of_known_types(found: dict[str, Any]) -> dict[str, Any]:
    """Return what of a recorded summary is what the name says; others may have written the log."""
    measures = {name.partition(".")[0] for name in UNITS}
    criteria = found.get("criteria")
    if found.get("status") in ("aborted", "error") and isinstance(criteria, list):
        criteria = [{**item, "passed": False} for item in criteria if isinstance(item, dict)]
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

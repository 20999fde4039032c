"""Result of a run: as its log says, or worked out from its steps if the run did not come to its end."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

from tcrctl.experiment.metrics import Metrics
from tcrctl.log.reader import Log


def run_summary(log: Log) -> dict[str, Any]:
    """Return the object of ``run --json``; of an unfinished run its measures, status and reason only.

    Args:
        log: The log.

    Raises:
        LogError: If the log is damaged inside.
    """
    stop = log.stop or {"status": "unfinished", "reason": "the log has no stop record"}
    try:
        found = json.loads(stop.get("summary", ""))
    except ValueError:
        found = None
    if isinstance(found, dict) and "steps" in found:
        return found
    steps = list(log.steps())
    metrics = Metrics(len(steps), paced=log.start.get("realtime") == "true")
    for step in steps:
        metrics.add(step)
    head = {"status": stop.get("status", "unfinished"), "reason": stop.get("reason", "")}
    return {**head, **dataclasses.asdict(metrics.measures()), "criteria": [], "task": {}}

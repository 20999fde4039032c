"""The log of a replay: recorded input, replayed output."""

from __future__ import annotations

import json
from pathlib import Path

from tcrctl.experiment.provenance import resolved_text, versions
from tcrctl.experiment.run import log_geometry
from tcrctl.log.file_names import RESOLVED, VERSIONS
from tcrctl.log.mcap_file import Opening
from tcrctl.log.reader import Log
from tcrctl.log.writer import Flushing, LogWriter
from tcrctl.replay.rebuild import Origin
from tcrctl.robot.robot import Robot


def open_replayed(out: Path, log: Log, origin: Origin, robot: Robot) -> LogWriter:
    """Open a log for the replayed steps of another one.

    It has the attachments of the other log, with the settings and versions of the replay, and says in its start
    record what it was replayed from.

    Args:
        out: File to create; it must not exist.
        log: The recorded log.
        origin: What it was recorded with, and what is replayed.
        robot: Names and topology of what is drawn.

    Raises:
        LogError: If it cannot be created.
    """
    spec = origin.wanted.spec
    start = {
        **log.start,
        "replayed_from": str(log.path),
        "replayed_with": " ".join(origin.wanted.overrides),
    }
    own = {
        RESOLVED: ("application/yaml", resolved_text(spec)),
        VERSIONS: ("application/json", json.dumps(versions(), indent=2).encode()),
    }
    opening = Opening(
        attachments={**log.attachments, **own},
        start=start,
        geometry=log_geometry(robot),
        epoch_ns=log.epoch_ns,
        period_s=spec.controller.period_s,
        full_state_s=spec.full_state_s,
    )
    return LogWriter(out, opening, Flushing(spec.log.flush_s, spec.log.flush_steps), wait_when_full=True)

"""Logs for tests: made by the writer, judged by an independent checker."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
import time

from support import records
from tcrctl.log.mcap_file import Opening
from tcrctl.log.reader import read_log
from tcrctl.log.writer import Flushing, LogWriter

STOP = {"status": "success", "summary": json.dumps({"criteria": []})}

N_STEPS = 60


def open_log(path, **options):
    """A log of the records here; options are fields of the opening or the flushing, or the writer's own."""
    defaults = {
        "attachments": records.ATTACHMENTS,
        "start": records.START,
        "geometry": records.geometry(),
        "epoch_ns": records.EPOCH_NS,
        "period_s": records.PERIOD_S,
    }
    of_opening = {field.name for field in dataclasses.fields(Opening)}
    of_flushing = {field.name for field in dataclasses.fields(Flushing)}
    given = defaults | options
    return LogWriter(
        path,
        Opening(**{name: value for name, value in given.items() if name in of_opening}),
        Flushing(**{name: value for name, value in given.items() if name in of_flushing}),
        **{name: value for name, value in given.items() if name not in of_opening | of_flushing},
    )


def write_steps(path, **options):
    with open_log(path, flush_s=60.0, **options) as log:
        for k in range(N_STEPS):
            log.step(records.record(k))
        log.finish(STOP)


def is_prefix(path, expected):
    """Steps of a log, after checking that they are the first ones, each equal bit for bit."""
    found = [records.fingerprint(step) for step in read_log(path).steps()]
    assert found == expected[: len(found)]
    return len(found)


def doctor(path):
    """Findings of an independent checker of the MCAP specification."""
    command = [sys.executable, "-m", "pymcap_cli.cli", "doctor", "--format", "jsonl", str(path)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def wait_until(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()

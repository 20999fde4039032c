"""Short versions of a shipped experiment, run in this process or in one of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tcrctl.experiment.spec import load_spec

ROOT = Path(__file__).parents[1]
SHORT = (
    "trajectory.strokes=[{line: [[-4, 0], [4, 0]]}]",
    "trajectory.plane.offset_mm=[0, 0, 6]",
    "trajectory.lead_in_s=0.2",
    "trajectory.dwell_s=0",
    "trajectory.settle_s=0.2",
)


def short_spec(*overrides):
    return load_spec("letter_t", (*SHORT, *overrides))


def arguments(*overrides):
    return [part for assignment in (*SHORT, *overrides) for part in ("--set", assignment)]


def start(*options, cwd):
    """Start ``tcrctl run letter_t`` in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, "-m", "tcrctl.cli.app", "run", "letter_t", *options],
        cwd=cwd,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )

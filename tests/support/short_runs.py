"""Short versions of a shipped experiment, run in this process or in one of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tcrctl.experiment.spec import load_spec

ROOT = Path(__file__).parents[2]
SHORT = (
    "trajectory.strokes=[{line: [[-4, 0], [4, 0]]}]",
    "trajectory.plane.offset_mm=[0, 0, 6]",
    "trajectory.lead_in_s=0.2",
    "trajectory.dwell_s=0",
    "trajectory.settle_s=0.2",
    "controller.settle_s=0",
    "controller.period_s=0.05",
)
#: A pipe below the rest pose: the end is at its target almost from the start.
BELOW = (
    "task.pipes=[{name: low, entry_markers_mm: [[0, 20, -693], [17.32, -10, -693], [-17.32, -10, -693]], "
    "exit_markers_mm: [[0, 20, -893], [17.32, -10, -893], [-17.32, -10, -893]], bore_mm: 16}]",
    "trajectory.points=[{target: low, dwell_s: 0.5}]",
    "trajectory.ramp_s=0.3",
    "trajectory.lead_in_s=0",
    "trajectory.settle_s=0",
    "start.blend_s=0.2",
    "criteria=[task.targets.0.beam_passes == true, task.targets.0.position_error_mm <= 1.0]",
)


def short_spec(*overrides):
    return load_spec("letter_t", (*SHORT, *overrides))


def arguments(*overrides):
    return [part for assignment in (*SHORT, *overrides) for part in ("--set", assignment)]


def start(*options, cwd):
    """Start ``tcrctl run letter_t`` in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT / 'hardware'}"}
    return subprocess.Popen(
        [sys.executable, "-m", "tcrctl.cli.app", "run", "letter_t", *options],
        cwd=cwd,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )

"""What a run on the emulated bench makes of wrong pictures of the cameras, and how far off its path the robot is.

    python benchmarks/wrong_pictures.py                # about ten minutes
    python benchmarks/wrong_pictures.py drift swapped  # only rows whose name contains one of these

Cameras, PLC and robot run in a process of their own, in real time; what the robot really does is taken from there.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("NUMBA_OPT", "1")
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from support.wrong_pictures import ROWS, play
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.spec import load_spec

HEAD = "| picture | allowed | exit | ends | true error at the end | largest | noticed after | what was said first |"


def main(wanted: list[str]) -> int:
    """Print the table; return how many rows are not as they must be."""
    bad = 0
    print(HEAD + "\n|" + "---|" * HEAD.count(" | ") + "---|")
    with tempfile.TemporaryDirectory() as folder:
        rig = Path(folder) / "rig.yaml"
        for row in ROWS:
            if wanted and not any(part in row.name for part in wanted):
                continue
            outcome = play(row, lambda path: prepare(load_spec("letter_t", path)), rig)
            wrong = row.wrong(outcome)
            bad += bool(wrong)
            mark = f" **{'; '.join(wrong)}**" if wrong else ""
            print(
                f"| {row.name} | {row.allowed} | {outcome.exit_code} | {outcome.ends}{mark} "
                f"| {outcome.error_mm:.1f} mm | {outcome.largest_mm:.1f} mm | {outcome.noticed} "
                f"| {outcome.said[:100]} |",
                flush=True,
            )
    print(f"\n{bad} not as they must be")
    return bad


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]) > 0)

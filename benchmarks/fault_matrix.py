"""The fault matrix of the bench as a table: every fault in every phase, through real sockets, with strict times.

python benchmarks/fault_matrix.py            # about two minutes
python benchmarks/fault_matrix.py e-stop     # only faults whose name contains this

First the cameras and a PLC, then Dynamixel motors in its place.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("NUMBA_OPT", "1")
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from support.fault_matrix import STRICT, Case, Outcome, WatchedEmulators, all_cells, bound, play, violations
from support.motor_matrix import CASES as MOTORS
from support.motor_matrix import WatchedMotors
from tcrctl.robot.description import load_robot
from tcrctl.robot.robot import build_robot


def main(wanted: list[str]) -> int:
    """Print the tables; return how many cells are not as they must be."""
    robot, bad = build_robot(load_robot("tcr5x4")), 0
    for title, cells, bench in (
        ("cameras and PLC", all_cells(), WatchedEmulators),
        ("Dynamixel motors", [(case, phase) for case in MOTORS for phase in case.phases()], WatchedMotors),
    ):
        print(f"\n{title}\n\n| fault | phase | ends | after | allowed | largest step | why |")
        print("|---|---|---|---|---|---|---|")
        for case, phase in cells:
            if not wanted or any(part in case.name for part in wanted):
                bad += not row(case, phase, play(case, phase, robot, STRICT, bench=bench))
    print(f"\n{bad} not as they must be")
    return bad


def row(case: Case, phase: str, outcome: Outcome) -> bool:
    """Print what came of a fault; whether it is as it must be."""
    wrong, limit = violations(outcome), bound(case, phase, STRICT)
    if outcome.state != case.phases()[phase]:
        wrong.append(f"must end {case.phases()[phase]}")
    if outcome.error is not None and outcome.seconds > limit:
        wrong.append("too late")
    step = max((abs(b - a).max() for a, b in zip(outcome.sent, outcome.sent[1:], strict=False)), default=0)
    after = f"{1e3 * outcome.seconds:.0f} ms" if outcome.error is not None else "-"
    allowed = "-" if limit == float("inf") else f"{1e3 * limit:.0f} ms"
    why = f"exit code {outcome.error.exit_code}: {outcome.error}" if outcome.error is not None else "-"
    mark = f" **{'; '.join(wrong)}**" if wrong else ""
    print(
        f"| {case.name} | {phase} | {outcome.state}{mark} | {after} | {allowed} "
        f"| {step / 1e3:.2f} mm | {why[:90]} |",
        flush=True,
    )
    return not wrong


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]) > 0)

"""The fault matrix of the bench as a table: every fault in every phase, through real sockets, with strict times.

python benchmarks/fault_matrix.py            # about a minute and a half
python benchmarks/fault_matrix.py e-stop     # only faults whose name contains this
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("NUMBA_OPT", "1")
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from support.fault_matrix import STRICT, all_cells, bound, play, violations
from tcrctl.robot.description import load_robot
from tcrctl.robot.robot import build_robot


def main(wanted: list[str]) -> int:
    """Print the table; return how many cells are not as they must be."""
    robot, bad = build_robot(load_robot("tcr5x4")), 0
    print("| fault | phase | ends | after | allowed | largest step | why |")
    print("|---|---|---|---|---|---|---|")
    for case, phase in all_cells():
        if wanted and not any(part in case.name for part in wanted):
            continue
        outcome, limit = play(case, phase, robot, STRICT), bound(case, phase, STRICT)
        wrong = violations(outcome)
        if outcome.state != case.phases()[phase]:
            wrong.append(f"must end {case.phases()[phase]}")
        if outcome.error is not None and outcome.seconds > limit:
            wrong.append("too late")
        bad += bool(wrong)
        step = max(
            (abs(b - a).max() for a, b in zip(outcome.sent, outcome.sent[1:], strict=False)), default=0
        )
        after = f"{1e3 * outcome.seconds:.0f} ms" if outcome.error is not None else "-"
        allowed = "-" if limit == float("inf") else f"{1e3 * limit:.0f} ms"
        why = f"exit code {outcome.error.exit_code}: {outcome.error}" if outcome.error is not None else "-"
        mark = f" **{'; '.join(wrong)}**" if wrong else ""
        print(
            f"| {case.name} | {phase} | {outcome.state}{mark} | {after} | {allowed} "
            f"| {step / 1e3:.2f} mm | {why[:90]} |",
            flush=True,
        )
    print(f"\n{bad} not as they must be")
    return bad


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]) > 0)

"""Single bytes and bits of a log are changed: who notices, and what recovery saves.

    python benchmarks/log_mutations.py LOG [COUNT]

COUNT bytes and as many bits, half of them outside chunks (250). A change that is read
without a word would be "accepted".
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from support.log_mutants import accepted, mutants
from tcrctl.errors import TcrctlError
from tcrctl.log.reader import read_log
from tcrctl.log.recover import recover


def outcome(path, steps):
    """Return what is said about a changed log, and the steps that recovery saves."""
    said = "accepted"
    if accepted(path) is None:
        try:
            said = "incomplete" if not read_log(path).complete else "found in a chunk"
            list(read_log(path).steps())
        except TcrctlError as error:
            said = f"exit {error.exit_code}"
    try:
        with tempfile.TemporaryDirectory() as folder:
            saved = recover(path, Path(folder) / "mended.mcap")
            kept = "all" if saved.steps == steps else "some"
            return said, f"{'lossy' if saved.lossy else 'complete'}, {kept} steps"
    except TcrctlError as error:
        return said, f"exit {error.exit_code}"


def main():
    """Print the table."""
    log = Path(sys.argv[1])
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 250
    steps = sum(1 for _ in read_log(log).steps())
    rows = Counter()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mutant.mcap"
        for _, mutant in mutants(log.read_bytes(), count, np.random.default_rng(0)):
            path.write_bytes(mutant)
            rows[outcome(path, steps)] += 1
    print("| read | recovered | changes |\n| --- | --- | --- |")
    for (said, kept), number in sorted(rows.items()):
        print(f"| {said} | {kept} | {number} |")


if __name__ == "__main__":
    main()

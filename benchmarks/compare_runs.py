"""Do two versions of the program give the same numbers, bit for bit, in every shipped experiment?

    python benchmarks/compare_runs.py BEFORE AFTER [--only NAME ...]

Each side is a program (``old/.venv/bin/tcrctl``: its shipped experiments are run) or a folder of what ``tcrctl run
NAME --json`` printed, one ``NAME.json`` each. Times, run names and places of logs are left out. Ends with 1 if a
number differs. All experiments take ten minutes a side.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

#: What no two runs have in common.
OF_ONE_RUN = ("run_id", "log", "control_ms", "overruns", "versions")


def numbers(found: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Yield the path and the text of every value; the text of a float is exact."""
    if isinstance(found, dict):
        for key, value in found.items():
            if path or key not in OF_ONE_RUN:
                yield from numbers(value, f"{path}.{key}" if path else key)
    elif isinstance(found, list):
        for i, value in enumerate(found):
            yield from numbers(value, f"{path}.{i}")
    else:
        yield path, json.dumps(found)


def differences(before: Any, after: Any) -> list[str]:
    """Return sentences about what is not the same."""
    old, new = dict(numbers(before)), dict(numbers(after))
    return [
        f"{path}: {old.get(path, 'absent')} -> {new.get(path, 'absent')}"
        for path in [*old, *(path for path in new if path not in old)]
        if old.get(path) != new.get(path)
    ]


def read(folder: Path) -> dict[str, Any]:
    """Return the results by experiment."""
    return {path.stem: json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))}


def run(program: Path, only: Sequence[str]) -> dict[str, Any]:
    """Run the shipped experiments of an installation."""
    listed = subprocess.run([program, "list", "--json"], capture_output=True, text=True, check=True)
    names = [entry["name"] for entry in json.loads(listed.stdout)["experiments"]]
    results = {}
    for name in names:
        if only and name not in only:
            continue
        with TemporaryDirectory() as folder:
            command = [program, "run", name, "--json", "--out", folder]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        results[name] = json.loads(done.stdout)
        print(f"{program}: {name}: exit code {done.returncode}", file=sys.stderr, flush=True)
    return results


def table(before: dict[str, Any], after: dict[str, Any]) -> tuple[str, bool]:
    """Return a Markdown table, and whether everything is the same."""
    lines, same = ["| experiment | values | |", "|---|---|---|"], True
    for name in sorted(before.keys() | after.keys()):
        if name not in before or name not in after:
            verdict = f"missing {'after' if name in before else 'before'}"
        else:
            found = differences(before[name], after[name])
            verdict = f"{len(found)} differ, the first: {found[0]}" if found else "identical"
        same &= verdict == "identical"
        count = len(list(numbers(after.get(name, before.get(name)))))
        lines.append(f"| {name} | {count} | {verdict} |")
    return "\n".join(lines), same


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sides", nargs=2, type=Path, metavar=("BEFORE", "AFTER"))
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME")
    told = parser.parse_args()
    before, after = (read(side) if side.is_dir() else run(side, told.only) for side in told.sides)
    if told.only:
        before, after = ({k: v for k, v in side.items() if k in told.only} for side in (before, after))
    text, same = table(before, after)
    print(text)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())

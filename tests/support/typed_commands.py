"""How tests type the commands of the documents: what readers have, what makes long ones short, what is left out."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from support.shown_commands import blocks

ROOT = Path(__file__).parents[2]
#: Verbs that take no time, and an option with which others take none.
QUICK = frozenset(("kinds", "list", "new", "schema", "show", "validate"))
DRY = "--dry-run"
#: What is added to commands that take hours as they stand, by their verb.
ADDED = {
    "emulate": ("--for-s", "1"),
    "paper": ("--only", "letters"),
    "sweep": (DRY,),
}
#: Patterns of commands that are not typed, and who does it instead.
LEFT_OUT = {
    r"mine\.yaml|^replay logs/latest/log\.mcap$": "an installed package: tests/plugins/test_guide.py",
    "mujoco": "an installed package: its own tests",
    "^tune": "hours: tests/tune, on a short study",
    "--dask": "a cluster: tests/executors",
    "my_data": "data of the reader: tests/cli/test_cli_identify.py",
    "--from run1": "logs of the reader: tests/cli/test_cli_identify.py",
    "logs/TIME": "names that are drawn: tests/identify",
    "--calibrate": "five minutes of excitation: tests/identify/test_self_calibration.py",
    "^diff A": "logs of the reader: tests/analysis/test_diff.py",
    "LOG": "a log of the reader: tests/cli/test_cli_logs.py",
    "^play logs": "a server that stays: tests/view",
    r"\.\.\. ": "a name that is left to the reader",
}


def put_files(folder: Path) -> None:
    """Put into a folder what a reader of the documents has there: the examples, and the study that is shown."""
    shutil.copytree(
        ROOT / "examples" / "plugins",
        folder / "examples" / "plugins",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    studies = [
        text for text in blocks((ROOT / "docs" / "study.md").read_text(), ("yaml",)) if "kind: study" in text
    ]
    (folder / "my_study.yaml").write_text(studies[0])


def why_not(arguments: list[str]) -> str:
    """Say why a command is not typed; empty if it is."""
    words = " ".join(arguments)
    return next((why for pattern, why in LEFT_OUT.items() if re.search(pattern, words)), "")


def is_quick(arguments: list[str]) -> bool:
    """Whether a command takes no time as it stands."""
    dry = DRY in arguments and arguments[0] != "sweep"
    return arguments[0] in QUICK or dry or "--layout" in arguments


def shortened(arguments: list[str]) -> list[str]:
    """Return a command as it is typed."""
    added = ADDED.get(arguments[0], ())
    return arguments if DRY in arguments else [*arguments, *added]

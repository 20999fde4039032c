"""The runs in a folder: found by what they are and what came out, tagged, removed."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from tcrctl.analysis.condition import Condition, Value
from tcrctl.config import strict_yaml
from tcrctl.config.budget import MAX_BYTES
from tcrctl.errors import DeviceError, InputError
from tcrctl.experiment.run_folder import LATEST, SUMMARY
from tcrctl.log.file_names import RESOLVED
from tcrctl.log.run_files import json_of
from tcrctl.regular_file import open_file

TAGS: Final = "tags.json"


@dataclass(frozen=True)
class FoundRun:
    """A run that has ended.

    Attributes:
        folder: Its folder.
        summary: Its result, the object of ``run --json``.
    """

    folder: Path
    summary: Mapping[str, Any]

    @cached_property
    def settings(self) -> Mapping[str, Any]:
        """The experiment as it ran; read when it is asked for."""
        try:
            data = strict_yaml.load(self.folder / RESOLVED).data
        except InputError:
            return {}
        return data if isinstance(data, dict) else {}

    @cached_property
    def tags(self) -> tuple[str, ...]:
        """What the user has called it."""
        try:
            with open_file(self.folder / TAGS) as file:
                return tuple(map(str, json.loads(file.read(MAX_BYTES))))
        except (OSError, ValueError, TypeError, RecursionError):  # somebody else may have written it
            return ()

    def value(self, name: str) -> Value:
        """Return a value by dotted name: of the result, else of the settings; ``tag`` is its tags.

        Args:
            name: ``position_error_mm.max``, ``controller.kind``.
        """
        if name == "tag":
            return ",".join(self.tags)
        for source in (self.summary, self.settings):
            found = _at(source, name)
            if isinstance(found, str | int | float | bool):
                return found
        return None

    def tag(self, names: Sequence[str], *, remove: bool = False) -> None:
        """Add or remove tags.

        Raises:
            DeviceError: If they cannot be written.
        """
        kept = [tag for tag in self.tags if tag not in names]
        wanted = kept if remove else [*kept, *names]
        try:
            (self.folder / TAGS).write_text(json.dumps(wanted) + "\n", encoding="utf-8")
        except OSError as error:
            raise DeviceError(f"{self.folder / TAGS}: cannot be written: {error.strerror}") from error

    def remove(self) -> None:
        """Remove the run's folder with everything in it.

        Raises:
            DeviceError: If that cannot be done.
        """
        try:
            shutil.rmtree(self.folder)
        except OSError as error:
            raise DeviceError(f"{self.folder}: cannot be removed: {error.strerror or error}") from error

    @property
    def size(self) -> int:
        """Bytes that it takes."""
        return sum(path.stat().st_size for path in self.folder.rglob("*") if path.is_file())


def _at(data: Any, name: str) -> Any:
    for part in name.split("."):
        if isinstance(data, list) and part.isdecimal() and int(part) < len(data):
            data = data[int(part)]
        elif isinstance(data, Mapping):
            data = data.get(part)
        else:
            return None
    return data


def find_runs(out: Path, condition: Condition | None = None) -> list[FoundRun]:
    """Return the runs of a folder that meet a condition, oldest first; those that have not ended are left out.

    Args:
        out: Where runs go.
        condition: What they must meet.

    Raises:
        InputError: If there is no such folder.
    """
    if not out.is_dir():
        raise InputError(f"{out}: there is no such folder", hint="Runs go where --out or TCRCTL_LOGS says.")
    return [run for run in _runs(out) if condition is None or condition.holds(run.value)]


def _runs(out: Path) -> Iterator[FoundRun]:
    for path in sorted(out.glob(f"*/{SUMMARY}")):
        if path.parent.name == LATEST:
            continue
        summary = _summary(path)
        if summary is not None and "run_id" in summary:
            yield FoundRun(path.parent, summary)


def unreadable(out: Path) -> list[Path]:
    """Return the folders below ``out`` whose result is there and cannot be read."""
    paths = (path for path in sorted(out.glob(f"*/{SUMMARY}")) if path.parent.name != LATEST)
    return [path.parent for path in paths if _summary(path) is None]


def _summary(path: Path) -> Mapping[str, Any] | None:
    """Return what a file says as a map of JSON; None if it cannot be read, or is far too large for that."""
    try:
        with open_file(path) as file:
            content = file.read(MAX_BYTES + 1)
        found = json_of(content.decode()) if len(content) <= MAX_BYTES else None
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def in_order(runs: Sequence[FoundRun], name: str) -> list[FoundRun]:
    """Return runs by a value, smallest first; those without it last, and text after numbers.

    Args:
        runs: The runs.
        name: Dotted name; with a minus before it, largest first.
    """
    key = name.removeprefix("-")
    known = [run for run in runs if run.value(key) is not None]
    ordered = sorted(known, key=lambda run: _rank(run.value(key)), reverse=name.startswith("-"))
    return [*ordered, *(run for run in runs if run.value(key) is None)]


def _rank(value: Value) -> tuple[bool, float, str]:
    is_text = isinstance(value, str)
    return is_text, 0.0 if is_text or value is None else float(value), str(value) if is_text else ""

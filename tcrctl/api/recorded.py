"""A recorded run as Python sees it."""

from __future__ import annotations

import json
import os
from collections.abc import Collection
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import InputError
from tcrctl.experiment.run_folder import log_in
from tcrctl.log.event import Event
from tcrctl.log.file_names import RESOLVED
from tcrctl.log.reader import Log, read_log
from tcrctl.log.run_files import RunFiles, json_map
from tcrctl.signals import Array


class Run:
    """One run, read from its log when something of it is asked for.

    Attributes:
        path: The log.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r})"

    @cached_property
    def log(self) -> Log:
        """The log; its classes may change with any version."""
        return read_log(self.path)

    @property
    def summary(self) -> dict[str, Any]:
        """What ``tcrctl run --json`` prints; empty if the run was not finished."""
        return json_map((self.log.stop or {}).get("summary", ""))

    @property
    def spec(self) -> dict[str, Any]:
        """The experiment with every default filled in."""
        found: dict[str, Any] = RunFiles(self.log).document(RESOLVED).data
        return found

    @property
    def events(self) -> list[Event]:
        """What happened, in the order of time."""
        return list(self.log.events())

    def columns(self, *names: str) -> dict[str, NDArray[Any]]:
        """Return arrays by name, first axis = step; all if no name is given (docs/log.md lists them).

        Raises:
            UnknownNameError: If there is no such column.
        """
        wanted: Collection[str] | None = names or None
        return self.log.columns(wanted)

    @cached_property
    def reference(self) -> Array:
        """Wanted end positions (n, 3) [m]."""
        return self.columns("reference_position")["reference_position"]

    @cached_property
    def error(self) -> Array:
        """Distance of the end from where it is wanted (n,) [m]: by the plant's truth, or the estimate on a rig."""
        found = self.columns("truth_position", "estimate_position")
        position = found.get("truth_position", found["estimate_position"])
        distance: Array = np.linalg.norm(position - self.reference, axis=1)
        return distance

    def to_pandas(self, *names: str) -> Any:
        """Return a pandas.DataFrame, one row per step; a column of several entries becomes ``name_0``, ``name_1``.

        Raises:
            InputError: If pandas is not installed.
        """
        try:
            import pandas
        except ImportError:
            raise InputError("to_pandas needs pandas", hint="pip install pandas") from None
        flat: dict[str, NDArray[Any]] = {}
        for name, values in self.columns(*names).items():
            if values.ndim == 1:
                flat[name] = values
            else:
                rows = values.reshape(len(values), -1)
                flat |= {f"{name}_{i}": rows[:, i] for i in range(rows.shape[1])}
        return pandas.DataFrame(flat)


def load(path: str | os.PathLike[str]) -> Run:
    """Return a recorded run.

    Args:
        path: Its log, or its folder.

    Raises:
        InputError: If there is no log.
        LogError: If it is damaged.
    """
    run = Run(log_in(Path(path)))
    run.log  # noqa: B018  # what is wrong with it is said here
    return run


def as_settings(given: object) -> list[str]:
    """Return ``set=`` as assignments: a map of dotted keys to values, or texts ``a.b=c``."""
    if isinstance(given, dict):
        return [f"{key}={json.dumps(value)}" for key, value in given.items()]
    if isinstance(given, list | tuple) and all(isinstance(text, str) for text in given):
        return list(given)
    raise InputError("set must be a map of dotted keys to values, or a list of 'a.b=c'")

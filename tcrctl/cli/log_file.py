"""The argument LOG of every verb that reads a log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer


def log_path(text: str) -> Path:
    """Path of a log given itself or by the folder of its run."""
    path = Path(text)
    return path / "log.mcap" if path.is_dir() else path


LogFile: TypeAlias = Annotated[
    Path,
    typer.Argument(metavar="LOG", help="Log of a run, an MCAP file, or the run's folder.", parser=log_path),
]

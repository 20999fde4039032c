"""The argument LOG of every verb that reads a log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer


def log_path(text: str) -> Path:
    """Read an argument that names a log, or the folder of its run."""
    from tcrctl.experiment.run_folder import log_in  # not for those who only ask for help

    return log_in(Path(text))


LogFiles: TypeAlias = Annotated[
    list[Path],
    typer.Argument(metavar="LOG...", help="Logs of runs, MCAP files, or the runs' folders.", parser=log_path),
]
LogFile: TypeAlias = Annotated[
    Path,
    typer.Argument(metavar="LOG", help="Log of a run, an MCAP file, or the run's folder.", parser=log_path),
]

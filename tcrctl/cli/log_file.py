"""The argument LOG of every verb that reads a log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

LogFile: TypeAlias = Annotated[Path, typer.Argument(metavar="LOG", help="Log of a run, an MCAP file.")]

"""``tcrctl report LOG``: a run on one page for the browser."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from tcrctl.cli.log_file import LogFiles
from tcrctl.cli.options import AsJson


def report(
    logs: LogFiles,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", metavar="FILE", help="File to write; default: report.html beside the log."
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    as_json: AsJson = False,
) -> None:
    """Write one HTML page per log: result, criteria, the robot in motion, curves, files. It needs no network.

    The page can be mailed and archived; it opens in any browser. report.html#t=12.5 opens at that time.

    Examples:
      tcrctl report log.mcap
      tcrctl report logs/*_letter_t_*/
      tcrctl report log.mcap -o letter.html --force
    """
    from tcrctl.errors import InputError
    from tcrctl.report import write_report

    if out is not None and len(logs) > 1:
        raise InputError(
            "-o names one file, and there are several logs; each has its page beside it without -o"
        )
    for log in logs:
        path = write_report(log, out, force=force)
        if as_json:
            print(json.dumps({"status": "ok", "file": str(path), "bytes": path.stat().st_size}))
        else:
            print(path)
            print(f"{path.stat().st_size / 1e6:.2f} MB", file=sys.stderr)

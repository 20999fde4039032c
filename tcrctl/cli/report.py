"""``tcrctl report LOG...``: a run, or several side by side, on one page for the browser."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from tcrctl.cli.log_file import LogFiles
from tcrctl.cli.options import AsJson, to_make


def report(
    logs: LogFiles,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            metavar="FILE",
            parser=to_make,
            help="File to write; default: report.html beside the log, in this folder for several logs.",
        ),
    ] = None,
    each: Annotated[bool, typer.Option("--each", help="One page per log, each beside its log.")] = False,
    labels: Annotated[
        list[str] | None,
        typer.Option(
            "--label", metavar="TEXT", help="Name of a run on the page, one per log in the same order."
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    as_json: AsJson = False,
) -> None:
    """Write one HTML page: result, task, criteria, the robot in motion, curves, files. It needs no network.

    Several logs stand side by side in one page, with one clock. The page can be mailed and archived; it opens in
    any browser, a stopped run at its stop. report.html#t=12.5 opens at that time.

    Examples:
      tcrctl report log.mcap
      tcrctl report static/log.mcap dynamic/log.mcap -o compared.html
      tcrctl report logs/*_letter_t_*/ --each
    """
    from tcrctl.errors import InputError
    from tcrctl.report import write_report

    if out is not None and each and len(logs) > 1:
        raise InputError(
            "-o names one file, and --each writes one page beside each log; leave one of them out"
        )
    if labels and each:
        raise InputError("--label names the runs of one page, and --each writes a page of its own for each")
    for group in [[log] for log in logs] if each else [logs]:
        path = write_report(group, out, force=force, labels=labels or ())
        if as_json:
            print(json.dumps({"status": "ok", "file": str(path), "bytes": path.stat().st_size}))
        else:
            print(path)
            print(f"{path.stat().st_size / 1e6:.2f} MB", file=sys.stderr)

"""``tcrctl recover LOG``: mend a log whose run was killed, or whose file was damaged."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from tcrctl.cli.log_file import LogFile
from tcrctl.cli.options import AsJson, to_make


def recover(
    log: LogFile,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", metavar="FILE", parser=to_make, help="New file; default: LOG.recovered.mcap."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Copy everything that is whole into a new, finished log; the input is not changed.

    Exit code 3 if steps may be missing: the run was never finished, or a part of the file is damaged.

    Examples:
      tcrctl recover log.mcap
      tcrctl recover log.mcap -o mended.mcap && tcrctl replay mended.mcap
    """
    from tcrctl.experiment.headline import count
    from tcrctl.log.recover import recover as mend

    result = mend(log, out or log.with_name(f"{log.stem}.recovered.mcap"))
    if as_json:
        report = {
            "status": "lossy" if result.lossy else "complete",
            "log": str(result.path),
            "steps": result.steps,
            "messages": result.messages,
            "attachments": result.attachments,
            "damaged_chunks": result.damaged_chunks,
            "damages": list(result.damages),
        }
        print(json.dumps(report))
    else:
        print(result.path)
    for damage in result.damages:
        print(f"damaged and left out: {damage}", file=sys.stderr)
    why = "unfinished or damaged; steps may be missing" if result.lossy else "complete"
    print(f"{count(result.steps, 'step')} saved, the input was {why}", file=sys.stderr)
    if result.lossy:
        raise typer.Exit(3)

"""``tcrctl export LOG``: a log for tools that do not read MCAP."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from tcrctl.cli.log_file import LogFile
from tcrctl.cli.options import AsJson


def export(
    log: LogFile,
    as_csv: Annotated[bool, typer.Option("--csv", help="One row per step, one column per number.")] = False,
    as_npz: Annotated[bool, typer.Option("--npz", help="One numpy array per quantity.")] = False,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="FILE", help="File to write; default: LOG with the new suffix."),
    ] = None,
    nodes: Annotated[bool, typer.Option("--nodes", help="CSV: also every node and marker.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    as_json: AsJson = False,
) -> None:
    """Write the steps of a log as CSV or npz; names end in the SI unit, e.g. estimate_position_x_m.

    Examples:
      tcrctl export log.mcap --csv
      tcrctl export log.mcap --npz -o run.npz
    """
    from tcrctl.errors import InputError
    from tcrctl.export import export_csv, export_npz

    if as_csv == as_npz:
        raise InputError("give one format: --csv or --npz")
    target = out or log.with_suffix(".csv" if as_csv else ".npz")
    names = (
        export_csv(log, target, nodes=nodes, force=force) if as_csv else export_npz(log, target, force=force)
    )
    if as_json:
        print(json.dumps({"status": "ok", "file": str(target), "columns": names}))
    else:
        print(target)
        print(f"{len(names)} columns", file=sys.stderr)

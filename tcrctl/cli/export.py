"""``tcrctl export LOG``: a log for tools that do not read MCAP."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from tcrctl.cli.console import console, escaped
from tcrctl.cli.log_file import LogFile
from tcrctl.cli.options import AsJson, unfolded


def _print_columns(wanted: bool) -> None:
    if not wanted:
        return
    from rich.table import Table

    from tcrctl.log.columns import COLUMNS, meanings

    table, said = Table("column", "unit", "meaning", box=None), meanings()
    for name, column in COLUMNS.items():
        table.add_row(name, column.unit, escaped(said.get(name, "")))
    console().print(table)
    raise typer.Exit()


@dataclass(frozen=True)
class Form:
    """What is written."""

    as_csv: Annotated[bool, typer.Option("--csv", help="One row per step, one column per number.")] = False
    as_npz: Annotated[bool, typer.Option("--npz", help="One numpy array per quantity.")] = False
    as_parquet: Annotated[
        bool,
        typer.Option("--parquet", help="As CSV, in Apache Parquet; needs pip install 'tcrctl\\[parquet]'."),
    ] = False


@unfolded
def export(
    log: LogFile,
    form: Form = Form(),
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="FILE", help="File to write; default: LOG with the new suffix."),
    ] = None,
    nodes: Annotated[bool, typer.Option("--nodes", help="CSV, Parquet: also every node and marker.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    columns: Annotated[
        bool,
        typer.Option("--columns", help="List all columns and exit.", callback=_print_columns, is_eager=True),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Write the steps of a log as CSV, npz or Parquet; names end in the SI unit, e.g. estimate_position_x_m.

    Examples:
      tcrctl export log.mcap --csv
      tcrctl export log.mcap --npz -o run.npz
      tcrctl export log.mcap --parquet --nodes
      tcrctl export --columns
    """
    del columns
    from tcrctl.analysis.export import export_csv, export_npz, export_parquet
    from tcrctl.errors import InputError

    if form.as_csv + form.as_npz + form.as_parquet != 1:
        raise InputError("give one format: --csv, --npz or --parquet")
    target = out or log.with_suffix(".csv" if form.as_csv else ".npz" if form.as_npz else ".parquet")
    if form.as_npz:
        names = export_npz(log, target, force=force)
    else:
        write = export_csv if form.as_csv else export_parquet
        names = write(log, target, nodes=nodes, force=force)
    if as_json:
        print(json.dumps({"status": "ok", "file": str(target), "columns": names}))
    else:
        print(target)
        print(f"{len(names)} columns", file=sys.stderr)

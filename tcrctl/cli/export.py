"""``tcrctl export LOG``: a log for tools that do not read MCAP."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from typing import Annotated

import typer

from tcrctl.cli.log_file import LogFile
from tcrctl.cli.options import AsJson, unfolded


def _print_columns(wanted: bool) -> None:
    if not wanted:
        return
    from tcrctl.analysis.table import ERRORS
    from tcrctl.cli.table import print_table
    from tcrctl.log.columns import COLUMNS, meanings

    said = meanings()
    rows = [(name, column.unit, said.get(name, "")) for name, column in COLUMNS.items()]
    print_table(("column", "unit", "meaning"), [*rows, *((name, *told) for name, told in ERRORS.items())])
    raise typer.Exit()


@dataclass(frozen=True)
class Form:
    """What is written."""

    as_csv: Annotated[bool, typer.Option("--csv", help="One row per step, one column per number.")] = False
    as_parquet: Annotated[
        bool,
        typer.Option("--parquet", help="As CSV, in Apache Parquet; needs pip install 'tcrctl\\[parquet]'."),
    ] = False
    as_npz: Annotated[bool, typer.Option("--npz", help="One numpy array per quantity.")] = False
    as_mat: Annotated[bool, typer.Option("--mat", help="One MATLAB array per quantity.")] = False

    @property
    def name(self) -> str:
        """The only one that was asked for.

        Raises:
            InputError: If there are none or several.
        """
        from tcrctl.errors import InputError

        asked = {"csv": self.as_csv, "parquet": self.as_parquet, "npz": self.as_npz, "mat": self.as_mat}
        found = [name for name, is_asked in asked.items() if is_asked]
        if len(found) != 1:
            raise InputError("give one format: --csv, --parquet, --npz or --mat")
        return found[0]


@dataclass(frozen=True)
class More:
    """What a table holds only when it is asked for."""

    nodes: Annotated[bool, typer.Option("--nodes", help="CSV, Parquet: also every node and marker.")] = False
    ahead: Annotated[
        bool, typer.Option("--ahead", help="CSV, Parquet: also the references ahead, for the prediction.")
    ] = False


@unfolded
def export(
    log: LogFile,
    form: Form = Form(),
    out: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--out",
            metavar="FILE",
            help="File to write, - for standard output; default: LOG with the new suffix.",
        ),
    ] = None,
    more: More = More(),
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
    columns: Annotated[
        bool,
        typer.Option("--columns", help="List all columns and exit.", callback=_print_columns, is_eager=True),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Write the steps of a log as CSV, Parquet, npz or mat; names end in the SI unit, e.g. estimate_position_x_m.

    The events go to a second table beside it, run.events.csv beside run.csv; in npz and mat they are arrays.
    Standard output takes CSV, and of that the steps only.

    Examples:
      tcrctl export log.mcap --csv
      tcrctl export log.mcap --npz -o run.npz
      tcrctl export log.mcap --csv -o - | head -2
      tcrctl export log.mcap --parquet --nodes
      tcrctl export --columns
    """
    del columns
    from tcrctl.analysis.export import export_log, print_steps
    from tcrctl.errors import InputError
    from tcrctl.experiment.headline import count

    name = form.name
    if out in ("-", "/dev/stdout"):
        if name != "csv" or as_json:
            raise InputError("-o -: standard output takes --csv, and nothing beside it")
        return print_steps(log, sys.stdout, nodes=more.nodes, ahead=more.ahead)
    target = out or log.with_suffix(f".{name}")
    made = export_log(log, name, target, nodes=more.nodes, ahead=more.ahead, force=force)
    if as_json:
        files = [str(file) for file in made.files]
        print(json.dumps({"status": "ok", "file": files[0], "files": files, "columns": made.names}))
    else:
        print(*made.files, sep="\n")
        print(count(len(made.names), "column" if len(made.files) > 1 else "array"), file=sys.stderr)

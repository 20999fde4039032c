"""What a study says when it is done, for people and for programs."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tcrctl.cli.table import print_table
from tcrctl.experiment.headline import count
from tcrctl.report.study import write_study_page
from tcrctl.study.groups import done
from tcrctl.study.loading import LoadedStudy
from tcrctl.study.outputs import TABLE, Findings, findings
from tcrctl.study.outputs import write as write_tables
from tcrctl.study.sweep import Done, folder_of


@dataclass(frozen=True, slots=True)
class Shape:
    """How a result is printed.

    Attributes:
        form: text, csv, latex or markdown.
        as_json: One JSON object instead.
        quiet: Nothing, if it is text.
    """

    form: str
    as_json: bool
    quiet: bool


def write(study: LoadedStudy, result: Done, out: Path, *, parquet: bool, figures: str | None) -> Findings:
    """Write tables, page and figures into the folder of a study; return what it says.

    Raises:
        DeviceError: If a file cannot be written.
        InputError: If Parquet is wanted and pyarrow not installed.
    """
    folder, found = folder_of(study, out), findings(study.spec, result)
    write_tables(found, folder, parquet=parquet)
    write_study_page(found, result, folder)
    if figures is not None:
        from tcrctl.plots.study import save_study_figures

        save_study_figures(study.spec, done(result.runs, result.rows), folder / "figures", figures)
    return found


def show(study: LoadedStudy, result: Done, found: Findings, out: Path, shape: Shape) -> None:
    """Print what a study says on stdout, and on stderr what it lacks."""
    reason, folder = _say_why(result), folder_of(study, out)
    if shape.as_json:
        print(json.dumps(_as_json(study, result, found, folder, reason)))
    elif shape.form != "text":
        print(found.text(shape.form), end="")  # type: ignore[arg-type]  # checked before anything ran
    elif not shape.quiet:
        for text in found.tables(brief=True):
            print_table(text.head, text.rows)
        ended = len(result.runs) - result.missing
        print(f"{ended} of {count(len(result.runs), 'run')}, {result.new} of them now: {folder}")


def _say_why(result: Done) -> str:
    """Say on stderr what the study lacks, if anything; return it."""
    if result.interruption is not None:
        text = f"{result.interruption}; {count(result.missing, 'run')} to go: start again to go on"
        print(f"error: {text}", file=sys.stderr)
        return str(result.interruption)
    if result.unanswered:
        text = f"{result.unanswered}; --retry does them again"
        print(f"error: {text}", file=sys.stderr)
    return result.unanswered


def _status(result: Done) -> str:
    if result.interruption is not None:
        return "aborted"
    return "failed" if result.unanswered else "success"


def _as_json(study: LoadedStudy, result: Done, found: Findings, folder: Path, reason: str) -> dict[str, Any]:
    return {
        "status": _status(result),
        "reason": reason,
        "study": study.spec.name,
        "runs": len(result.runs),
        "new": result.new,
        "missing": result.missing,
        "seconds": result.seconds,
        "folder": str(folder),
        "table": str(folder / TABLE),
        **found.as_json(),
    }

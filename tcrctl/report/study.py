"""One page for a study: tables, a strip of marks per measure, and every run with the command that does it again.

The page has no script; a mark is a link to its run. Everything from files goes through :func:`html.escape`.
"""

from __future__ import annotations

import json
import math
import os
import shlex
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Final

from tcrctl import __version__
from tcrctl.config import strict_yaml
from tcrctl.experiment.headline import count
from tcrctl.experiment.run_folder import replace_file
from tcrctl.report.strip import strip
from tcrctl.study.groups import Run, done
from tcrctl.study.outputs import Findings
from tcrctl.study.plan import PlannedRun
from tcrctl.study.row import Row
from tcrctl.study.settings import StudySpec
from tcrctl.study.sweep import Done
from tcrctl.study.table import DIGITS
from tcrctl.study.text import TextTable, number
from tcrctl.study.values import value_of

PAGE: Final = "report.html"
#: More runs are not listed one by one; they are all in table.csv.
MOST_LISTED: Final = 5000


def write_study_page(found: Findings, result: Done, folder: Path) -> Path:
    """Write the page of a study into its folder; an older one is replaced.

    Args:
        found: What the study says.
        result: Its runs.
        folder: Its folder.

    Raises:
        DeviceError: If the file cannot be written.
    """
    path = folder / PAGE
    replace_file(path, study_page(found, result, folder))
    return path


def study_page(found: Findings, result: Done, folder: Path) -> str:
    """Return the page as HTML."""
    spec = found.spec
    asset = files(__package__)
    runs = done(result.runs, result.rows)
    groups, *differences = found.tables()
    return Template(asset.joinpath("study.html").read_text("utf-8")).substitute(
        name=escape(spec.name),
        description=escape(spec.description),
        status=escape(_status(result)),
        verdict="unclear" if result.missing else "bad" if result.unanswered else "good",
        subtitle=escape(f"{count(len(runs), 'run')}; {spec.source}".rstrip("; ")),
        groups=_table(groups),
        differences="".join(f"<section><h2>Pair by pair</h2>{_table(t)}</section>" for t in differences),
        strips="".join(_strips(spec, runs)),
        runs=_runs(spec, runs[:MOST_LISTED], folder),
        study=escape(strict_yaml.dumps(spec.model_dump(mode="json"))),
        version=escape(__version__),
        style=asset.joinpath("page.css").read_text("utf-8"),
    )


def _status(result: Done) -> str:
    if result.missing:
        return f"{count(result.missing, 'run')} missing"
    return result.unanswered or "complete"


def _table(table: TextTable) -> str:
    return _rows(map(escape, table.head), (map(escape, row) for row in table.rows))


def _rows(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return cells that are HTML already."""
    titles = "".join(f"<th>{title}</th>" for title in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{titles}</tr>{body}</table>"


def _strips(spec: StudySpec, runs: Sequence[Run]) -> Iterable[str]:
    factors = spec.factors if spec.group_by is None else spec.group_by
    for measure in spec.measures:
        lanes: dict[str, list[tuple[str, str, float]]] = {}
        for run, row in runs[:MOST_LISTED]:
            value = value_of(row, measure)
            if value is not None:
                label = ", ".join(run.levels.get(factor, "") for factor in factors)
                said = f"seed {run.seed}: {number(value)}"
                lanes.setdefault(label, []).append((_anchor(run.address), said, value))
        if any(math.isfinite(value) for marks in lanes.values() for _, _, value in marks):
            yield f"<section><h2>{escape(measure)}</h2>{strip(lanes)}</section>"


def _anchor(address: str) -> str:
    return f"r{address[:DIGITS]}"


def _runs(spec: StudySpec, runs: Sequence[Run], folder: Path) -> str:
    factors = list(dict.fromkeys(name for run, _ in runs for name in run.levels))
    measures = [
        name for name in spec.measures if any(value_of(r, name) is not None for _, r in runs if r.finished)
    ]
    head = ("", *map(escape, factors), "seed", "status", *map(escape, measures), "again, log")
    lines = []
    for run, row in runs:
        values = (value_of(row, name) for name in measures)
        lines.append(
            (
                f'<span id="{_anchor(run.address)}"></span>',
                *(escape(run.levels.get(name, "")) for name in factors),
                str(run.seed),
                escape(f"{row.status} {row.reason}".strip()),
                *("-" if value is None else number(value) for value in values),
                f"<code>{escape(_command(spec, run, row))}</code>{_log(row.log, folder)}",
            )
        )
    return _rows(head, lines)


def _command(spec: StudySpec, run: PlannedRun, row: Row) -> str:
    """Return what a person types to do a run again."""
    settings = run.cell.changes(spec)
    if row.path:
        settings["trajectory"] = row.path["trajectory"]
    sets = [part for key, value in settings.items() for part in ("--set", f"{key}={json.dumps(value)}")]
    return shlex.join(["tcrctl", "run", run.cell.experiment, *sets, "--seed", str(run.seed)])


def _log(log: str | None, folder: Path) -> str:
    if log is None:
        return ""
    there = os.path.relpath(Path(log).parent, folder.absolute())
    return f' <a href="{escape(there)}">log</a>'

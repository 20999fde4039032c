"""``tcrctl info LOG``: what a log contains."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from tcrctl.cli.console import console, escaped
from tcrctl.cli.log_file import LogFiles
from tcrctl.cli.options import AsJson

if TYPE_CHECKING:
    from tcrctl.analysis.info import LogInfo, Spread


def info(logs: LogFiles, as_json: AsJson = False) -> None:
    """Show duration, timing, lost steps, outcome and provenance of logs, finished or not.

    With --json, one object per log, each on its line.

    Examples:
      tcrctl info logs/latest
      tcrctl info log.mcap --json | jq .control_ms.p99
    """
    from tcrctl.analysis.info import inspect

    for log in logs:
        found = inspect(log)
        if as_json:
            print(json.dumps(found.as_json()))
        else:
            _print_tables(found)


def _print_tables(found: LogInfo) -> None:
    from rich.table import Table

    screen = console()
    provenance = {**found.start, **found.versions}.items()
    told = (("", _facts(found).items()), ("result", [*_result(found)]), ("provenance", provenance))
    for title, rows in told:
        if not rows:
            continue
        table = Table(title=title, title_justify="left", show_header=False, box=None)
        table.add_column(style="bold", no_wrap=True)
        table.add_column(overflow="fold")
        for name, value in rows:
            table.add_row(escaped(name), escaped(value))
        screen.print(table)


def _facts(found: LogInfo) -> dict[str, Any]:
    complete = "yes" if found.complete else f"no; mend it with: tcrctl recover {shlex.quote(found.path)}"
    rate = f" at {found.rate_hz:.4g} Hz" if found.rate_hz else ""
    per_step = f", {found.bytes_per_step:.0f} per step" if found.bytes_per_step else ""
    return {
        "log": found.path,
        "status": f"{found.status}{': ' if found.reason else ''}{found.reason}",
        "complete": "recovered; the end may be missing" if found.recovered else complete,
        "duration": f"{found.duration_s:.3f} s",
        "steps": f"{found.steps}{rate}, {found.lost_steps} lost, {found.unconverged_steps} unconverged",
        "jitter": _milliseconds(found.jitter_ms) if found.paced else "none: no clock paced the run",
        "overruns": f"{_overruns(found)}; lateness {_milliseconds(found.lateness_ms)}",
        "events": ", ".join(f"{count} {level}" for level, count in found.events.items()) or "none",
        "attachments": ", ".join(found.attachments) or "none",
        "size": f"{found.size_bytes} bytes{per_step}",
    }


def _overruns(found: LogInfo) -> str:
    return f"{found.overruns}, {100.0 * found.overruns / found.steps:.3g} %" if found.overruns else "0"


def _milliseconds(spread: Spread | None) -> str:
    if spread is None:
        return "unknown"
    from tcrctl.experiment.headline import number

    parts = {"p50": spread.p50, "p99": spread.p99, "max": spread.max}
    return ", ".join(f"{name} {number(round(value, 6), 'ms')}" for name, value in parts.items())


def _result(found: LogInfo) -> Iterator[tuple[str, str]]:
    """Yield the measures and criteria of the run as ``run`` prints them."""
    from tcrctl.experiment.headline import headline
    from tcrctl.experiment.judgement import judgements
    from tcrctl.experiment.task_words import findings

    yield from ((line.name, line.text) for line in headline(found.result) if line.first)
    yield from ((finding.subject, finding.text) for finding in findings(found.result.get("task")))
    yield from ((judgement.name, judgement.text) for judgement in judgements(found.result))

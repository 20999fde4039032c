"""The text of a page: everything from the log goes through :func:`html.escape` here, and nowhere else."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from string import Template
from typing import Any, Final

from tcrctl import __version__
from tcrctl.analysis.history import History
from tcrctl.experiment.headline import Line, headline, number
from tcrctl.experiment.judgement import judgements
from tcrctl.experiment.task_words import findings
from tcrctl.log.run_files import RunFiles

_SCRIPTS: Final = ("data.js", "robot.js", "charts.js", "page.js")
_STATUS: Final = {"success": "good", "failed": "bad", "aborted": "bad", "error": "bad"}


def page(history: History, summary: Mapping[str, Any], payload: Mapping[str, Any]) -> str:
    """Return the page as HTML.

    Args:
        history: The run.
        summary: Object of ``run --json``, or part of it.
        payload: What :func:`tcrctl.report.numbers.payload` made.
    """
    start, status = history.log.start, str(summary.get("status", ""))
    asset = files(__package__)
    return Template(asset.joinpath("page.html").read_text("utf-8")).substitute(
        title=escape(start.get("run_id", history.label)),
        name=escape(start.get("spec", history.label)),
        status=escape(status),
        verdict=_STATUS.get(status, "unclear"),
        reason=escape(_reason(summary, history)),
        subtitle=escape(_subtitle(start, history)),
        cards=_cards(summary),
        criteria=_criteria(summary),
        further=_further(summary),
        task=_task(summary.get("task")),
        events=_events(history),
        provenance=_pairs(start),
        attachments=_attachments(history),
        version=escape(__version__),
        style=asset.joinpath("page.css").read_text("utf-8"),
        data=_safe_json(payload),
        script="\n".join(asset.joinpath(name).read_text("utf-8") for name in _SCRIPTS),
    )


def _safe_json(payload: Mapping[str, Any]) -> str:
    """Write JSON that cannot end the script element it stands in."""
    text = json.dumps(payload, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _subtitle(start: Mapping[str, str], history: History) -> str:
    parts = [f"{name} {start[name]}" for name in ("robot", "plant", "controller") if start.get(name)]
    truth = "state of the simulated plant" if history.simulated else "state as estimated"
    return ", ".join([*parts, start.get("started", ""), truth])


def _reason(summary: Mapping[str, Any], history: History) -> str:
    reason = str(summary.get("reason", ""))
    if history.log.complete:
        return reason
    mend = f"The log is not complete; mend it with: tcrctl recover {shlex.quote(str(history.log.path))}"
    return f"{reason}. {mend}" if reason else mend


def _cards(result: Mapping[str, Any]) -> str:
    """Write the few numbers to look at first."""
    return "".join(_card(line) for line in headline(result) if line.first)


def _card(line: Line) -> str:
    numbers = "".join(
        f"<dd>{escape(said)} <small>{escape(part)}</small></dd>" for part, said in line.parts.items()
    )
    style = ' class="trouble"' if line.trouble else ""
    return f"<dl{style}><dt>{escape(line.name)}</dt>{numbers}</dl>"


def _further(result: Mapping[str, Any]) -> str:
    """Write the numbers that few people ask for."""
    steps = {"steps": number(result.get("steps")), "duration": number(result.get("duration_s"), "s")}
    return _pairs({**steps, **{line.name: line.text for line in headline(result) if not line.first}})


def _criteria(result: Mapping[str, Any]) -> str:
    rows = [
        f'<tr><td class="{j.style}">{escape(j.verdict)}</td><td><code>{escape(j.name)}</code></td>'
        f"<td>{escape(j.value)}</td><td>{escape(j.asked)}</td></tr>"
        for j in judgements(result)
    ]
    if not rows:
        return "<p>None.</p>"
    head = "<tr><th>verdict</th><th>criterion</th><th>value</th><th>must be</th></tr>"
    return f"<table>{head}{''.join(rows)}</table>"


def _task(task: Any) -> str:
    """Write a line of words for each thing of the task; instants lead there."""
    rows = [
        f"<tr><th>{escape(found.subject)}</th><td>{escape(found.text)}</td><td>{_instant(found.at)}</td></tr>"
        for found in findings(task)
    ]
    return f"<section><h2>Task</h2><table>{''.join(rows)}</table></section>" if rows else ""


def _instant(t: float | None) -> str:
    """Write a link that sets the clock of the page."""
    return "" if t is None else f'<a href="#t={t:.3f}">{t:.2f} s</a>'


def _events(history: History) -> str:
    rows = [
        f'<tr class="{escape(event.level)}"><td>{_instant(event.t)}</td><td>{escape(event.level)}</td>'
        f"<td>{escape(event.kind)}</td><td>{escape(event.message)}</td></tr>"
        for event in sorted(history.log.events(), key=lambda event: event.t)
    ]
    return f"<table>{''.join(rows)}</table>" if rows else "<p>None.</p>"


def _pairs(values: Mapping[str, str]) -> str:
    rows = (f"<tr><th>{escape(k)}</th><td>{escape(v)}</td></tr>" for k, v in values.items())
    return f"<table>{''.join(rows)}</table>"


def _attachments(history: History) -> str:
    """Write every attached file that is text."""
    return "".join(
        f"<details><summary>{escape(name)}</summary><pre>{escape(text)}</pre></details>"
        for name, text in RunFiles(history.log).texts()
    )

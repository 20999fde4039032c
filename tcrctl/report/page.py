"""The text of a page: everything from the log goes through :func:`html.escape` here, and nowhere else."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterable, Mapping
from html import escape
from importlib.resources import files
from string import Template
from typing import Any, Final

from tcrctl import __version__
from tcrctl.analysis.history import History
from tcrctl.experiment.summary import UNITS
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
        criteria=_criteria(summary.get("criteria") or ()),
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


def _cards(summary: Mapping[str, Any]) -> str:
    """Write every measure, with all its numbers."""
    cards = []
    for name in dict.fromkeys(full.partition(".")[0] for full in UNITS):
        value = summary.get(name)
        unit = next(u for n, u in UNITS.items() if n.partition(".")[0] == name)
        if value is None:
            continue
        title = name.removesuffix(f"_{unit.replace('/', '_')}".lower()) if unit else name
        parts = value.items() if isinstance(value, Mapping) else [("", value)]
        numbers = "".join(
            f"<dd>{_number(v)} {escape(unit)} <small>{escape(k)}</small></dd>" for k, v in parts
        )
        cards.append(f"<dl><dt>{escape(title.replace('_', ' '))}</dt>{numbers}</dl>")
    return "".join(cards)


def _number(value: Any) -> str:
    return escape(f"{value:.4g}" if isinstance(value, float) else str(value))


def _criteria(criteria: Iterable[Mapping[str, Any]]) -> str:
    rows = []
    for item in criteria:
        passed = bool(item.get("passed"))
        mark = '<td class="good">passed</td>' if passed else '<td class="bad">FAILED</td>'
        unit = escape(str(item.get("unit") or ""))
        value, limit = (_number(item.get(key)) for key in ("value", "limit"))
        name = escape(str(item.get("name")))
        rows.append(f"<tr>{mark}<td>{name}</td><td>{value} {unit}</td><td>{limit} {unit}</td></tr>")
    if not rows:
        return "<p>None.</p>"
    head = "<tr><th></th><th>criterion</th><th>value</th><th>limit</th></tr>"
    return f"<table>{head}{''.join(rows)}</table>"


def _task(task: Any) -> str:
    return f"<section><h2>Task</h2>{_nested(task)}</section>" if task else ""


def _nested(value: Any) -> str:
    """Write any JSON as nested tables."""
    if isinstance(value, Mapping):
        rows = (f"<tr><th>{escape(str(k))}</th><td>{_nested(v)}</td></tr>" for k, v in value.items())
        return f"<table>{''.join(rows)}</table>"
    if isinstance(value, list):
        return "".join(_nested(item) for item in value)
    return _number(value)


def _events(history: History) -> str:
    rows = [
        f'<tr class="{escape(event.level)}"><td>{event.t:.3f} s</td><td>{escape(event.level)}</td>'
        f"<td>{escape(event.kind)}</td><td>{escape(event.message)}</td></tr>"
        for event in history.log.events()
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

"""The text of a page, of one run or of several side by side."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import Any, Final

from tcrctl import __version__
from tcrctl.analysis.history import History
from tcrctl.experiment.judgement import FINISHED
from tcrctl.report.fragments import Result, badge, cards, compared, details, instant, stages, task_table

_SCRIPTS: Final = ("data.js", "task.js", "robot.js", "plan.js", "charts.js", "page.js")


def page(histories: Sequence[History], results: Sequence[Result], payload: Mapping[str, Any]) -> str:
    """Return the page as HTML.

    Args:
        histories: The runs.
        results: Their objects of ``run --json``, or parts of them.
        payload: What :func:`tcrctl.report.numbers.payload` made.
    """
    asset = files(__package__)
    head = _head(histories[0], results[0]) if len(histories) == 1 else _heads(histories, results)
    return Template(asset.joinpath("page.html").read_text("utf-8")).substitute(
        head,
        stages="".join(stages(histories)),
        runs=len(histories),
        version=escape(__version__),
        style=asset.joinpath("page.css").read_text("utf-8"),
        data=_safe_json(payload),
        script="\n".join(asset.joinpath(name).read_text("utf-8") for name in _SCRIPTS),
    )


def _head(history: History, result: Result) -> dict[str, str]:
    start = history.log.start
    return {
        "title": escape(start.get("run_id", history.label)),
        "name": f"{escape(start.get('spec', history.label))} {badge(result)}",
        "subtitle": f"{escape(start.get('run_id', history.label))}<br>{escape(_subtitle(start, history))}",
        "reason": _reason(result, history),
        "cards": f'<section class="cards">{cards(result)}</section>',
        "task": task_table(result),
        "details": details(history, result),
    }


def _heads(histories: Sequence[History], results: Sequence[Result]) -> dict[str, str]:
    runs = list(zip(histories, results, strict=True))
    labels = [history.label for history in histories]
    return {
        "title": escape(" | ".join(labels)),
        "name": f"{len(runs)} runs side by side",
        "subtitle": "<br>".join(escape(h.log.start.get("run_id", h.label)) for h in histories),
        "reason": "".join(_reason(result, history, history.label) for history, result in runs),
        "cards": "",
        "task": compared(labels, results)
        + "".join(f"<h3>{escape(h.label)}</h3>{text}" for h, r in runs if (text := task_table(r))),
        "details": "".join(_folded(history, result) for history, result in runs),
    }


def _folded(history: History, result: Result) -> str:
    label = escape(history.label)
    return f'<details class="of-run"><summary>{label}</summary>{details(history, result)}</details>'


def _safe_json(payload: Mapping[str, Any]) -> str:
    """Write JSON that cannot end the script element it stands in."""
    text = json.dumps(payload, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _subtitle(start: Mapping[str, str], history: History) -> str:
    parts = [f"{name} {start[name]}" for name in ("robot", "plant", "controller") if start.get(name)]
    truth = "state of the simulated plant" if history.simulated else "state as estimated"
    return ", ".join([*parts, start.get("started", ""), truth])


def _reason(result: Result, history: History, name: str = "") -> str:
    """Write why a run did not succeed, with the way to its stop, and which run it was if there are several."""
    said = [escape(str(result.get("reason", "")))]
    if not history.log.complete:
        mend = f"The log is not complete; mend it with: tcrctl recover {shlex.quote(str(history.log.path))}"
        said.append(escape(mend))
    text = ". ".join(part for part in said if part)
    stopped = result.get("status") not in FINISHED
    at = f"Stopped at {instant(float(history.t[-1]))}: " if text and stopped else ""
    which = f"<b>{escape(name)}</b> " if name else ""
    return f'<p class="reason">{which}{at}{text}</p>' if text else ""

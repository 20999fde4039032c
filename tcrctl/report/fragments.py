"""Parts of a page as HTML: everything from the log goes through :func:`html.escape` here or in ``page``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any, Final

from tcrctl.analysis.history import History
from tcrctl.experiment.headline import Line, headline, number
from tcrctl.experiment.judgement import FINISHED, judgements
from tcrctl.experiment.task_words import findings
from tcrctl.log.run_files import RunFiles

Result = Mapping[str, Any]

_STYLES: Final = {"success": "good", "failed": "bad", "aborted": "bad", "error": "bad"}


def badge(result: Result) -> str:
    """Write the status of a run."""
    status = str(result.get("status", ""))
    return f'<span class="badge {_STYLES.get(status, "unclear")}">{escape(status)}</span>'


def cards(result: Result) -> str:
    """Write the few numbers to look at first: the criteria in short, then measures."""
    lines = [line for line in (_criteria_line(result), *headline(result)) if line and line.first]
    return "".join(_card(line) for line in lines)


def _criteria_line(result: Result) -> Line | None:
    judged = list(judgements(result))
    if not judged:
        return None
    if result.get("status") not in FINISHED:
        return Line("criteria", {"the run was stopped": f"{len(judged)} open"}, True)
    kept = sum(judgement.style == "good" for judgement in judged)
    return Line("criteria", {"passed": f"{kept} of {len(judged)}"}, True, trouble=kept < len(judged))


def _card(line: Line) -> str:
    numbers = " ".join(
        f"<dd>{escape(said)} <small>{escape(part)}</small></dd>" for part, said in line.parts.items()
    )
    style = ' class="trouble"' if line.trouble else ""
    return f"<dl{style}><dt>{escape(line.name)}</dt>{numbers}</dl>"


def compared(labels: Sequence[str], results: Sequence[Result]) -> str:
    """Write the numbers of several runs side by side, one column per run."""
    rows = {"status": [badge(result) for result in results]}
    for i, result in enumerate(results):
        for line in headline(result):
            rows.setdefault(line.name, ["–"] * len(results))[i] = _kept(escape(line.text))
        for judgement in judgements(result):
            verdict = f'<span class="{judgement.style}">{escape(judgement.verdict)}</span>'
            said = f"{verdict} {_kept(escape(judgement.value))}"
            name = f"{judgement.name} {judgement.asked}"
            rows.setdefault(name, ["–"] * len(results))[i] = said
    head = "".join(
        f'<th><i class="run" data-run="{i}"></i>{escape(label)}</th>' for i, label in enumerate(labels)
    )
    body = "".join(
        f"<tr><th>{_breakable(name)}</th>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"
        for name, cells in rows.items()
    )
    return f'<div class="wide"><table class="compared"><tr><th></th>{head}</tr>{body}</table></div>'


def _kept(text: str) -> str:
    """Keep units with their numbers."""
    return re.sub(r"(?<=\d) (?=\S)", "&nbsp;", text)


def _breakable(name: str) -> str:
    """Write a name that may be broken between its parts, where columns are narrow."""
    return escape(name).replace("_", "_<wbr>").replace(".", ".<wbr>")


def task_table(result: Result) -> str:
    """Write a line of words for each thing of the task; instants lead there. Empty without a task."""
    rows = [
        f"<tr><th>{escape(found.subject)}</th><td>{escape(found.text)}</td><td>{instant(found.at)}</td></tr>"
        for found in findings(result.get("task"))
    ]
    return f'<section class="task"><h2>Task</h2><table>{"".join(rows)}</table></section>' if rows else ""


def instant(t: float | None) -> str:
    """Write a link that sets the clock of the page."""
    return "" if t is None else f'<a href="#t={t:.3f}">{t:.2f} s</a>'


def details(history: History, result: Result) -> str:
    """Write everything about one run that is no picture."""
    parts = (
        ("Criteria", _criteria(result)),
        ("Events", _events(history)),
        ("More numbers", _further(result)),
        ("Provenance", pairs(history.log.start)),
        ("Files of the run", _attachments(history)),
    )
    return "".join(f"<section><h2>{title}</h2>{text}</section>" for title, text in parts)


def _further(result: Result) -> str:
    """Write the numbers that few people ask for."""
    steps = {"steps": number(result.get("steps")), "duration": number(result.get("duration_s"), "s")}
    return pairs({**steps, **{line.name: line.text for line in headline(result) if not line.first}})


def _criteria(result: Result) -> str:
    rows = [
        f'<tr><td class="{j.style}">{escape(j.verdict)}</td><td><code>{_breakable(j.name)}</code></td>'
        f"<td>{escape(j.value)}</td><td>{escape(j.asked)}</td></tr>"
        for j in judgements(result)
    ]
    return _table(("verdict", "criterion", "value", "must be"), rows, "criteria")


def _events(history: History) -> str:
    events = sorted(history.log.events(), key=lambda event: event.t)
    rows = [
        f'<tr class="{escape(event.level)}"><td>{instant(event.t)}</td><td>{escape(event.level)}</td>'
        f"<td>{escape(event.kind)}</td><td>{escape(event.message)}</td></tr>"
        for event in events
    ]
    return _table(("time", "level", "kind", "what happened"), rows)


def _table(titles: Sequence[str], rows: Sequence[str], kind: str = "") -> str:
    if not rows:
        return "<p>None.</p>"
    head = "".join(f"<th>{title}</th>" for title in titles)
    return f'<div class="wide"><table class="{kind}"><tr>{head}</tr>{"".join(rows)}</table></div>'


def pairs(values: Mapping[str, str]) -> str:
    """Write a table of names and texts."""
    rows = (f"<tr><th>{escape(k)}</th><td>{escape(v)}</td></tr>" for k, v in values.items())
    return f"<table>{''.join(rows)}</table>"


def _attachments(history: History) -> str:
    """Write every attached file that is text."""
    return "".join(_attachment(name, text) for name, text in RunFiles(history.log).texts())


def _attachment(name: str, text: str) -> str:
    return f"<details><summary>{escape(name)}</summary><pre>{escape(text)}</pre></details>"


def stages(histories: Sequence[History]) -> Iterator[str]:
    """Yield the picture of every run's robot, then the plan of all of them."""
    for i, history in enumerate(histories):
        title = f"<figcaption>{escape(history.label)}</figcaption>" if len(histories) > 1 else ""
        keys = "drag or arrow keys turn it, shift-drag moves it, wheel or + and − zoom"
        yield (
            f'<figure><canvas class="robot" data-run="{i}" tabindex="0" role="img" '
            f'aria-label="The robot in space; {keys}"></canvas>{title}</figure>'
        )
    what = "The path of the end, wanted and actual, in the plane of the drawing"
    yield (
        f'<figure><canvas id="plan" role="img" aria-label="{what}"></canvas>'
        '<figcaption id="plan-name"></figcaption></figure>'
    )

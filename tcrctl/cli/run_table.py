"""The result of a run as the rows of a table for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from tcrctl.experiment.summary import Measures, Numbers, Summary

#: This share of overruns is no accident.
MANY: Final = 0.05
#: Ends of runs that say nothing about criteria.
STOPPED: Final = ("aborted", "error")
Row = tuple[str, str, str]


def rows(summary: Summary) -> Iterator[Row]:
    """Yield name, text and style of every row."""
    measures = summary.measures
    yield "run", summary.run_id, ""
    yield "status", summary.status, "green" if summary.exit_code == 0 else "red"
    yield "steps", f"{measures.steps}, {measures.duration_s:.2f} s", ""
    yield "position error", _numbers(measures.position_error_mm, "mm"), ""
    if measures.orientation_error_deg is not None:
        yield "orientation error", _numbers(measures.orientation_error_deg, "deg"), ""
        yield "theta_x error", _numbers(measures.theta_x_error_rad, "rad"), ""
        yield "theta_y error", _numbers(measures.theta_y_error_rad, "rad"), ""
    yield "cable tension", _numbers(measures.tension_n, "N"), ""
    if measures.saturated_fraction is not None:
        yield "saturated", f"{100.0 * measures.saturated_fraction:.1f} % of the steps", ""
    yield "control time", _numbers(measures.control_ms, "ms"), ""
    if measures.latency_ms is not None:
        yield "camera to drive", _numbers(measures.latency_ms, "ms"), ""
    yield "iterations", _numbers(measures.inner_iterations, ""), ""
    if measures.overruns:
        yield (
            "overruns",
            _overruns(measures),
            "yellow" if measures.overruns < MANY * measures.steps else "red",
        )
    if measures.unconverged_steps:
        yield "trouble", f"{measures.unconverged_steps} unconverged steps", "yellow"
    for text in _task(summary.task):
        yield "task", text, ""
    for verdict in summary.criteria if summary.status in STOPPED else ():
        yield "criterion", f"open, the run was stopped: so far {verdict}", "yellow"
    for verdict in summary.criteria if summary.status not in STOPPED else ():
        result = "passed" if verdict.passed else "FAILED"
        yield "criterion", f"{result}: {verdict}", "green" if verdict.passed else "red"


def _overruns(measures: Measures) -> str:
    share = measures.overruns / measures.steps
    text = f"{measures.overruns} steps, {100.0 * share:.3g} %, began or took longer than a period too late"
    return f"{text}: this computer does not keep up" if share >= MANY else text


def _task(task: Mapping[str, Any]) -> Iterator[str]:
    """Return one line per thing that the task lists, then its other values in one."""
    for items in task.values():
        for item in items if isinstance(items, list) else ():
            rest = {key: value for key, value in item.items() if key != "name"}
            yield f"{item['name']}: {_values(rest)}"
    single = {key: value for key, value in task.items() if not isinstance(value, list)}
    if single:
        yield _values(single)


def _values(values: Mapping[str, Any]) -> str:
    return ", ".join(_value(key, value) for key, value in values.items() if value is not None)


def _value(key: str, value: Any) -> str:
    """Return ``beam passes yes``, ``dwell 5.25 s``: a key that ends in its unit gives it to the number."""
    if isinstance(value, bool):
        return f"{key.replace('_', ' ')} {'yes' if value else 'no'}"
    if isinstance(value, float):
        name, _, unit = key.rpartition("_")
        return f"{name.replace('_', ' ')} {value:.4g} {unit}"
    return f"{key.replace('_', ' ')} {value}"


def _numbers(numbers: Numbers, unit: str) -> str:
    if numbers is None:
        return "unknown"
    return ", ".join(f"{name} {value:.4g} {unit}".rstrip() for name, value in numbers.items())

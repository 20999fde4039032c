"""The result of an identification as tables for people."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.table import Table

from tcrctl.cli.console import console, escaped

if TYPE_CHECKING:
    from tcrctl.identify.result import Result


def print_result(result: Result) -> None:
    """Print parameters, errors and methods."""
    screen = console()
    for table in (_parameters(result), _errors(result), _methods(result)):
        screen.print(table)
    angle = math.degrees(result.frame.yaw)
    if result.frame.free_yaw or result.frame.free_offset:
        offset = ", ".join(f"{1e3 * value:.2f}" for value in result.frame.offset)
        screen.print(f"measurement frame: yaw {angle:.2f} deg, offset [{offset}] mm")


def _parameters(result: Result) -> Table:
    table = Table(box=None, title="parameters", title_justify="left")
    for name in ("", "before", "after", "std", "std %", "bounds"):
        table.add_column(name, justify="left" if not name else "right", no_wrap=True)
    for i, (p, value) in enumerate(zip(result.parameters, result.values, strict=True)):
        std = math.nan if result.certainty is None else float(result.certainty.std[i])
        percent = 100.0 * std / abs(float(value)) if value else math.nan
        bounds = f"{p.low:.5g} .. {p.high:.5g}"
        table.add_row(
            escaped(p.path), f"{p.start:.5g}", f"{value:.5g}", _number(std), _number(percent), bounds
        )
    return table


def _errors(result: Result) -> Table:
    table = Table(box=None, title="mean error [mm]", title_justify="left")
    for name in ("", "before", "after", "held out"):
        table.add_column(name, justify="left" if not name else "right", no_wrap=True)
    for group in result.groups:
        table.add_row(
            escaped(group.name), *map(_number, (group.before_mm, group.after_mm, group.held_out_mm))
        )
    overall = (result.mean_error_before_mm, result.mean_error_after_mm, result.held_out_error_mm)
    table.add_row("all", *map(_number, overall), style="bold")
    return table


def _methods(result: Result) -> Table:
    table = Table(box=None, title="methods", title_justify="left")
    for name in ("", "mean error [mm]", "evaluations", "time [s]", "answer"):
        table.add_column(
            name, justify="left" if name in ("", "answer") else "right", no_wrap=name != "answer"
        )
    for stage in result.stages:
        answer = ", ".join(f"{value:.5g}" for value in stage.values.values())
        table.add_row(
            stage.method, _number(stage.mean_error_mm), str(stage.evaluations), f"{stage.seconds:.1f}", answer
        )
    table.add_row("in all", "", str(result.evaluations), f"{result.seconds:.1f}", "")
    return table


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "unknown"

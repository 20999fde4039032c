"""The result of an identification as tables for people."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tcrctl.cli.table import print_facts, print_table

if TYPE_CHECKING:
    from tcrctl.identify.result import Result


def print_result(result: Result) -> None:
    """Print parameters, errors and methods."""
    _print_parameters(result)
    _print_errors(result)
    _print_methods(result)
    angle = math.degrees(result.frame.yaw)
    if result.frame.free_yaw or result.frame.free_offset:
        offset = ", ".join(f"{1e3 * value:.2f}" for value in result.frame.offset)
        print_facts([("measurement frame", f"yaw {angle:.2f} deg, offset [{offset}] mm", "")])


def _print_parameters(result: Result) -> None:
    rows = []
    for i, (p, value) in enumerate(zip(result.parameters, result.values, strict=True)):
        std = math.nan if result.certainty is None else float(result.certainty.std[i])
        percent = 100.0 * std / abs(float(value)) if value else math.nan
        bounds = f"{p.low:.5g} .. {p.high:.5g}"
        rows.append((p.path, f"{p.start:.5g}", f"{value:.5g}", _number(std), _number(percent), bounds))
    heads = ("parameter", "before", "after", "std", "std %", "bounds")
    print_table(heads, rows, right=range(1, len(heads)), title="parameters")


def _print_errors(result: Result) -> None:
    rows = [
        (group.name, *map(_number, (group.before_mm, group.after_mm, group.held_out_mm)))
        for group in result.groups
    ]
    overall = (result.mean_error_before_mm, result.mean_error_after_mm, result.held_out_error_mm)
    rows.append(("all", *map(_number, overall)))
    styles = [*([""] * len(result.groups)), "bold"]
    heads = ("data", "before", "after", "held out")
    print_table(heads, rows, styles=styles, right=range(1, len(heads)), title="mean error [mm]")


def _print_methods(result: Result) -> None:
    rows = [
        (
            stage.method,
            _number(stage.mean_error_mm),
            str(stage.evaluations),
            f"{stage.seconds:.1f}",
            ", ".join(f"{value:.5g}" for value in stage.values.values()),
        )
        for stage in result.stages
    ]
    rows.append(("in all", "", str(result.evaluations), f"{result.seconds:.1f}", ""))
    heads = ("method", "mean error [mm]", "evaluations", "time [s]", "answer")
    print_table(heads, rows, right=(1, 2, 3), title="methods")


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "unknown"

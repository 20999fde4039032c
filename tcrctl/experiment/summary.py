"""The result of a run: the object that ``tcrctl run --json`` prints, the names in it, and their units."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from tcrctl.experiment.criterion import Criterion

_QUANTITIES: Final = {
    "steps": ("", ()),
    "duration_s": ("s", ()),
    "position_error_mm": ("mm", ("max", "rms", "mean")),
    "x_error_mm": ("mm", ("max", "rms")),
    "orientation_error_deg": ("deg", ("max", "rms")),
    "theta_x_error_rad": ("rad", ("max", "rms")),
    "theta_y_error_rad": ("rad", ("max", "rms")),
    "theta_singular_fraction": ("", ()),
    "tension_n": ("N", ("min", "max")),
    "saturated_fraction": ("", ()),
    "control_ms": ("ms", ("p50", "p99", "max")),
    "latency_ms": ("ms", ("p50", "p99", "max")),
    "overruns": ("", ()),
    "inner_iterations": ("", ("mean", "max")),
    "unconverged_steps": ("", ()),
}
UNITS: Final[Mapping[str, str]] = {
    ".".join((name, part)) if part else name: unit
    for name, (unit, parts) in _QUANTITIES.items()
    for part in parts or ("",)
}
"""Unit of every number in the result by its dotted name, for instance ``position_error_mm.max``."""
TASK: Final = "task."
"""Names that begin so are values that the task of the experiment defines."""

SUFFIXES: Final = {"mm": "mm", "rad": "rad", "deg": "deg", "s": "s"}
"""Endings of the names of a task's values, and the units that they stand for."""

Numbers = dict[str, float] | None


def unit_of(name: str) -> str:
    """Return the unit of a value of the result by its dotted name; names of a task's values end in theirs."""
    return UNITS.get(name) or (SUFFIXES.get(name.rpartition("_")[2], "") if name.startswith(TASK) else "")


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a criterion was met.

    Attributes:
        name: Dotted name of the value, as in the criterion.
        relation: How value and limit are compared.
        limit: The limit.
        value: The value; None if the run did not produce it, which fails the criterion.
        unit: Unit of both.
        passed: The verdict; false if the run did not come to its end, whatever the value.
    """

    name: str
    relation: str
    limit: float | bool
    value: float | bool | None
    unit: str
    passed: bool

    def as_json(self) -> dict[str, Any]:
        """Return the item of ``criteria`` in ``run --json``."""
        return {
            name: getattr(self, name) for name in ("name", "relation", "limit", "value", "unit", "passed")
        }

    def __str__(self) -> str:
        value = "unknown" if self.value is None else f"{_shown(self.value, '.4g')} {self.unit}".rstrip()
        return (
            f"{self.name} is {value}, must be {self.relation} {_shown(self.limit, 'g')} {self.unit}".rstrip()
        )


@dataclass(frozen=True, slots=True)
class Measures:
    """What was measured over the steps of a run; a quantity is None if no step gave it.

    Attributes:
        steps: Steps that were recorded.
        duration_s: Time they took by the clock that paced them [s]; without one, the time they cover.
        position_error_mm: Distance of the end from where it was wanted: ``max``, ``rms``, ``mean``.
        x_error_mm: Its x component: ``max``, ``rms``.
        orientation_error_deg: Angle between end normal and wanted one: ``max``, ``rms``.
        theta_x_error_rad: Error of the first angle of (45): ``max``, ``rms``.
        theta_y_error_rad: Error of the second one.
        theta_singular_fraction: Part of the steps in which the end looks along x, where the first one says nothing.
        tension_n: Over all cables and steps: ``min``, ``max``.
        saturated_fraction: Part of the steps in which some drive was at its speed limit.
        control_ms: Time that estimator and controller took in a step: ``p50``, ``p99``, ``max``.
        latency_ms: From the arrival of a camera frame to the answer of the drives to the command made from it,
            on a rig: ``p50``, ``p99``, ``max``.
        overruns: Steps of a paced run that began late by more than a period, or took longer than one.
        inner_iterations: Iterations of the controller's inner problem: ``mean``, ``max``.
        unconverged_steps: Steps in which controller or estimator found no solution.
    """

    steps: int
    duration_s: float
    position_error_mm: Numbers
    x_error_mm: Numbers
    orientation_error_deg: Numbers
    theta_x_error_rad: Numbers
    theta_y_error_rad: Numbers
    theta_singular_fraction: float | None
    tension_n: Numbers
    saturated_fraction: float | None
    control_ms: Numbers
    latency_ms: Numbers
    overruns: int
    inner_iterations: Numbers
    unconverged_steps: int


@dataclass(frozen=True, slots=True)
class Summary:
    """Result of a run.

    Attributes:
        run_id: Name of the run's folder.
        spec: Name of the experiment.
        robot: Name of the robot.
        plant: Kind of the plant.
        controller: Kind of the controller.
        seed: Seed of everything random.
        overrides: What ``--set`` changed.
        status: ``success``; ``failed`` (a criterion); ``aborted`` (safety, divergence, signal); ``error``.
        reason: Why; empty for success.
        exit_code: What the program exits with.
        measures: What was measured.
        criteria: Every criterion with its verdict.
        log: The log; None if there is none.
        versions: Of everything that the numbers depend on; empty if nobody asked.
        task: What the task of the experiment asks for.
    """

    run_id: str
    spec: str
    robot: str
    plant: str
    controller: str
    seed: int
    overrides: tuple[str, ...]
    status: str
    reason: str
    exit_code: int
    measures: Measures
    criteria: tuple[Verdict, ...]
    log: Path | None
    task: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return the object of ``run --json``; numbers that are not finite become null; on a rig with latency."""
        measures = dataclasses.asdict(self.measures)
        if self.measures.latency_ms is None:
            del measures["latency_ms"]
        named = ("run_id", "spec", "robot", "plant", "controller", "seed", "overrides", "status")
        head = {name: getattr(self, name) for name in named}
        tail = {
            "criteria": [verdict.as_json() for verdict in self.criteria],
            "log": None if self.log is None else str(self.log),
            "task": self.task,
            "versions": self.versions,
        }
        made: dict[str, Any] = finite({**head, "reason": self.reason, **measures, **tail})
        return made


def _shown(value: float | bool, form: str) -> str:
    return str(value).lower() if isinstance(value, bool) else format(value, form)


def judge(criteria: Sequence[Criterion], result: Mapping[str, Any]) -> tuple[Verdict, ...]:
    """Compare every criterion with the value it names.

    Args:
        criteria: What was asked.
        result: Object of ``run --json``, criteria not needed.
    """
    return tuple(_verdict(criterion, _find(result, criterion.name)) for criterion in criteria)


def _verdict(criterion: Criterion, value: float | bool | None) -> Verdict:
    return Verdict(
        criterion.name,
        criterion.relation,
        criterion.limit,
        value,
        unit_of(criterion.name),
        value is not None and criterion.holds(value),
    )


def _find(result: Any, name: str) -> float | bool | None:
    for part in name.split("."):
        if isinstance(result, list) and part.isdecimal() and int(part) < len(result):
            result = result[int(part)]
        elif isinstance(result, Mapping) and part in result:
            result = result[part]
        else:
            return None
    return result if isinstance(result, int | float) else None


def finite(value: Any) -> Any:
    """Return a value for JSON: numbers that are none, at any depth, become null."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

"""What an identification found."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tcrctl.identify.certainty import Certainty
from tcrctl.identify.coordinate_frame import CoordinateFrame
from tcrctl.identify.parameters import Parameter
from tcrctl.robot.description import RobotDescription
from tcrctl.signals import Array


@dataclass(frozen=True, slots=True)
class Stage:
    """One method's answer and cost.

    Attributes:
        method: ``pso`` or ``least-squares``.
        values: Parameter values by path.
        mean_error_mm: Mean distance (10) [mm].
        evaluations: Evaluations that it took.
        seconds: Time that it took [s].
    """

    method: str
    values: dict[str, float]
    mean_error_mm: float
    evaluations: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Group:
    """Mean distance of the points of one configuration or log [mm]; held-out is NaN if it is not known."""

    name: str
    before_mm: float
    after_mm: float
    held_out_mm: float


@dataclass(frozen=True, slots=True)
class Result:
    """What an identification found.

    Attributes:
        spec: Name of the identification.
        robot: Name of the robot it started from.
        base: The robot it started from, cables given as they were kept.
        new_robot: Name of the robot it ended with.
        status: ``success``, or ``aborted`` with the best answer until then.
        reason: Why it was aborted.
        exit_code: Exit code of the process.
        method: Method.
        seed: Seed of the swarm.
        strung_by: What stayed when parameters changed, ``tension`` or ``length``.
        parameters: What was to be found.
        values: Answer (n,), in the units of the robot file.
        frame: Measurement frame.
        certainty: Spread and what cannot be identified; None if it was aborted before.
        groups: Errors by configuration or log.
        mean_error_before_mm: Mean distance over all points [mm] of the robot as given.
        mean_error_after_mm: The same of the answer.
        stages: Every method's answer.
        remarks: Further warnings.
        evaluations: Evaluations of all data.
        seconds: Time [s].
        data_sha256: Hash of the data files.
    """

    spec: str
    robot: str
    base: RobotDescription
    new_robot: str
    status: str
    reason: str
    exit_code: int
    method: str
    seed: int
    strung_by: str
    parameters: tuple[Parameter, ...]
    values: Array
    frame: CoordinateFrame
    certainty: Certainty | None
    groups: tuple[Group, ...]
    mean_error_before_mm: float
    mean_error_after_mm: float
    stages: tuple[Stage, ...]
    remarks: tuple[str, ...]
    evaluations: int
    seconds: float
    data_sha256: str

    @property
    def held_out_error_mm(self) -> float:
        """Mean of the held-out errors of all groups [mm]; NaN if one is not known."""
        return float(np.mean([group.held_out_mm for group in self.groups]))

    @property
    def warnings(self) -> tuple[str, ...]:
        """All warnings as sentences."""
        combinations = () if self.certainty is None else self.certainty.combinations
        return (*map(str, combinations), *self.remarks)

    def as_json(self, robot_file: Path | None = None, figure: Path | None = None) -> dict[str, Any]:
        """Return one object for ``identify --json``; what is not known is null.

        Args:
            robot_file: Where the new robot was written.
            figure: Where the figure was written.
        """
        return {
            "status": self.status,
            "reason": self.reason,
            "spec": self.spec,
            "robot": self.robot,
            "method": self.method,
            "seed": self.seed,
            "strung_by": self.strung_by,
            "mean_error_before_mm": _known(self.mean_error_before_mm),
            "mean_error_after_mm": _known(self.mean_error_after_mm),
            "held_out_error_mm": _known(self.held_out_error_mm),
            "parameters": self._parameters(),
            **_certainty(self.certainty),
            "warnings": list(self.warnings),
            "configurations": [_group(group) for group in self.groups],
            "frame": {
                "yaw_deg": math.degrees(self.frame.yaw),
                "offset_mm": [1e3 * float(value) for value in self.frame.offset],
                "mirrored": self.frame.mirrored,
            },
            "stages": [_stage(stage) for stage in self.stages],
            "evaluations": self.evaluations,
            "seconds": round(self.seconds, 3),
            "data_sha256": self.data_sha256,
            "robot_file": None if robot_file is None else str(robot_file),
            "figure": None if figure is None else str(figure),
        }

    def _parameters(self) -> dict[str, Any]:
        std = np.full(len(self.values), np.nan) if self.certainty is None else self.certainty.std
        return {
            p.path: {
                "value": float(value),
                "std": _known(float(spread)),
                "bounds": [p.low, p.high],
                "start": p.start,
            }
            for p, value, spread in zip(self.parameters, self.values, std, strict=True)
        }


def _certainty(certainty: Certainty | None) -> dict[str, Any]:
    if certainty is None:
        return {"unidentifiable": [], "correlation": None, "sigma_mm": None}
    return {
        "unidentifiable": [
            {
                "combination": c.weights,
                "std_percent": _known(100.0 * c.std),
                "assumed": c.assumed or None,
                "message": str(c),
            }
            for c in certainty.combinations
        ],
        "correlation": [[_known(float(value)) for value in row] for row in certainty.correlation],
        "sigma_mm": certainty.sigma,
    }


def _group(group: Group) -> dict[str, Any]:
    return {
        "name": group.name,
        "before_mm": _known(group.before_mm),
        "after_mm": _known(group.after_mm),
        "held_out_mm": _known(group.held_out_mm),
    }


def _stage(stage: Stage) -> dict[str, Any]:
    return {
        "method": stage.method,
        "values": stage.values,
        "mean_error_mm": _known(stage.mean_error_mm),
        "evaluations": stage.evaluations,
        "seconds": round(stage.seconds, 3),
    }


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None

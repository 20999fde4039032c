"""The regression (10) of an identification: measured points, the model's prediction of them, and their difference.

A *group* is one static configuration or one log; errors are told per group and groups are held out. A single
log is divided into four groups of equal length instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcrctl.identify.coordinate_frame import CoordinateFrame
from tcrctl.identify.log_data import Recording
from tcrctl.identify.motion import marker_motion
from tcrctl.identify.parameters import Parameter, values, with_values
from tcrctl.identify.static_data import Configuration
from tcrctl.identify.statics import make_twins, rest_shapes, shape_slopes
from tcrctl.robot.description import RobotDescription
from tcrctl.robot.robot import build_robot
from tcrctl.signals import Array

MM = 1e3
#: Deviation of finite differences in the unit cube, for logs.
UNIT_DEVIATION = 2e-3
_QUARTERS = 4


@dataclass(frozen=True)
class Regression:
    """Unknowns, data and what else a prediction needs; plain data, so that it can go to another process.

    Attributes:
        robot: The robot to start from.
        parameters: What is to be found.
        configurations: Static data.
        recordings: Logs.
        reference: Configuration that displacements are taken from; empty for positions.
        h: Internal step of simulated logs [s].
    """

    robot: RobotDescription
    parameters: tuple[Parameter, ...]
    configurations: tuple[Configuration, ...]
    recordings: tuple[Recording, ...]
    reference: str
    h: float

    @cached_property
    def measured(self) -> Array:
        """Measured points (n, 3) [m], as they are compared: positions or displacements; NaN if not measured."""
        parts = [np.array(c.position) for c in self.configurations]
        parts += [recording.frames.reshape(-1, 3) for recording in self.recordings]
        return self.relative(np.concatenate(parts))

    @cached_property
    def group(self) -> NDArray[np.int64]:
        """Number of the group of each compared point (n,)."""
        return np.array([number for number, _ in self._point_groups], dtype=np.int64)

    @cached_property
    def group_names(self) -> tuple[str, ...]:
        """Names of the groups."""
        return tuple(dict.fromkeys(name for _, name in self._point_groups))

    @cached_property
    def _point_groups(self) -> list[tuple[int, str]]:
        names = [c.name for c in self.configurations if c.name != self.reference for _ in c.points]
        alone = len(self.recordings) == 1 and not self.configurations
        for recording in self.recordings:
            frames, markers, _ = recording.frames.shape
            quarter = np.arange(frames) * _QUARTERS // frames + 1
            for part in quarter:
                names += [f"{recording.name} {part}/{_QUARTERS}" if alone else recording.name] * markers
        number = {name: i for i, name in enumerate(dict.fromkeys(names))}
        return [(number[name], name) for name in names]

    @cached_property
    def _reference_rows(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Rows that are compared, and the rows of the reference that belong to them."""
        names = [(c.name, point) for c in self.configurations for point in c.points]
        row = {name: i for i, name in enumerate(names)}
        kept = [i for i, name in enumerate(names) if name[0] != self.reference]
        return np.array(kept), np.array([row[self.reference, names[i][1]] for i in kept])

    def relative(self, points: Array) -> Array:
        """Return displacements from the reference configuration, of points (n, 3, ...); all of them without one."""
        if not self.reference:
            return points
        kept, reference = self._reference_rows
        out: Array = points[kept] - points[reference]
        return out

    def describe(self, x: Array) -> RobotDescription:
        """Return the robot at ``x`` (n_parameters,) of the unit cube."""
        return with_values(self.robot, values(self.parameters, x))

    def predict(self, x: Array) -> Array:
        """Return the model positions or displacements of all compared points (n, 3) [m], robot frame.

        Raises:
            NoEquilibriumError: If the robot has no stable shape.
            DivergenceError: If a log cannot be simulated.
        """
        robot = build_robot(self.describe(x))
        parts = []
        for c, q in zip(self.configurations, rest_shapes(robot, self._drives), strict=True):
            parts.append(q.reshape(-1, 3)[np.array(c.rows)].mean(axis=1))
        parts += [marker_motion(robot, recording, self.h).reshape(-1, 3) for recording in self.recordings]
        return self.relative(np.concatenate(parts))

    def static_slopes(self, x: Array) -> Array:
        """Return ∂(prediction)/∂x (n, 3, n_parameters) for static data alone, through the tangent.

        Raises:
            NoEquilibriumError: As :meth:`predict`.
        """
        at = values(self.parameters, x)
        robot = build_robot(with_values(self.robot, at))
        twins = make_twins(lambda v: with_values(self.robot, v), robot, at)
        scale = np.array([p.slope(float(u)) for p, u in zip(self.parameters, x, strict=True)])
        parts = []
        for c, drive, q in zip(
            self.configurations, self._drives, rest_shapes(robot, self._drives), strict=True
        ):
            slopes = shape_slopes(robot, twins, q, drive) * scale
            parts.append(slopes.reshape(-1, 3, len(scale))[np.array(c.rows)].mean(axis=1))
        return self.relative(np.concatenate(parts))

    def difference_points(self, x: Array) -> list[tuple[Array, float]]:
        """Return points beside ``x`` in the unit cube and signed deviations, one per parameter, for differences."""
        points = []
        for j in range(len(x)):
            deviation = UNIT_DEVIATION if x[j] + UNIT_DEVIATION <= 1.0 else -UNIT_DEVIATION
            beside = x.copy()
            beside[j] += deviation
            points.append((beside, deviation))
        return points

    @cached_property
    def _drives(self) -> Array:
        return np.array([c.drive for c in self.configurations]).reshape(-1, len(self.robot.cables.routes))

    def with_parameters(self, parameters: Sequence[Parameter]) -> Regression:
        """Return the same data with other parameters."""
        return replace(self, parameters=tuple(parameters))

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what is derived."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


def distances(frame: CoordinateFrame, predicted: Array, measured: Array) -> Array:
    """Return distance between prediction and measurement (n,) [mm] over the measured coordinates of each point."""
    difference = MM * (frame.place(predicted) - measured)
    out: Array = np.sqrt(np.nansum(difference**2, axis=1))
    return out


def mean_distance(frame: CoordinateFrame, predicted: Array, measured: Array) -> float:
    """Return the objective (10) [mm], frame unknowns at their best."""
    seen = ~np.isnan(measured).all(axis=1)
    found = frame.aligned(predicted, measured)
    return float(distances(found, predicted, measured)[seen].mean())

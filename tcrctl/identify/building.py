"""From loaded files to the regression, held against common mistakes in the data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tcrctl.elements import sliding_cable
from tcrctl.errors import InputError
from tcrctl.identify.coordinate_frame import CoordinateFrame
from tcrctl.identify.loading import LoadedIdentification
from tcrctl.identify.log_data import Recording, read_recording
from tcrctl.identify.parameters import start_of, with_values
from tcrctl.identify.regression import Regression, distances
from tcrctl.robot.description import RobotDescription
from tcrctl.robot.robot import build_robot
from tcrctl.signals import Array

#: Measured and modelled sizes that differ by more than this factor mean a wrong unit.
UNIT_FACTOR = 50.0
#: Relative difference of rest lengths that is no difference.
SAME_LENGTH = 1e-9
TENSION = "cables.initial_tension_n"
#: How the keys of forces, and of what is proportional to them, end.
FORCES = ("_mpa", "_g", "_n")
DAMPINGS = ("_n_s_m",)


def build_regression(loaded: LoadedIdentification) -> tuple[Regression, str]:
    """Build the regression; returns it and what stays when parameters change: ``tension`` or ``length``.

    Raises:
        InputError: If the data do not fit the robot or each other, or are fewer than the unknowns.
        LogError: If a log is damaged.
    """
    spec = loaded.spec
    recordings = tuple(read_recording(log, loaded.robot) for log in loaded.logs)
    strung_by = spec.strung_by or _usual(loaded, recordings)
    robot = loaded.robot
    if strung_by == "length":
        robot = with_lengths(robot, _lengths(robot, recordings))
        for parameter in loaded.parameters:
            if parameter.path.endswith("initial_tension_n"):
                raise InputError(
                    f"{parameter.path} is no parameter while cables keep their rest lengths",
                    hint="Use strung_by: tension (--strung-by tension).",
                )
    reference = spec.frame.reference if spec.frame.offset == "displacement" else ""
    regression = Regression(
        robot, loaded.parameters, loaded.configurations, recordings, reference, spec.step_ms / 1e3
    )
    return regression, strung_by


def _usual(loaded: LoadedIdentification, recordings: Sequence[Recording]) -> str:
    """Return what stays: rest lengths with simulated plants, whatever their mismatch; else what the file gives."""
    only_logs = bool(recordings) and not loaded.configurations
    return "length" if only_logs and all(r.rest_length is not None for r in recordings) else "tension"


def _lengths(robot: RobotDescription, recordings: Sequence[Recording]) -> Array:
    """Rest lengths of the logged robots, or else of the robot as given (m,) [m]."""
    known = [(r.name, r.rest_length) for r in recordings if r.rest_length is not None]
    if not known:
        rest: Array = build_robot(robot).model.cables[:, sliding_cable.REST]
        return rest
    name, first = known[0]
    for other, length in known[1:]:
        if np.abs(length / first - 1.0).max() > SAME_LENGTH:
            raise InputError(
                f"{name} and {other} have cables of different rest lengths",
                hint="Identify from one of them at a time, or use strung_by: tension.",
            )
    return first


def with_lengths(robot: RobotDescription, rest: Array) -> RobotDescription:
    """Return the robot whose cables are given by rest lengths (m,) [m] instead of initial tensions."""
    changes: dict[str, float | None] = {TENSION: None}
    for c, length in enumerate(rest):
        changes[f"cables.routes.{c}.rest_length_mm"] = 1e3 * float(length)
        changes[f"cables.routes.{c}.initial_tension_n"] = None
    return with_values(robot, changes)


def choose_frame(loaded: LoadedIdentification, regression: Regression) -> tuple[CoordinateFrame, Array, str]:
    """Find the frame that fits the robot as given, and see that the data can be meant.

    Returns:
        Coordinate frame, prediction (n, 3) [m] of the robot as given, and a remark on the cables' order or nothing.

    Raises:
        NoEquilibriumError: If the robot as given has no stable shape.
        InputError: If the sizes are off by a unit, or the data are fewer than the unknowns.
    """
    predicted = regression.predict(start_of(regression.parameters))
    measured = regression.measured
    known = CoordinateFrame.of(loaded.spec.frame)
    frame = plain = known.aligned(predicted, measured)
    remark = ""
    _check_size(regression, predicted)
    _check_amount(regression, frame)
    if loaded.spec.frame.mirrored == "try":
        mirrored = replace(known, mirrored=True).aligned(predicted, measured)
        errors = [float(np.nanmean(distances(f, predicted, measured))) for f in (plain, mirrored)]
        frame = plain if errors[0] <= errors[1] else mirrored
        if abs(errors[0] - errors[1]) < 0.01 * max(errors):
            remark = "the data cannot tell whether the cables' order is mirrored; taken as not mirrored"
            frame = plain
    return frame, predicted, remark


def _check_amount(regression: Regression, frame: CoordinateFrame) -> None:
    coordinates = int((~np.isnan(regression.measured)).sum())
    unknowns = len(regression.parameters) + len(frame.unknowns)
    if coordinates < unknowns:
        raise InputError(
            f"{coordinates} measured coordinates are too few for {unknowns} unknowns "
            f"({len(regression.parameters)} parameters, {len(frame.unknowns)} of the frame)",
            hint="Measure more configurations or points, or identify fewer parameters.",
        )


def _check_size(regression: Regression, predicted: Array) -> None:
    """Compare how far measured and modelled points lie apart; a wrong unit shows whatever the frame."""
    whole = ~np.isnan(regression.measured).any(axis=1)
    if whole.sum() < 2:
        return
    measured, modelled = regression.measured[whole], predicted[whole]
    if regression.reference:
        sizes = [float(np.sqrt((points**2).sum(axis=1).mean())) for points in (measured, modelled)]
    else:
        sizes = [float(np.sqrt(points.var(axis=0).sum())) for points in (measured, modelled)]
    if min(sizes) == 0.0 or 1.0 / UNIT_FACTOR < sizes[0] / sizes[1] < UNIT_FACTOR:
        return
    raise InputError(
        f"measured points spread over {1e3 * sizes[0]:.4g} mm, those of the robot over {1e3 * sizes[1]:.4g} mm",
        hint="Check the unit of the data; lengths are in mm.",
    )


def assumed_forces(robot: RobotDescription, free: Sequence[str], *, moving: bool) -> dict[str, float]:
    """Return the values that fix the scale of forces without having been measured, by path.

    Moduli, masses, tensions and dampings times one factor move nothing. A weighed module fixes that factor; the
    initial tension is assumed even then. If the module's mass is to be found too, everything else is assumed.

    Args:
        robot: The robot.
        free: Paths of what is to be found.
        moving: Some of the data are of a moving robot, so that dampings count.
    """
    keys = FORCES + DAMPINGS if moving else FORCES
    every = {path: v for path, v in _numbers(robot.model_dump(mode="json")) if path.endswith(keys) and v}
    fixed = {path: v for path, v in every.items() if path not in free and path != "tension_limit_n"}
    if "modules.mass_g" in free:
        return fixed
    return {path: value for path, value in fixed.items() if path.endswith("initial_tension_n")}


def _numbers(data: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Return every number of a robot as plain data, by dotted path."""
    if isinstance(data, dict | list):
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from _numbers(value, f"{path}.{key}" if path else str(key))
    elif isinstance(data, float):
        yield path, data

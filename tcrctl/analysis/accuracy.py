"""How well poses and paths are attained, in the measures of ISO 9283 [ISO9283]; angles are those between normals.

histories -> visits of the same pose, passes along the same path -> accuracy, repeatability, drift
"""

from __future__ import annotations

import dataclasses
import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from tcrctl.analysis.end_error import angle, distance
from tcrctl.analysis.history import History
from tcrctl.analysis.visits import Pass, Visit, visits_of
from tcrctl.errors import InputError
from tcrctl.experiment.summary import finite
from tcrctl.signals import Array


@dataclass(frozen=True, slots=True)
class PoseAccuracy:
    """One pose; what cannot be said of so few visits, or without an orientation, is NaN.

    Attributes:
        pose: Number, in the order in which poses came.
        visits: How often it was attained.
        directions: From how many other poses.
        accuracy_mm: AP, from the pose to the barycentre of what was attained.
        repeatability_mm: RP, mean distance from the barycentre and three standard deviations.
        variation_mm: vAP, the largest distance between barycentres of two directions.
        drift_mm: dAP, from the barycentre of the first third of the visits to that of the last.
        accuracy_deg: AP of the normal.
        repeatability_deg: RP of the normal.
        variation_deg: vAP of the normal.
        drift_deg: dAP of the normal.
    """

    pose: int
    visits: int
    directions: int
    accuracy_mm: float
    repeatability_mm: float
    variation_mm: float
    drift_mm: float
    accuracy_deg: float
    repeatability_deg: float
    variation_deg: float
    drift_deg: float


@dataclass(frozen=True, slots=True)
class PathAccuracy:
    """One path from pose to pose.

    Attributes:
        origin: Number of the pose that it begins at.
        pose: Number of the pose that it ends at.
        passes: How often it was gone along.
        accuracy_mm: AT, the largest distance from the wanted position to the barycentre at the same time; stricter
            than the standard, which forgives what is late along the path.
        repeatability_mm: RT, the largest mean distance from that barycentre and three standard deviations; NaN of
            one pass.
    """

    origin: int
    pose: int
    passes: int
    accuracy_mm: float
    repeatability_mm: float


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Poses and paths of some runs.

    Attributes:
        poses: In the order in which they came.
        paths: Likewise.
        true: Whether the end is the simulated plant's, not the estimate.
    """

    poses: tuple[PoseAccuracy, ...]
    paths: tuple[PathAccuracy, ...]
    true: bool

    def as_json(self) -> dict[str, Any]:
        """Return the object of ``tcrctl accuracy --json``; what cannot be said is null."""
        found: dict[str, Any] = finite(dataclasses.asdict(self))
        return {
            "status": "success",
            "end": "true" if found.pop("true") else "estimated",
            **found,
        }


def accuracy_of(histories: Sequence[History]) -> Accuracy:
    """Measure how well the end attained the poses at which it was to stand, and the paths between them.

    Args:
        histories: Runs; all count as repetitions.

    Raises:
        InputError: If the reference stands nowhere but at the start.
    """
    visits, passes = visits_of(histories)
    if not visits:
        raise InputError(
            "the reference stands nowhere but where it begins, so no pose is attained",
            hint="Run one that goes through poses again and again: tcrctl run pose_accuracy",
        )
    by_pose, by_path = defaultdict[int, list[Visit]](list), defaultdict[tuple[int, int], list[Pass]](list)
    for visit in visits:
        by_pose[visit.pose].append(visit)
    for one in passes:
        by_path[one.path].append(one)
    return Accuracy(
        tuple(_of_pose(some) for _, some in sorted(by_pose.items())),
        tuple(_of_path(some) for some in by_path.values()),
        all(history.simulated for history in histories),
    )


def _of_pose(visits: Sequence[Visit]) -> PoseAccuracy:
    wanted, attained = visits[0].wanted, np.array([visit.attained for visit in visits])
    middle = _barycentre(attained)
    origins = np.array([visit.origin for visit in visits])
    centres = [_barycentre(attained[origins == origin]) for origin in dict.fromkeys(origins.tolist())]
    between = [_apart(a, b[None])[:, 0] for a, b in combinations(centres, 2)]
    third = len(visits) // 3
    ends = (_barycentre(attained[:third]), _barycentre(attained[-third:])) if third else None
    accuracy, apart = _apart(wanted, middle[None])[:, 0], _apart(middle, attained)
    repeatability = [_repeatability(row) for row in apart]
    variation = np.max(between, axis=0) if between else np.full(2, np.nan)
    drift = _apart(ends[0], ends[1][None])[:, 0] if ends else np.full(2, np.nan)
    found = (accuracy, repeatability, variation, drift)
    millimetres, degrees = [1e3 * float(a) for a, _ in found], [math.degrees(float(b)) for _, b in found]
    return PoseAccuracy(visits[0].pose, len(visits), len(centres), *millimetres, *degrees)


def _of_path(passes: Sequence[Pass]) -> PathAccuracy:
    attained = np.array([one.attained for one in passes])
    middle = attained.mean(axis=0)
    apart = np.linalg.norm(attained - middle, axis=2)
    spread = [_repeatability(column) for column in apart.T]
    first = passes[0]
    return PathAccuracy(
        *first.path, len(passes), 1e3 * float(distance(middle, first.wanted).max()), 1e3 * max(spread)
    )


def _barycentre(poses: Array) -> Array:
    """Return the mean of poses (k, 6), its normal of length 1."""
    middle: Array = poses.mean(axis=0)
    middle[3:] /= np.linalg.norm(middle[3:])
    return middle


def _apart(pose: Array, others: Array) -> Array:
    """Return distance [m] and angle [rad] of other poses (k, 6) from one (6,), (2, k)."""
    return np.array([distance(others[:, :3], pose[:3]), angle(others[:, 3:], pose[None, 3:])])


def _repeatability(apart: Array) -> float:
    """Return the mean and three standard deviations; NaN of one alone."""
    return float(apart.mean() + 3.0 * apart.std(ddof=1)) if len(apart) > 1 else math.nan

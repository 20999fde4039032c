"""What a self-calibration found, as numbers for people and programs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.identify.calibration.answer_of_drives import DriveAnswer
from tcrctl.identify.calibration.fit import Fit
from tcrctl.identify.calibration.judgement import moving_together, undetermined
from tcrctl.identify.calibration.rubbing import Rubbing
from tcrctl.identify.calibration.unknowns import SEEN, Unknowns
from tcrctl.robot.module import RING
from tcrctl.signals import Array

#: Units of the groups in reports: name and factor from SI; the others are relative.
UNITS: Final = {
    "zeros": ("mm", 1e3),
    "geometry": ("mm", 1e3),
    "backlash": ("mm", 1e3),
    "frame_translation": ("mm", 1e3),
    "markers": ("mm", 1e3),
    "tilt": ("deg", 180.0 / math.pi),
    "holes": ("deg", 180.0 / math.pi),
    "frame_rotation": ("deg", 180.0 / math.pi),
}


@dataclass(frozen=True, slots=True)
class Errors:
    """Distances of markers and of the end from where they were predicted, over rests [mm].

    Attributes:
        markers: Root mean square over all markers.
        end_mean: Mean distance of the centre of the end ring.
        end_max: The largest.
    """

    markers: float
    end_mean: float
    end_max: float

    @classmethod
    def of(cls, residual: Array, end: NDArray[np.int64]) -> Errors:
        """Judge residuals (k, 3 n_markers) [m]; ``end`` says which markers are those of the end ring (3,)."""
        if not np.isfinite(residual).any():
            return cls(math.nan, math.nan, math.nan)
        markers = 1e3 * residual.reshape(len(residual), -1, 3)
        distance = np.linalg.norm(markers[:, end].mean(axis=1), axis=1)
        distance = distance[np.isfinite(distance)]
        size = np.linalg.norm(markers, axis=2)
        rms = float(np.sqrt(np.nanmean(size**2)))
        if not distance.size:
            return cls(rms, math.nan, math.nan)
        return cls(rms, float(distance.mean()), float(distance.max()))

    def as_json(self) -> dict[str, float | None]:
        """Return numbers, None for what is not known."""
        named = {"markers_rms": self.markers, "end_mean": self.end_mean, "end_max": self.end_max}
        return {key: _number(value) for key, value in named.items()}


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """What was found.

    Attributes:
        unknowns: What was looked for.
        fit: From all rests.
        drives: How the drives follow their set-points.
        rubbing: Friction of the cables.
        rests: How many rests there are.
        before: Errors of the robot as described, over all rests.
        after: Errors of what was found.
        held_out_before: Errors of the robot as described in the poses that are kept.
        held_out: Errors there of what was found from the others.
        seconds: Time that it took [s].
    """

    unknowns: Unknowns
    fit: Fit
    drives: DriveAnswer
    rubbing: Rubbing
    rests: int
    before: Errors
    after: Errors
    held_out_before: Errors
    held_out: Errors
    seconds: float

    @property
    def undetermined(self) -> list[str]:
        """What the data do not say."""
        return undetermined(self.unknowns, self.fit.covariance)

    @property
    def moving_together(self) -> list[str]:
        """What the data hardly tell from each other."""
        return moving_together(self.unknowns, self.fit.covariance)

    def values(self) -> dict[str, dict[str, Any]]:
        """Return value, standard deviation after and before, and unit of every unknown by name."""
        deviation, found = np.sqrt(np.diag(self.fit.covariance)), {}
        for group in self.unknowns.groups:
            unit, factor = UNITS.get(group.name, ("1", 1.0))
            for i in range(*self.unknowns.of(group.name).indices(len(self.unknowns))):
                found[self.unknowns.names[i]] = {
                    "value": factor * float(self.fit.x[i]),
                    "std": factor * float(deviation[i]),
                    "prior_std": factor * float(self.unknowns.prior[i]),
                    "unit": unit,
                }
        return found

    def as_json(self, robot: Path, calibration: Path) -> dict[str, Any]:
        """Return everything as plain data."""
        answer = {"lag_s": self.drives.lag, "dead_time_s": self.drives.dead_time}
        return {
            "status": "success" if self.fit.converged else "failed",
            "rests": self.rests,
            "error_before_mm": self.before.as_json(),
            "error_after_mm": self.after.as_json(),
            "held_out_before_mm": self.held_out_before.as_json(),
            "held_out_after_mm": self.held_out.as_json(),
            "drives": {key: _number(value) for key, value in answer.items()},
            "friction": {
                "coefficient": self.rubbing.coefficient.tolist(),
                "std": self.rubbing.deviation.tolist(),
                "pull_error_mm": _number(1e3 * self.rubbing.error),
                "pull_error_without_mm": _number(1e3 * self.rubbing.smooth_error),
            },
            "unidentifiable": self.undetermined,
            "correlated": self.moving_together,
            "misfit": self.fit.misfit,
            "iterations": self.fit.iterations,
            "seconds": self.seconds,
            "robot_file": str(robot),
            "calibration_file": str(calibration),
            "parameters": self.values(),
        }


def end_markers(tip_ring: int) -> NDArray[np.int64]:
    """Return which markers are those of the end ring (3,)."""
    return np.arange(RING) + RING * (tip_ring - 1)


def seen_only(unknowns: Unknowns, x: Array) -> Array:
    """Return x with all but what concerns the cameras at 0."""
    kept = np.zeros_like(x)
    for name in SEEN:
        kept[unknowns.of(name)] = x[unknowns.of(name)]
    return kept


def _number(value: float) -> float | None:
    """Return a number, None for one that is not known."""
    return value if math.isfinite(value) else None

"""What the stability analysis found, point by point, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcrctl.experiment.headline import count
from tcrctl.signals import Array


@dataclass(frozen=True, slots=True)
class StabilityPoint:
    """The loop linearised about its state before one control step.

    Attributes:
        t: Time of the step [s].
        inner: Largest |μ| of the inner iteration (42); NaN if there is none or it did not converge.
        eigenvalues: Largest ones of the step-to-step map, largest magnitude first (4,); NaN where not found.
        converged: They were found to the tolerance.
        saturated: A drive stood at its speed limit.
        limited: A limit (speed, stroke, tension) acted in the LCP; the map is the one with that limit active.
    """

    t: float
    inner: float
    eigenvalues: NDArray[np.complex128]
    converged: bool
    saturated: bool
    limited: bool

    @property
    def radius(self) -> float:
        """Spectral radius of the step-to-step map."""
        return float(np.abs(self.eigenvalues[0]))


@dataclass(frozen=True, slots=True)
class StabilityReport:
    """Result of an analysis.

    Attributes:
        spec: Name of the experiment.
        robot: Name of the robot.
        controller: Kind of the controller.
        period: Control period [s].
        states: Number of states of the closed loop.
        inner_iteration: What the controller iterates within a step; empty if nothing.
        points: The points, in time order.
        stopped: Why the run ended before its end; empty if it did not.
    """

    spec: str
    robot: str
    controller: str
    period: float
    states: int
    inner_iteration: str
    points: tuple[StabilityPoint, ...]
    stopped: str

    @property
    def worst(self) -> StabilityPoint | None:
        """Point of the largest spectral radius that was found; None if there is none."""
        found = [point for point in self.points if np.isfinite(point.radius)]
        return max(found, key=lambda point: point.radius, default=None)

    @property
    def exit_code(self) -> int:
        """0: every point was found, and is stable; 3: not; 4: the run was stopped."""
        if self.stopped:
            return 4
        stable = all(point.radius < 1.0 for point in self.points)  # NaN is not
        return 0 if stable and self.points else 3

    @property
    def reason(self) -> str:
        """Why the exit code is not 0, in words."""
        if self.stopped:
            return self.stopped
        if self.exit_code == 0:
            return ""
        unstable = sum(point.radius >= 1.0 for point in self.points)
        unknown = sum(not np.isfinite(point.radius) for point in self.points)
        parts = (
            [f"spectral radius >= 1 at {unstable} of {count(len(self.points), 'point')}"] if unstable else []
        )
        parts += [f"no eigenvalue found at {count(unknown, 'point')}"] if unknown else []
        return "; ".join(parts) or "the run was too short to be linearised"

    def frequency(self, point: StabilityPoint) -> float:
        """Return the largest eigenvalue's frequency [Hz], at most half the control rate: faster looks slower."""
        return float(abs(np.angle(point.eigenvalues[0])) / (2.0 * np.pi * self.period))

    def growth(self, point: StabilityPoint) -> float:
        """Factor by which the slowest-decaying or fastest-growing deviation changes in a second."""
        return float(point.radius ** (1.0 / self.period))

    def columns(self) -> dict[str, Array]:
        """Return every number but the further eigenvalues as one array (n_points,); the unit ends its name."""
        rows = self.points
        return {
            "t_s": np.array([p.t for p in rows]),
            "inner_mu_max": np.array([p.inner for p in rows]),
            "spectral_radius": np.array([p.radius for p in rows]),
            "growth_per_s": np.array([self.growth(p) for p in rows]),
            "frequency_hz": np.array([self.frequency(p) for p in rows]),
            "saturated": np.array([float(p.saturated) for p in rows]),
            "limited": np.array([float(p.limited) for p in rows]),
            "converged": np.array([float(p.converged) for p in rows]),
        }

    def as_json(self) -> dict[str, Any]:
        """Return the object of ``tcrctl stability --json``; numbers that are not finite become null."""
        columns, worst = self.columns(), self.worst
        points = [
            dict(zip(columns, map(_number, row), strict=True)) for row in zip(*columns.values(), strict=True)
        ]
        return {
            "spec": self.spec,
            "robot": self.robot,
            "controller": self.controller,
            "status": {0: "success", 3: "failed", 4: "aborted"}[self.exit_code],
            "reason": self.reason,
            "period_s": self.period,
            "states": self.states,
            "inner_iteration": {"what": self.inner_iteration, "max": _largest(columns["inner_mu_max"])},
            "closed_loop": {
                "max": _largest(columns["spectral_radius"]),
                "at_s": None if worst is None else worst.t,
                "frequency_hz": None if worst is None else self.frequency(worst),
                "growth_per_s": None if worst is None else self.growth(worst),
            },
            "points": points,
        }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _largest(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else None

"""Numbers of a run, gathered step by step in arrays of fixed size."""

from __future__ import annotations

import numpy as np

from tcrctl.experiment.singular import is_singular
from tcrctl.experiment.spread import spread
from tcrctl.experiment.summary import Measures, Numbers
from tcrctl.loop.measured_time import beyond
from tcrctl.numerics.rotation import angle_between, angles_from_normal
from tcrctl.signals import Array, StepRecord

#: Columns of the table that has one row per step.
_COLUMNS = (
    "error_x",
    "error_y",
    "error_z",
    "angle",
    "theta_x",
    "theta_y",
    "singular",
    "tension_min",
    "tension_max",
    "saturated",
    "control",
    "latency",
    "overrun",
    "busy",
    "lateness",
    "iterations",
    "unsolved",
)


class Metrics:
    """Takes the steps of one run; errors are those of the plant's true end, or of the estimate on a rig."""

    def __init__(self, steps: int, *, paced: bool) -> None:
        """Make room.

        Args:
            steps: Most steps that will come.
            paced: Whether the clock paces the run, so that there are deadlines to miss.
        """
        self._table = np.full((steps, len(_COLUMNS)), np.nan)
        self._steps = 0
        self._paced = paced
        self._period = 0.0

    def add(self, step: StepRecord) -> None:
        """Take a step."""
        self._period = step.period
        self._table[self._steps] = (
            *_errors(step),
            *_loads(step),
            *_timing(step, self._paced),
            *_solution(step),
        )
        self._steps += 1

    def measures(self) -> Measures:
        """Return everything that was measured so far."""
        table = dict(zip(_COLUMNS, self._table[: self._steps].T, strict=True))
        error = np.stack([table[f"error_{axis}"] for axis in "xyz"], axis=1)
        return Measures(
            steps=self._steps,
            duration_s=self._steps * self._period + self._beyond(table),
            position_error_mm=spread(1e3 * np.linalg.norm(error, axis=1), "max", "rms", "mean"),
            x_error_mm=spread(1e3 * error[:, 0], "max", "rms"),
            orientation_error_deg=spread(np.degrees(table["angle"]), "max", "rms"),
            theta_x_error_rad=spread(table["theta_x"], "max", "rms"),
            theta_y_error_rad=spread(table["theta_y"], "max", "rms"),
            theta_singular_fraction=_share(table["singular"]),
            tension_n=self._tension(table),
            saturated_fraction=float(np.mean(table["saturated"])) if self._steps else None,
            control_ms=spread(1e3 * table["control"], "p50", "p99", "max"),
            latency_ms=spread(1e3 * table["latency"][~np.isnan(table["latency"])], "p50", "p99", "max"),
            overruns=int(np.sum(table["overrun"])),
            inner_iterations=spread(table["iterations"], "mean", "max"),
            unconverged_steps=int(np.sum(table["unsolved"])),
        )

    def _beyond(self, table: dict[str, Array]) -> float:
        """Return how much longer the run took than its periods [s]; nothing if no clock paced it."""
        period = np.full(self._steps, self._period)
        return beyond(table["lateness"], table["busy"], period) if self._paced else 0.0

    def _tension(self, table: dict[str, Array]) -> Numbers:
        if not self._steps:
            return None
        return {"min": float(np.min(table["tension_min"])), "max": float(np.max(table["tension_max"]))}


def _errors(step: StepRecord) -> tuple[float, ...]:
    """Return the position error (3) [m], angle between the normals, errors of the angles of (45) [rad] or NaN.

    The last number is 1 where theta_x says nothing.
    """
    end = step.estimate if step.truth is None else step.truth
    x, y, z = (end.position - step.reference.position).tolist()
    wanted = step.reference.normal
    if wanted is None:
        return x, y, z, np.nan, np.nan, np.nan, np.nan
    is_x, is_y = angles_from_normal(end.normal)
    want_x, want_y = angles_from_normal(wanted)
    singular = float(np.any(is_singular(np.stack((end.normal, wanted)))))
    theta = _wrapped(is_x - want_x), _wrapped(is_y - want_y)
    return x, y, z, angle_between(end.normal, wanted), *theta, singular


def _share(flags: Array) -> float | None:
    """Return the part of the steps that are flagged, of those that know; None if none does."""
    known = flags[~np.isnan(flags)]
    return float(np.mean(known)) if known.size else None


def _wrapped(angle: float) -> float:
    """Return the angle within ±pi [rad]."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _loads(step: StepRecord) -> tuple[float, ...]:
    tension = step.estimate.tension if step.truth is None else step.truth.tension
    return float(np.min(tension)), float(np.max(tension)), float(np.any(step.info.saturated))


def _timing(step: StepRecord, paced: bool) -> tuple[float, ...]:
    took = step.timing
    busy = took.read + took.estimate + took.control + took.write
    overrun = paced and max(took.lateness, busy) > step.period
    return took.estimate + took.control, _latency(step, busy), float(overrun), busy, took.lateness


def _latency(step: StepRecord, busy: float) -> float:
    """Return the time from the camera frame's arrival to the drives' answer [s]; NaN if the step has no frame.

    The run's clock leaves out steps that were missed, so a step that begins later than a period begins on time.
    """
    raw, late = step.measurement.raw, step.timing.lateness
    if raw is None:
        return float("nan")
    begun = step.t + (late if late <= step.period else 0.0)
    return begun + busy - (step.measurement.t + raw.delay)


def _solution(step: StepRecord) -> tuple[float, ...]:
    return step.info.iterations, float(not (step.info.converged and step.estimate.converged))

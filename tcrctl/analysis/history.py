"""A run as time histories, read from its log: what figures and reports show.

log.mcap -> read_histories -> History: wanted and actual end pose, drives, tensions, timing, shapes, limits
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.analysis.limits import Limits, read_limits
from tcrctl.errors import InputError
from tcrctl.experiment.run_folder import log_in
from tcrctl.experiment.singular import is_singular
from tcrctl.log.reader import Log, read_log
from tcrctl.robot.module import SIZE
from tcrctl.signals import Array

_COLUMNS: Final = (
    "t",
    "period",
    "reference_position",
    "reference_normal",
    "measurement_t",
    "measurement_nodes",
    "measurement_valid",
    "measurement_raw_delay",
    "measurement_drive",
    "applied_speed",
    "info_saturated",
    "timing_read",
    "timing_estimate",
    "timing_control",
    "timing_write",
    "timing_lateness",
)
#: What a simulated plant knows exactly and an estimator finds; the truth is shown where there is one.
_STATE: Final = ("position", "normal", "tension", "q")
_AXES: Final = 3


@dataclass(frozen=True, slots=True)
class History:
    """One run over time; n steps, m cables. What a step lacks is NaN.

    Attributes:
        label: Name of the run in legends.
        log: The log it was read from.
        simulated: True if the state is that of the simulated plant, False if it is the estimate.
        t: Time of every step (n,) [s].
        period: Control period of every step (n,) [s].
        position: End position (n, 3) [m].
        normal: End normal (n, 3).
        wanted_position: Its reference (n, 3) [m].
        wanted_normal: Its reference (n, 3); NaN where the orientation is free.
        drive: Drive lengths measured (n, m) [m].
        speed: Drive speeds applied (n, m) [m/s].
        saturated: Which of them stood at a limit (n, m).
        tension: Cable tensions (n, m) [N].
        compute: Time that estimator and controller took (n,) [s].
        lateness: How late the step began (n,) [s]; 0 if nothing paced the run.
        age: How old the camera picture was at the step (n,) [s].
        answer: From the arrival of the camera frame to the answer of the drives (n,) [s]; NaN but on a rig.
        innovation: How far the markers seen are from the model that the estimator has moved there, rms (n,) [m];
            NaN in steps without a full state.
        shape_step: Steps whose shape is known (f,).
        shape: Node positions at these steps (f, n_nodes, 3) [m].
        limits: What had to be kept.
    """

    label: str
    log: Log
    simulated: bool
    t: Array
    period: Array
    position: Array
    normal: Array
    wanted_position: Array
    wanted_normal: Array
    drive: Array
    speed: Array
    saturated: NDArray[np.bool_]
    tension: Array
    compute: Array
    lateness: Array
    age: Array
    answer: Array
    innovation: Array
    shape_step: NDArray[np.int64]
    shape: Array
    limits: Limits

    @property
    def cables(self) -> tuple[str, ...]:
        """Name of every cable; numbers if the log knows none."""
        count = self.drive.shape[1]
        names = self.log.cable_names
        return names if len(names) == count else tuple(str(c + 1) for c in range(count))

    @property
    def position_error(self) -> Array:
        """Distance of the end from where it was wanted (n,) [m]."""
        distance: Array = np.linalg.norm(self.position - self.wanted_position, axis=1)
        return distance

    @property
    def tracks_orientation(self) -> bool:
        """Whether an end normal was wanted at any step."""
        return bool(np.isfinite(self.wanted_normal).all(axis=1).any())

    @property
    def orientation_error(self) -> Array:
        """Angle between the end normal and the one wanted (n,) [rad]."""
        apart, sum_ = self.normal - self.wanted_normal, self.normal + self.wanted_normal
        angle: Array = 2.0 * np.arctan2(np.linalg.norm(apart, axis=1), np.linalg.norm(sum_, axis=1))
        return angle

    @property
    def singular(self) -> NDArray[np.bool_]:
        """Where theta_x of (45) says nothing (n,): the end looks along x, or shall."""
        found: NDArray[np.bool_] = is_singular(self.normal) | is_singular(self.wanted_normal)
        return found

    @property
    def angles(self) -> Array:
        """theta_x and theta_y of the end, (45), without jumps (n, 2) [rad]."""
        return orientation_angles(self.normal)

    @property
    def wanted_angles(self) -> Array:
        """theta_x and theta_y of the reference (n, 2) [rad]."""
        return orientation_angles(self.wanted_normal)


def orientation_angles(normal: Array) -> Array:
    """Solve (45) for every normal.

    Args:
        normal: Unit normals over time (n, 3); rows of NaN stay NaN.

    Returns:
        theta_x and theta_y (n, 2) [rad]; theta_x is made continuous, so that it may leave ±pi.
    """
    # numba is slow to import, and few figures need it
    from tcrctl.numerics.rotation import angles_from_normal

    rows = np.ascontiguousarray(normal, dtype=np.float64)
    angles: Array = np.array([angles_from_normal(row) for row in rows]).reshape(-1, 2)
    known = np.isfinite(angles[:, 0])
    angles[known, 0] = np.unwrap(angles[known, 0])
    return angles


def read_histories(
    paths: Sequence[Path],
    *,
    labels: Sequence[str] = (),
    begin: float | None = None,
    end: float | None = None,
) -> list[History]:
    """Read runs, finished or not.

    Args:
        paths: Logs, or folders of runs.
        labels: Their names in legends, one each; found from the logs if left out.
        begin: First time shown [s].
        end: Last time shown [s].

    Raises:
        InputError: If a file is not a log, no step lies in the span, or the labels do not match the logs.
        LogError: If a log is damaged inside.
    """
    if labels and len(labels) != len(paths):
        raise InputError(f"{len(labels)} labels for {len(paths)} logs; give one per log, or none")
    logs = [read_log(log_in(path)) for path in paths]
    names = labels or _labels(logs)
    return [_history(log, name, begin, end) for log, name in zip(logs, names, strict=True)]


def _labels(logs: Sequence[Log]) -> list[str]:
    """Return shortest names that tell the runs apart: experiment, or with what was set, or with the run's id."""
    spec = [log.start.get("spec") or log.path.stem for log in logs]
    overrides = [" ".join(_overrides(log)) for log in logs]
    found = []
    for i, log in enumerate(logs):
        long = f"{spec[i]} {overrides[i]}".strip()
        alike = Counter(f"{a} {b}".strip() for a, b in zip(spec, overrides, strict=True))
        if spec.count(spec[i]) == 1:
            found.append(spec[i])
        elif alike[long] == 1:
            found.append(long)
        else:
            found.append(f"{long} ({log.start.get('run_id', str(i + 1))[-4:]})")
    return found


def _overrides(log: Log) -> list[str]:
    try:
        given = json.loads(log.start.get("overrides", "[]"))
    except (ValueError, RecursionError):
        return []
    return [str(item) for item in given] if isinstance(given, list) else []


def _history(log: Log, label: str, begin: float | None, end: float | None) -> History:
    state = [f"{part}_{name}" for part in ("truth", "estimate") for name in _STATE]
    columns = log.columns([*_COLUMNS, *state])
    t = columns["t"]
    shown = (t >= (-np.inf if begin is None else begin)) & (t <= (np.inf if end is None else end))
    if not shown.any():
        span = f"; it has steps from {t[0]:g} to {t[-1]:g} s" if len(t) else ""
        raise InputError(f"{log.path}: has no steps to show{span}")
    columns = {name: values[shown] for name, values in columns.items()}
    part = "truth" if "truth_position" in columns else "estimate"
    shape_step, shape = _shapes(columns[f"{part}_q"])
    return History(
        label=label,
        log=log,
        simulated=part == "truth",
        t=columns["t"],
        period=columns["period"],
        position=columns[f"{part}_position"],
        normal=columns[f"{part}_normal"],
        wanted_position=columns["reference_position"],
        wanted_normal=columns["reference_normal"],
        drive=columns["measurement_drive"],
        speed=columns["applied_speed"],
        saturated=columns["info_saturated"],
        tension=columns[f"{part}_tension"],
        compute=columns["timing_estimate"] + columns["timing_control"],
        lateness=columns["timing_lateness"],
        age=columns["t"] - columns["measurement_t"],
        answer=_answer(columns),
        innovation=_innovation(log, columns),
        shape_step=shape_step,
        shape=shape,
        limits=read_limits(log),
    )


def _answer(columns: dict[str, NDArray[Any]]) -> Array:
    """Return the time from a camera frame's arrival to the drives' answer (n,) [s]; NaN without frames."""
    delay = columns.get("measurement_raw_delay")
    if delay is None:
        return np.full(len(columns["t"]), np.nan)
    busy = np.sum([columns[f"timing_{part}"] for part in ("read", "estimate", "control", "write")], axis=0)
    late = columns["timing_lateness"]
    begun = columns["t"] + np.where(late <= columns["period"], late, 0.0)
    found: Array = begun + busy - (columns["measurement_t"] + delay)
    return found


def _innovation(log: Log, columns: dict[str, NDArray[Any]]) -> Array:
    """Return the rms distance of the markers seen from their nodes in the model (n,) [m]."""
    nodes, seen, q = columns["measurement_nodes"], columns["measurement_valid"], columns["estimate_q"]
    names = log.node_names
    rows = [names.index(name) for name in log.marker_names if name in names]
    if not rows or len(rows) != nodes.shape[1] or q.shape[1] != _AXES * len(names):
        return np.full(len(q), np.nan)
    apart = nodes - q.reshape(len(q), -1, _AXES)[:, rows]
    square = np.where(seen, np.einsum("nmx,nmx->nm", apart, apart), 0.0)
    with np.errstate(invalid="ignore"):
        found: Array = np.sqrt(square.sum(axis=1) / seen.sum(axis=1))
    return found


def _shapes(q: NDArray[Any]) -> tuple[NDArray[np.int64], Array]:
    """Return steps with a whole shape, and the shapes; a log need not have one at every step."""
    if not q.shape[1] or q.shape[1] % SIZE:
        return np.zeros(0, np.int64), np.zeros((0, 0, 3))
    known = np.flatnonzero(np.isfinite(q).all(axis=1))
    return known, q[known].reshape(len(known), -1, 3).astype(np.float64)

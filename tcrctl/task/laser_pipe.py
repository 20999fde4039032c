"""``kind: laser_pipe``: whether the beam goes through the pipes while the end rests at its targets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from tcrctl.log.event import Event
from tcrctl.numerics.rotation import angle_between, angles_from_normal
from tcrctl.signals import Array, Reference, StepRecord
from tcrctl.task import bore
from tcrctl.task.pipe import Pipe, pipe_from_markers
from tcrctl.task.settings import LaserPipeSettings
from tcrctl.trajectory.pose_path import MM, EndPose

#: How near the reference has to be to a target for the end to be wanted there [m], [rad].
AT_TARGET: Final = (1e-6, 1e-6)


@dataclass(slots=True)
class _Visit:
    """What happened while one target was the reference; errors are the largest ones."""

    steps: int = 0
    position_error: float = 0.0
    theta_error: Array = field(default_factory=lambda: np.zeros(2))
    clearance: float = math.inf
    spot_offset: float = 0.0


class LaserPipe:
    """Follows the beam, step by step."""

    def __init__(self, pipes: Sequence[Pipe], wanted: Sequence[EndPose], beam: float) -> None:
        """Prepare.

        Args:
            pipes: The pipes where they are.
            wanted: Their targets as the trajectory knows them.
            beam: Radius of the beam [m].
        """
        self._pipes = pipes
        self._wanted = wanted
        self._beam = beam
        self._period = 0.0
        self._visits = [_Visit() for _ in pipes]

    def observe(self, step: StepRecord) -> list[Event]:
        """Take a step; return an event when the beam begins or ceases to go through the pipe of a target."""
        self._period = step.period
        events = []
        for pipe, wanted, visit in zip(self._pipes, self._wanted, self._visits, strict=True):
            if _at(step.reference, wanted):
                passed = visit.clearance > 0.0 if visit.steps else None
                self._visit(step, pipe, visit)
                if (visit.clearance > 0.0) != passed:
                    events.append(_event(step.t, pipe, visit))
        return events

    def _visit(self, step: StepRecord, pipe: Pipe, visit: _Visit) -> None:
        end = step.estimate if step.truth is None else step.truth
        error = float(np.linalg.norm(end.position - pipe.target.position))
        visit.steps += 1
        visit.position_error = max(visit.position_error, error)
        visit.theta_error = np.maximum(visit.theta_error, _theta_error(end.normal, pipe.target))
        clear = bore.clearance(end.position, -end.normal, pipe.bore) - self._beam
        visit.clearance = min(visit.clearance, clear)
        spot = bore.off_axis(end.position, -end.normal, pipe.bore, pipe.bore.length + pipe.screen)
        visit.spot_offset = max(visit.spot_offset, spot)

    def result(self) -> dict[str, Any]:
        """Return ``targets``: for each pipe the worst while the end rested there; None if it never came so far."""
        return {
            "targets": [
                self._target(pipe, visit) for pipe, visit in zip(self._pipes, self._visits, strict=True)
            ]
        }

    def _target(self, pipe: Pipe, visit: _Visit) -> dict[str, Any]:
        came, passes = visit.steps > 0, 0.0 < visit.clearance < math.inf
        theta_x, theta_y = visit.theta_error.tolist()
        return {
            "name": pipe.name,
            "position_error_mm": visit.position_error / MM if came else None,
            "theta_x_error_rad": theta_x if came else None,
            "theta_y_error_rad": theta_y if came else None,
            "beam_passes": passes,
            "bore_clearance_mm": visit.clearance / MM if came else None,
            "spot_offset_mm": visit.spot_offset / MM if passes else None,
            "dwell_s": visit.steps * self._period,
        }


def _at(reference: Reference, wanted: EndPose) -> bool:
    distance, angle = AT_TARGET
    near = bool(np.linalg.norm(reference.position - wanted.position) < distance)
    if not near or reference.normal is None or wanted.normal is None:
        return near
    return angle_between(reference.normal, wanted.normal) < angle


def _theta_error(normal: Array, target: EndPose) -> Array:
    """Return the magnitudes of the errors of both angles of (45) (2,) [rad]."""
    assert target.normal is not None
    error = np.subtract(angles_from_normal(normal), angles_from_normal(target.normal))
    wrapped: Array = np.abs((error + np.pi) % (2.0 * np.pi) - np.pi)
    return wrapped


def _event(t: float, pipe: Pipe, visit: _Visit) -> Event:
    if visit.clearance > 0.0:
        room = f"{visit.clearance / MM:.2f} mm clear of its wall"
        return Event(t, "task", "info", f"at {pipe.name}: the beam goes through, {room}")
    return Event(t, "task", "warning", f"at {pipe.name}: the beam does not go through")


def build_laser_pipe(
    settings: LaserPipeSettings, targets: Mapping[str, EndPose], rod_diameter: float
) -> LaserPipe:
    """Build the task; see :class:`tcrctl.task.task.Kind`."""
    del rod_diameter
    pipes = [pipe_from_markers(pipe) for pipe in settings.pipes]
    return LaserPipe(pipes, [targets[pipe.name] for pipe in pipes], MM * settings.beam_mm / 2.0)

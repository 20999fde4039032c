"""Dynamic prediction: the model moves as the drives of a logged run did, from rest."""

from __future__ import annotations

import numpy as np

from tcrctl.errors import DivergenceError
from tcrctl.identify.log_data import Recording
from tcrctl.robot import dynamics
from tcrctl.robot.equations import make_workspace
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

#: Spectral radius of the integrator; the paper's.
SPECTRAL_RADIUS = 0.8


def marker_motion(robot: Robot, recording: Recording, h: float) -> Array:
    """Return the marker positions at the recording's frames (f, k, 3) [m].

    Args:
        robot: The robot; it starts at rest with the first drive lengths.
        recording: How the drives moved, and when the cameras looked.
        h: Largest internal step [s].

    Raises:
        NoEquilibriumError: If it has no shape at rest there.
        DivergenceError: If an internal step did not converge.
    """
    first = recording.drive[0]
    start = equilibrium(robot.model, first, robot.weight, robot.rest.q)
    state = dynamics.rest_state(start.q, first)
    work, scratch = make_workspace(robot.model), dynamics.make_scratch(robot.model)
    work.tension[:] = start.tension
    n, rule = len(recording.time), dynamics.Rule(h, SPECTRAL_RADIUS)
    q, v = np.empty((n, state.q.size)), np.empty((n, state.q.size))
    q[0], v[0] = state.q, state.v
    for k in range(1, n):
        duration = float(recording.time[k] - recording.time[k - 1])
        speed = (recording.drive[k] - recording.drive[k - 1]) / duration
        converged, residual, smallest, _ = dynamics.advance(
            robot.model, state, speed, duration, rule, robot.weight, work, scratch
        )
        if not converged:
            raise DivergenceError(float(recording.time[k]), residual, smallest)
        state.drive[:] = recording.drive[k]
        q[k], v[k] = state.q, state.v
    shapes = _between(recording.time, q, v, recording.frame_time)
    seen: Array = shapes.reshape(len(shapes), -1, 3)[:, recording.rows].mean(axis=2)
    return seen


def _between(time: Array, q: Array, v: Array, at: Array) -> Array:
    """Return cubic Hermite interpolation of q (n, c) with slopes v at instants ``at`` (f,) within ``time`` (n,)."""
    k = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    width = (time[k + 1] - time[k])[:, None]
    s = ((at - time[k])[:, None]) / width
    found: Array = (
        (1.0 + 2.0 * s) * (1.0 - s) ** 2 * q[k]
        + s * (1.0 - s) ** 2 * width * v[k]
        + s**2 * (3.0 - 2.0 * s) * q[k + 1]
        + s**2 * (s - 1.0) * width * v[k + 1]
    )
    return found

"""Whether the robot can follow a trajectory at all: quasi-static inverse along it, before anything moves.

    trajectory -> end poses every 0.25 s -> drives and tensions that hold them -> limits

At every sample Newton's method on the drives d brings the end to its place, the equilibrium being solved anew
in each iteration. With J = ∂y/∂q ∂q/∂d (11) the step is the smallest one that removes the error; what it leaves
free (robots with more cables than the pose has coordinates) is used to keep the tensions within their limits, not
to make them equal: a shortened robot under equal tensions buckles to one side when its end may tilt.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from tcrctl.elements import sliding_cable
from tcrctl.errors import InfeasibleError, NoEquilibriumError
from tcrctl.robot import pose
from tcrctl.robot.equilibrium import Equilibrium, equilibrium
from tcrctl.robot.module import FIXED
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array
from tcrctl.trajectory.trajectory import Trajectory, drives_of

#: Time between samples [s]; Newton starts from the sample before.
INTERVAL: Final = 0.25
#: Errors up to which a pose counts as reached [m], [1]; half a degree.
REACHED: Final = np.array([1e-3] * 3 + [np.radians(0.5)] * 3)
#: Newton ends when the error is this part of REACHED and the step would change no tension by more than PULL [N].
FINE: Final = 0.02
PULL: Final = 0.05
MAX_ITERATIONS: Final = 40
MAX_HALVINGS: Final = 6
#: Longest step of a drive in one iteration [m].
LONGEST_STEP: Final = 0.02
#: Directions of the drives that move the end less than this part of the strongest one count as free.
RANK: Final = 2e-3
#: Distance from floor and ceiling that cables keep where they can, as a part of the range between them.
COMFORT: Final = 0.02
#: Free directions are damped by these weights against tensions in N: of drives [N/m] and of the normal [N].
DRIVE_WEIGHT: Final = 200.0
TURN_WEIGHT: Final = 5.0


@dataclass(frozen=True, slots=True)
class DriveLimits:
    """What the drives and cables may do.

    Attributes:
        speed: Largest drive speed [m/s].
        floor: Lowest tension [N].
        ceiling: Highest tension [N].
    """

    speed: float
    floor: float
    ceiling: float

    @property
    def comfortable(self) -> tuple[float, float]:
        """Tensions that cables are brought back to where the pose leaves a choice [N]."""
        margin = COMFORT * (self.ceiling - self.floor)
        return self.floor + margin, self.ceiling - margin


@dataclass(frozen=True, slots=True)
class StaticPath:
    """How the robot follows a trajectory if it moves slowly.

    Attributes:
        time: Times of the samples (n,) [s].
        drive: Drive lengths (n, m) [m].
        tension: Cable tensions (n, m) [N].
        error: What is left of the pose error, in units of REACHED, largest component (n,).
    """

    time: Array
    drive: Array
    tension: Array
    error: Array

    @property
    def speed(self) -> Array:
        """Mean drive speeds between the samples (n - 1, m) [m/s]."""
        speed: Array = np.diff(self.drive, axis=0) / np.diff(self.time)[:, None]
        return speed

    def as_json(self) -> dict[str, dict[str, float]]:
        """Return the extremes for ``run --dry-run --json``."""
        return {
            "drive_mm": {"min": 1e3 * float(self.drive.min()), "max": 1e3 * float(self.drive.max())},
            "drive_speed_mm_s": {"max": 1e3 * float(np.abs(self.speed).max())},
            "tension_n": {"min": float(self.tension.min()), "max": float(self.tension.max())},
        }


class Held(NamedTuple):
    """Drives and the equilibrium that they hold."""

    drive: Array
    shape: Equilibrium


def check_feasibility(trajectory: Trajectory, robot: Robot, limits: DriveLimits) -> StaticPath:
    """Find the drives along a trajectory and hold them against all limits.

    Args:
        trajectory: What is wanted.
        robot: The robot that the controller knows.
        limits: What drives and cables may do; the stroke is the robot's.

    Raises:
        InfeasibleError: If something breaks a limit, with the first time at which it does.
    """
    times, m = _times(trajectory), robot.n_cables
    count = times.size
    position, normal = trajectory.position(times), trajectory.normal(times)
    held = Held(np.zeros(m), robot.rest)
    path = StaticPath(times, np.zeros((count, m)), np.zeros((count, m)), np.zeros(count))
    for i in range(count):
        target = position[i] if normal is None else np.concatenate((position[i], normal[i]))
        held, path.error[i] = hold_pose(robot, target, held, limits)
        path.drive[i], path.tension[i] = held.drive, held.shape.tension
        _check_sample(path, i, target.size, robot, limits)
    return path


def check_drives(trajectory: Trajectory, robot: Robot, limits: DriveLimits) -> StaticPath:
    """Hold the drive lengths that a trajectory gives against all limits.

    Args:
        trajectory: One that gives drive lengths.
        robot: The robot that the controller knows.
        limits: What drives and cables may do; the stroke is the robot's.

    Raises:
        InfeasibleError: If something breaks a limit, with the first time at which it does.
        NoEquilibriumError: If the robot has no stable shape with some of the drives.
    """
    times, m = _times(trajectory), robot.n_cables
    count = times.size
    drives = drives_of(trajectory, times)
    assert drives is not None
    path = StaticPath(times, drives, np.zeros((count, m)), np.zeros(count))
    q, before = robot.rest.q, np.zeros(m)
    for i, drive in enumerate(drives):
        shape = equilibrium(robot.model, drive, robot.weight, q, before)
        q, before, path.tension[i] = shape.q, drive, shape.tension
        _check_sample(path, i, 6, robot, limits)
    return path


def _times(trajectory: Trajectory) -> Array:
    """Return the times of the samples (n,) [s]; a wave says how close they must be to show its speed."""
    interval = min(INTERVAL, getattr(trajectory, "interval", INTERVAL))
    return np.linspace(0.0, trajectory.duration, 1 + max(1, int(np.ceil(trajectory.duration / interval))))


def hold_pose(robot: Robot, target: Array, start: Held, limits: DriveLimits) -> tuple[Held, float]:
    """Find the drives that hold an end pose.

    Args:
        robot: The robot.
        target: End position [m], and end normal if it matters (3,) or (6,).
        start: Drives and shape to start from.
        limits: Floor and ceiling of the tensions are used.

    Returns:
        The drives with their equilibrium, and the error left in units of REACHED.
    """
    held, error = start, _error(robot, target, start.shape)
    for _ in range(MAX_ITERATIONS):
        step, pulled = _newton_step(robot, target, held, limits)
        if error < FINE and pulled < PULL:
            break
        size = float(np.max(np.abs(step)))
        held, found = _descend(robot, target, held, step * min(1.0, LONGEST_STEP / size), error)
        if found is None:
            break
        error = found
    return held, error


def _pose(robot: Robot, shape: Equilibrium) -> Array:
    return np.concatenate((pose.position(shape.q, robot.tip), pose.normal(shape.q, robot.tip)))


def _error(robot: Robot, target: Array, shape: Equilibrium) -> float:
    left = (target - _pose(robot, shape)[: target.size]) / REACHED[: target.size]
    return float(np.max(np.abs(left)))


def _descend(robot: Robot, target: Array, held: Held, step: Array, error: float) -> tuple[Held, float | None]:
    """Go along ``step``, by half and half again, until the error shrinks or is small; None if it does not."""
    for _ in range(MAX_HALVINGS):
        drive = held.drive + step
        try:
            shape = equilibrium(robot.model, drive, robot.weight, held.shape.q, held.drive)
        except NoEquilibriumError:
            shape = None
        if shape is not None:
            found = _error(robot, target, shape)
            if found < max(error, FINE):
                return Held(drive, shape), found
        step = 0.5 * step
    return held, None


def _newton_step(robot: Robot, target: Array, held: Held, limits: DriveLimits) -> tuple[Array, float]:
    """Change of the drives (m,) [m] that removes the error and, where it may, brings tensions within limits.

    Also returns by how much the second part changes a tension at most [N].
    """
    rows = target.size
    scale = REACHED[:rows]
    response = pose.drive_gain(held.shape.q, held.shape.gain, robot.tip)
    tip, turn = response[:rows], TURN_WEIGHT * response[3:6]
    left = target - _pose(robot, held.shape)[:rows]
    U, s, Vt = np.linalg.svd(tip / scale[:, None])
    rank = int(np.count_nonzero(s > RANK * s[0]))
    step: Array = Vt[:rank].T @ (U[:, :rank].T @ (left / scale) / s[:rank])
    free = Vt[rank:].T
    if not free.size:
        return step, 0.0
    tension, gain = _tensions(robot, held)
    after = tension + gain @ step
    missing = np.clip(after, *limits.comfortable) - after
    system = np.vstack((gain @ free, turn @ free, DRIVE_WEIGHT * free))
    wanted = np.concatenate((missing, -turn @ step, np.zeros(robot.n_cables)))
    spare = free @ np.linalg.lstsq(system, wanted, rcond=None)[0]
    return step + spare, float(np.max(np.abs(gain @ spare)))


def _tensions(robot: Robot, held: Held) -> tuple[Array, Array]:
    """Return the tensions (m,) [N], negative for what a slack cable lacks, and their derivatives (m, m) [N/m]."""
    model, q = robot.model, held.shape.q
    length, G = np.zeros(robot.n_cables), np.zeros((robot.n_cables, q.size))
    sliding_cable.path_gradients(
        q, model.first_hole, model.hole_nodes, model.hole_weights, model.cables, length, G
    )
    stiffness = model.cables[:, sliding_cable.STIFFNESS]
    tension = stiffness * (length + held.drive - model.cables[:, sliding_cable.REST])
    gain = stiffness[:, None] * (np.eye(robot.n_cables) + G[:, 3 * FIXED :] @ held.shape.gain)
    return tension, gain


def _check_sample(path: StaticPath, i: int, rows: int, robot: Robot, limits: DriveLimits) -> None:
    """Raise the first limit that sample ``i`` breaks."""
    t, names = float(path.time[i]), robot.cable_names
    if path.error[i] > 1.0:
        turned = "" if rows == 3 else ", with 0.5 deg counted as 1 mm,"
        what = f"distance of the end from its {'place' if rows == 3 else 'pose'}{turned}"
        hint = "The place is out of reach: make the drawing smaller, or move it towards the rest position."
        raise InfeasibleError(t, what, path.error[i], 1.0, "mm", hint=hint)
    tension, drive = path.tension[i], path.drive[i]
    low, high = int(np.argmin(tension)), int(np.argmax(tension))
    if tension[low] < limits.floor:
        hint = "Move the path up (a shorter robot is tighter), or lower controller.tension.floor_n."
        raise InfeasibleError(t, f"tension of cable {names[low]}", tension[low], limits.floor, "N", hint=hint)
    if tension[high] > limits.ceiling:
        what = f"tension of cable {names[high]}"
        raise InfeasibleError(t, what, tension[high], limits.ceiling, "N", hint="Move the path down.")
    _check_stroke(t, drive, robot)
    if i > 0:
        speed = np.abs(drive - path.drive[i - 1]) / (path.time[i] - path.time[i - 1])
        fast = int(np.argmax(speed))
        if speed[fast] > limits.speed:
            what = f"speed of drive {names[fast]}"
            hint = "Lower the speed limits of the trajectory."
            raise InfeasibleError(t, what, 1e3 * speed[fast], 1e3 * limits.speed, "mm/s", hint=hint)


def _check_stroke(t: float, drive: Array, robot: Robot) -> None:
    low, high = robot.stroke
    for name, length in zip(robot.cable_names, drive.tolist(), strict=True):
        if not low <= length <= high:
            limit = low if length < low else high
            hint = "The robot's stroke_mm does not reach that far: make the path smaller."
            raise InfeasibleError(t, f"length of drive {name}", 1e3 * length, 1e3 * limit, "mm", hint=hint)

"""``kind: excitation``: an open-loop drive program from whose log robot, cameras and drives are identified.

    pulls of every cable, to and fro                           friction, play
    pose, shake that dies away, rest; the next pose ...        shapes: cameras, markers, tensions, springs
    the same in poses that nobody chose                        held out, to judge the result

After a shake a cable rests near the middle of what friction lets it, wherever it came from; after a pull it rests
at the edge. Shakes end on one side and on the other in turn, so that the play of the drives shows.
"""  # fmt: skip

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Final

import numpy as np

from tcrctl.errors import InputError, NoEquilibriumError
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import Robot
from tcrctl.robot.swing import signs
from tcrctl.signals import Array
from tcrctl.trajectory.drive_settings import DriveLegSettings, DrivesSettings
from tcrctl.trajectory.drives import DrivesTrajectory, build_drives
from tcrctl.trajectory.excitation_settings import DrawSettings, ExcitationSettings, ShakeSettings

#: Trials per pose that is drawn.
PATIENCE: Final = 200
HELD_OUT: Final = 1
#: Peak speed of a smooth leg over its mean speed.
TOP_OVER_MEAN: Final = 2.0


def build_excitation(settings: ExcitationSettings, robot: Robot) -> DrivesTrajectory:
    """Plan the program and find the end poses along it.

    Raises:
        InputError: If no taut poses can be drawn.
        NoEquilibriumError: If the model has no stable shape somewhere on the way.
    """
    return build_drives(program(settings, robot), robot)


def program(settings: ExcitationSettings, robot: Robot) -> DrivesSettings:
    """Write an excitation as drive lengths over time.

    Raises:
        InputError: If no taut poses can be drawn.
    """
    poses = poses_of(settings, robot)
    legs = [*_pulls(settings, robot.n_cables)]
    corners = np.vstack([np.zeros((2, robot.n_cables)), poses, np.zeros((1, robot.n_cables))])
    for k, (last, pose) in enumerate(pairwise(corners)):
        legs += _pose(settings, last, pose, signs(robot) * (-1.0) ** k)
    return DrivesSettings(
        kind="drives", legs=tuple(legs), lead_in_s=settings.lead_in_s, settle_s=settings.settle_s
    )


def poses_of(settings: ExcitationSettings, robot: Robot) -> Array:
    """Return all poses (n, m) [mm]; the last ``held_out`` of them are those that nobody chose."""
    drawn = np.random.default_rng([settings.seed, HELD_OUT])
    held_out = draw_poses(settings.draw, robot, settings.held_out, drawn)
    if settings.poses_mm:
        chosen = np.array(settings.poses_mm)
    else:
        chosen = draw_poses(settings.draw, robot, settings.poses, np.random.default_rng(settings.seed))
    return np.vstack([chosen, held_out])


def draw_poses(settings: DrawSettings, robot: Robot, count: int, random: np.random.Generator) -> Array:
    """Draw drive lengths (count, m) [mm] with which all cables are taut by the model.

    Raises:
        InputError: If there are hardly any.
    """
    found: list[Array] = []
    for _ in range(PATIENCE * max(count, 1)):
        if len(found) == count:
            break
        reach = random.uniform(*settings.reach_mm)
        pose = random.uniform(*settings.contraction_mm) + reach * random.uniform(-1.0, 1.0, robot.n_cables)
        if _taut(robot, pose, settings):
            found.append(pose)
    if len(found) < count:
        raise InputError(
            f"only {len(found)} of {count} poses of the excitation could be drawn with tensions of "
            f"{settings.floor_n:g} to {settings.ceiling_n:g} N",
            hint="Change trajectory.draw, or give poses_mm.",
        )
    return np.array(found).reshape(count, robot.n_cables)


def _taut(robot: Robot, pose: Array, settings: DrawSettings) -> bool:
    low, high = robot.stroke
    if pose.min() < 1e3 * low or pose.max() > 1e3 * high:
        return False
    try:
        tension = equilibrium(robot.model, 1e-3 * pose, robot.weight, robot.rest.q).tension
    except NoEquilibriumError:
        return False
    return bool(tension.min() >= settings.floor_n and tension.max() <= settings.ceiling_n)


def _pulls(settings: ExcitationSettings, cables: int) -> Iterator[DriveLegSettings]:
    pulls = settings.pulls
    for cable in range(cables):
        for length in (pulls.size_mm, 0.0, -pulls.size_mm, 0.0):
            pose = [0.0] * cables
            pose[cable] = length
            yield DriveLegSettings(drives_mm=tuple(pose), duration_s=pulls.move_s, dwell_s=pulls.rest_s)


def _pose(
    settings: ExcitationSettings, last: Array, pose: Array, directions: Array
) -> Iterator[DriveLegSettings]:
    needed = TOP_OVER_MEAN * float(np.abs(pose - last).max()) / settings.speed_mm_s
    yield DriveLegSettings(drives_mm=tuple(pose.tolist()), duration_s=max(settings.move_s, needed))
    for swing in swings(settings.shake):
        there = tuple((pose + swing * directions).tolist())
        yield DriveLegSettings(drives_mm=there, duration_s=settings.shake.swing_s, motion="constant_speed")
    yield DriveLegSettings(
        drives_mm=tuple(pose.tolist()), duration_s=settings.shake.swing_s, dwell_s=settings.rest_s
    )


def swings(shake: ShakeSettings) -> Array:
    """Return the swings of a shake (n,) [mm], to and fro, smaller and smaller."""
    k = np.arange(shake.swings)
    return np.asarray(shake.size_mm * (1.0 - k / shake.swings) * np.where(k % 2 == 0, 1.0, -1.0))

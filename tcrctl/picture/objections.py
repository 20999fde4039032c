"""The picture judged before the drives are armed: against the model's shape at the drives that were read.

frames at rest -> mean -> sides of rings -> joints between rings -> rings where the model has them
                                        -> model laid over the picture: mirrored, turned, tilted
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.errors import NoEquilibriumError
from tcrctl.picture.laid_over import LaidOver, laid_over
from tcrctl.picture.limits import limits_before_arming
from tcrctl.picture.settings import PictureSettings
from tcrctl.picture.shape import Anatomy, anatomy_of, shape_of
from tcrctl.picture.shares import Shares, joint_shares, side_shares
from tcrctl.picture.suspects import Verdict, named, wrong_markers, wrong_rings
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.module import RING, ring_rows
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Measurement

#: A mirror image that fits so many times better is one.
BETTER: Final = 2.0
#: Labels of a ring that is turned by more than this have moved on by a marker [rad].
MOVED_ON: Final = np.radians(60.0)


@dataclass(frozen=True, slots=True)
class Picture:
    """The mean of some frames of a robot at rest, and what the model says of it.

    Attributes:
        markers: (3 n, 3) [m].
        seen: (3 n,).
        model: Where the model has them at the drives that were read (3 n, 3) [m].
    """

    markers: Array
    seen: NDArray[np.bool_]
    model: Array


def objections(settings: PictureSettings, robot: Robot, frames: Sequence[Measurement]) -> list[str]:
    """Return everything that speaks against a picture; nothing if it can be believed.

    Args:
        settings: Section ``safety.picture``.
        robot: As the controller knows it.
        frames: Measurements of the robot at rest.
    """
    picture, anatomy = picture_of(robot, frames), anatomy_of(robot)
    if np.count_nonzero(picture.seen) < RING:
        return []  # nothing to judge; whether that is enough to arm is for others to say
    over = laid_over(picture.model[picture.seen], picture.markers[picture.seen])
    if _is_mirrored(picture, over):
        return ["the frame of the cameras is mirrored: an axis has the wrong sign"]
    verdict, sized = _suspects(settings, picture, anatomy)
    believed = picture.seen & ~verdict.out
    if not verdict.frame and np.count_nonzero(believed) >= 2 * RING:
        over = laid_over(picture.model[believed], picture.markers[believed])
    wrong = {suspect.ring for suspect in verdict.suspects}
    return [
        *_frame(settings, over),
        *(_hints(picture, over, sized) if wrong else ()),
        *named(verdict.suspects),
        *_places(settings, picture, over, wrong),
    ]


def picture_of(robot: Robot, frames: Sequence[Measurement]) -> Picture:
    """Return the mean of frames, and the model at the mean of their drives; at rest if it has no shape there."""
    valid = np.array([frame.valid for frame in frames])
    nodes = np.array([frame.nodes for frame in frames], dtype=float)
    counts = valid.sum(axis=0)
    mean = np.where(valid[:, :, None], nodes, 0.0).sum(axis=0) / np.maximum(counts, 1)[:, None]
    drive = np.mean([frame.drive for frame in frames], axis=0)
    q = robot.rest.q
    if drive.size == robot.n_cables:
        try:
            q = equilibrium(robot.model, drive, robot.weight, robot.rest.q).q
        except NoEquilibriumError:
            q = robot.rest.q
    return Picture(mean, counts > 0, q.reshape(-1, 3)[ring_rows(robot.n_modules)])


def _is_mirrored(picture: Picture, over: LaidOver) -> bool:
    mirror = laid_over(picture.model[picture.seen], picture.markers[picture.seen], mirror=True)
    return mirror.mirrored and over.rms > BETTER * mirror.rms


def _suspects(
    settings: PictureSettings, picture: Picture, anatomy: Anatomy
) -> tuple[Verdict, NDArray[np.bool_]]:
    """Return what is not believed, and which markers are seen in rings of the right size (3 n,)."""
    limits = limits_before_arming(settings)
    model = shape_of(anatomy, picture.model, np.ones_like(picture.seen))
    verdict = Verdict(np.zeros_like(picture.seen))

    def look(out: NDArray[np.bool_]) -> Shares:
        seen = shape_of(anatomy, picture.markers, picture.seen & ~out)
        return joint_shares(seen.since(model), limits, 0.0)

    change = shape_of(anatomy, picture.markers, picture.seen).since(model)
    wrong_markers(verdict, side_shares(change, limits, 0.0), joint_shares(change, limits, 0.0).worst)
    sized = picture.seen & ~verdict.out
    wrong_rings(verdict, look)
    return verdict, sized


def _hints(picture: Picture, over: LaidOver, sized: NDArray[np.bool_]) -> Iterator[str]:
    """Yield rings that look like others, or like themselves with labels that have moved on."""
    n = picture.seen.size // RING
    model = (picture.model @ over.rotation.T + over.translation).reshape(n, RING, 3)
    seen = picture.markers.reshape(n, RING, 3)
    for ring in np.flatnonzero(sized.reshape(n, RING).all(axis=1)).tolist():
        away = np.linalg.norm(model.mean(axis=1) - seen[ring].mean(axis=0), axis=1)
        nearest = int(np.argmin(away))
        if nearest != ring:
            yield f"ring {ring + 1} is seen where ring {nearest + 1} should be: are their labels exchanged?"
        elif abs(turn := laid_over(model[ring], seen[ring]).turn) > MOVED_ON:
            yield f"the labels of ring {ring + 1} are turned by {np.degrees(turn):.0f} deg"


def _places(settings: PictureSettings, picture: Picture, over: LaidOver, wrong: set[int]) -> Iterator[str]:
    """Yield rings that are far from the model laid over the picture, and not told of yet."""
    model = picture.model @ over.rotation.T + over.translation
    away = np.where(picture.seen, np.linalg.norm(picture.markers - model, axis=1), 0.0).reshape(-1, RING)
    for ring, distance in enumerate(1e3 * away.max(axis=1), start=1):
        if distance > settings.start_place_mm and ring not in wrong:
            limit = f"limit {settings.start_place_mm:g} mm"
            yield f"ring {ring} is {distance:.0f} mm from the model laid over the picture ({limit})"


def _frame(settings: PictureSettings, over: LaidOver) -> Iterator[str]:
    """Yield how the whole picture is turned against the model."""
    limit = settings.start_frame_deg
    for what, angle in (
        ("tilted", np.degrees(over.tilt)),
        ("turned about the vertical", np.degrees(over.turn)),
    ):
        if abs(angle) > limit:
            yield f"the frame of the cameras is {what} by {abs(angle):.0f} deg (limit {limit:g} deg)"

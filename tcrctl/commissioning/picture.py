"""What ``tcrctl rig check`` says of the cameras' picture: what a run would, before it arms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from tcrctl.picture.objections import objections
from tcrctl.picture.settings import PictureSettings
from tcrctl.plant.rig.devices import DriveStatus, Sighting
from tcrctl.plant.rig.finding import NOT_READY, Finding
from tcrctl.robot.robot import Robot
from tcrctl.signals import Measurement


def judged_picture(robot: Robot, seen: Sequence[Sighting], status: DriveStatus) -> Iterator[Finding]:
    """Hold frames against the model at the drives that were read, within the limits that are usual.

    Args:
        robot: As its file says.
        seen: Frames of the robot at rest, at least one.
        status: What the drives say of themselves.

    Yields:
        A line for everything that is not believed, with the ring, the marker or the frame; or one that says that
        nothing speaks against it, or why that is not known.
    """
    if not status.zeroed:
        yield Finding("picture", "not judged: where the drives are is not known before they are zeroed")
        return
    drive = 1e-6 * np.asarray(status.position, dtype=float)
    frames = [Measurement(sighting.taken, sighting.nodes, sighting.valid, drive) for sighting in seen]
    found = objections(PictureSettings(), robot, frames)
    for text in found:
        yield Finding("picture", text, NOT_READY)
    if not found:
        yield Finding("picture", "rings and frame are where the model has them")

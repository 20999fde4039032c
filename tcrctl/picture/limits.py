"""How much a side of a ring and a joint between rings may have changed: sideways, along the body and in twist.

Cables pull across a joint that bends: sideways its ring moves by about 3.5 mm per sine of the angle. Along the body
all joints give way together as cables are pulled, each by its own stiffness; what counts is the difference to the
joints beside it. Measured on simulated plants with everything of docs/reality.md, largest size: sideways rings are
up to 1.2 mm and 0.03 mm per degree beside that, along the body up to 1.2 mm and half of what the joints beside it
have moved. Where short cables end in a robot that looks sideways, joints bend by 16 degrees and rings move by 3.8
mm beside that. So beyond 6 degrees the limit grows faster, but for the last ring, on which nothing hangs: 1.6 mm
at 17 degrees. Noise of markers beyond the usual 50 um comes on top.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from tcrctl.picture.settings import PictureSettings

#: Sideways change per sine of the bending angle, and by how much the limit grows with it [m].
PULL: Final = -3.5e-3
PER_BEND: Final = 0.03e-3 * 180.0 / np.pi
#: Sine of the angle beyond which it grows faster, and by how much [m].
SHARP: Final = float(np.sin(np.radians(6.0)))
PER_SHARP: Final = 0.25e-3 * 180.0 / np.pi
#: Difference along the body as a share of what the joints beside it have moved.
ALONG: Final = 0.55
#: Largest change along the body that a joint can have [m].
GIVE: Final = 0.01
#: Noise of markers that the limits allow for [m].
USUAL: Final = 50e-6
#: Standard deviations that more noise may reach, and what of a marker's noise arrives in an offset and a side.
SIGMAS: Final = 6.0
IN_OFFSET: Final = 1.5
IN_SIDE: Final = 1.5
#: The same in a twist, for rings of about 35 mm [rad/m].
IN_TWIST: Final = 30.0


class Limits(NamedTuple):
    """Largest changes [m], [rad]; those of the first joint, between base and first ring, tell the frame.

    Attributes:
        side, joint, twist: See ``PictureSettings``.
        frame_joint, frame_twist: The same for the first joint.
        pull: Sideways change per sine of the bending angle [m].
        per_bend: Growth of the sideways limits with it [m].
        per_sharp: Growth with what of it is beyond ``SHARP``, but for the last joint [m].
        along: Growth of the limit along the body with what the joints beside it have moved; 0: changes along the
            body count by themselves, not against those of the joints beside it.
    """

    side: float
    joint: float
    twist: float
    frame_joint: float
    frame_twist: float
    pull: float
    per_bend: float
    per_sharp: float
    along: float


def limits_in_motion(settings: PictureSettings) -> Limits:
    """Return the limits of changes since the start."""
    return Limits(
        1e-3 * settings.side_mm,
        1e-3 * settings.joint_mm,
        np.radians(settings.twist_deg),
        1e-3 * settings.frame_mm,
        np.radians(settings.frame_deg),
        PULL,
        PER_BEND,
        PER_SHARP,
        ALONG,
    )


def limits_before_arming(settings: PictureSettings) -> Limits:
    """Return the limits of differences to the model."""
    return Limits(
        1e-3 * settings.start_side_mm,
        1e-3 * settings.start_joint_mm,
        np.radians(settings.start_twist_deg),
        1e-3 * settings.start_frame_mm,
        np.radians(settings.start_frame_deg),
        0.0,
        0.0,
        0.0,
        0.0,
    )

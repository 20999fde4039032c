"""How much a side of a ring and a joint between rings may have changed: sideways, along the body and in twist.

Cables pull across a joint that bends: sideways its ring moves by 3 mm per sine of the angle, and by more as the
cables are tightened, which the give of the joint along the body tells: by 0.75 of it per sine. What is left
grows with the give, too, because no two springs of a joint are alike. Along the body all joints give way
together as cables are pulled, each by its own stiffness; what counts is the difference to the joints beside it.

Measured on 21 simulated plants with everything of docs/reality.md, of robots that contract by a quarter and
joints that bend by up to 40 degrees: sideways 2.5 mm are left beside a pull of 4.3 mm, along the body joints
give 14 mm and differ by 4.7 mm from those beside them. The largest is 0.92 of its limit here, joints that bend
by more than 6 degrees having more room, but for the last one, on which nothing hangs. Noise of markers beyond
the usual 50 um comes on top.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from tcrctl.picture.settings import PictureSettings

#: Sideways change per sine of the bending angle [m], and what the give of the joint, which is negative, adds to it.
PULL: Final = -3.0e-3
PULL_PER_GIVE: Final = 0.75
#: By how much the limit sideways grows with the give, and with the sine of the angle [m].
PER_GIVE: Final = 0.06
PER_BEND: Final = 0.03e-3 * 180.0 / np.pi
#: Sine of the angle beyond which it grows faster, and by how much [m].
SHARP: Final = float(np.sin(np.radians(6.0)))
PER_SHARP: Final = 0.25e-3 * 180.0 / np.pi
#: Difference along the body as a share of what the joints beside it have moved.
ALONG: Final = 0.55
#: Largest change along the body that a joint can have [m].
GIVE: Final = 0.015
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
        pull_per_give: What is added to it per give of the joint along the body.
        per_give: Growth of the sideways limits with the give.
        per_bend: Growth of the sideways limits with the sine of the bending angle [m].
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
    pull_per_give: float
    per_give: float
    per_bend: float
    per_sharp: float
    along: float


def limits_in_motion(settings: PictureSettings) -> Limits:
    """Return the limits of changes since the start."""
    return Limits(
        side=1e-3 * settings.side_mm,
        joint=1e-3 * settings.joint_mm,
        twist=np.radians(settings.twist_deg),
        frame_joint=1e-3 * settings.frame_mm,
        frame_twist=np.radians(settings.frame_deg),
        pull=PULL,
        pull_per_give=PULL_PER_GIVE,
        per_give=PER_GIVE,
        per_bend=PER_BEND,
        per_sharp=PER_SHARP,
        along=ALONG,
    )


def limits_before_arming(settings: PictureSettings) -> Limits:
    """Return the limits of differences to the model."""
    return Limits(
        side=1e-3 * settings.start_side_mm,
        joint=1e-3 * settings.start_joint_mm,
        twist=np.radians(settings.start_twist_deg),
        frame_joint=1e-3 * settings.start_frame_mm,
        frame_twist=np.radians(settings.start_frame_deg),
        pull=0.0,
        pull_per_give=0.0,
        per_give=0.0,
        per_bend=0.0,
        per_sharp=0.0,
        along=0.0,
    )

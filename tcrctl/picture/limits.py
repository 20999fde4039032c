"""How much a joint may have changed: shares of their limits, sideways, along the body and in twist.

Cables pull across a joint that bends: sideways its ring moves by about 3.5 mm per sine of the angle. Along the body
all joints give way together as cables are pulled, each by its own stiffness; what counts is the difference to the
joints beside it. Measured on simulated plants with everything of docs/reality.md, largest size: sideways rings are
up to 1.2 mm and 0.03 mm per degree beside that, along the body up to 1.2 mm and half of what the joints beside it
have moved. Noise of markers beyond the usual 50 um comes on top.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from tcrctl.picture.settings import PictureSettings
from tcrctl.picture.shape import Shape
from tcrctl.signals import Array

#: Sideways change per sine of the bending angle, and by how much the limit grows with it [m].
PULL: Final = -3.5e-3
PER_BEND: Final = 0.03e-3 * 180.0 / np.pi
#: Difference along the body as a share of what the joints beside it have moved.
ALONG: Final = 0.5
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
    )


class Shares(NamedTuple):
    """Changes of every joint as shares of their limits (n,); 0 where nothing is known.

    Sideways and along the body count together, as a ring moves in one direction.
    """

    sideways: Array
    along: Array
    twist: Array

    def over(self, factors: Array) -> Shares:
        """Return the shares of limits that are multiplied by factors (n,)."""
        return Shares(self.sideways / factors, self.along / factors, self.twist / factors)

    @property
    def worst(self) -> Array:
        """The largest of every joint (n,)."""
        return np.asarray(np.maximum(np.hypot(self.sideways, self.along), self.twist))


def side_shares(change: Shape, limits: Limits, noise: float) -> Array:
    """Return the changes of sides as shares of their limit (n, 3); 0 where nothing is known."""
    return _known(np.abs(change.side) / (limits.side + IN_SIDE * _room(noise)))


def joint_shares(change: Shape, limits: Limits, noise: float) -> Shares:
    """Return the changes of joints as shares of their limits.

    Args:
        change: Since the start, or against a model.
        limits: Their limits.
        noise: Standard deviation of a marker's coordinates [m].
    """
    n = change.twist.size
    first = np.arange(n) == 0
    room = IN_OFFSET * _room(noise)
    bent = limits.per_bend * np.linalg.norm(change.bend, axis=1)
    sideways = np.linalg.norm(change.offset[:, :2] - limits.pull * change.bend, axis=1)
    z = change.offset[:, 2]
    expected, moved = _beside(z) if limits.along else (np.zeros(n), np.zeros(n))
    twist = np.where(first, limits.frame_twist, limits.twist) + IN_TWIST * _room(noise)
    return Shares(
        _known(sideways / (np.where(first, limits.frame_joint, limits.joint) + bent + room)),
        _known(np.abs(z - expected) / (limits.joint + limits.along * moved + room)),
        _known(np.abs(change.twist) / twist),
    )


def _beside(z: Array) -> tuple[Array, Array]:
    """Return what joints beside each say that it has moved along the body, and the largest that they have (n,) [m].

    Between two joints their mean, at an end the line through the next two; NaN where one of these is not known:
    where cables end, one joint alone says little of the next. A joint that has moved by more than it can says no
    more.
    """
    n, nan = z.size, np.full(1, np.nan)
    z = np.clip(z, -GIVE, GIVE)
    before, after = np.concatenate([nan, z[:-1]]), np.concatenate([z[1:], nan])
    expected = 0.5 * (before + after)
    if n > 2:
        expected[0], expected[-1] = 2.0 * z[1] - z[2], 2.0 * z[-2] - z[-3]
    return expected, np.fmax(np.abs(before), np.abs(after))


def _room(noise: float) -> float:
    """Return what unusual noise of a marker may reach [m]."""
    return SIGMAS * max(0.0, noise - USUAL)


def _known(shares: Array) -> Array:
    return np.asarray(np.where(np.isnan(shares), 0.0, shares))

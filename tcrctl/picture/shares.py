"""Changes of a picture as shares of their limits; see :mod:`tcrctl.picture.limits`. 0 where nothing is known."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.numerics.kernel import kernel, part
from tcrctl.picture.kernel import Shape, change_since
from tcrctl.picture.limits import GIVE, IN_OFFSET, IN_SIDE, IN_TWIST, SHARP, SIGMAS, USUAL, Limits
from tcrctl.signals import Array


class Shares(NamedTuple):
    """Changes of every joint as shares of their limits (n,).

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


def joint_shares(change: Shape, limits: Limits, noise: float) -> Shares:
    """Return the changes of joints as shares of their limits.

    Args:
        change: Since the start, or against a model.
        limits: Their limits.
        noise: Standard deviation of a marker's coordinates [m].
    """
    return Shares(*joints(change, limits, noise))


@kernel(error_model="numpy")
def side_shares(change: Shape, limits: Limits, noise: float) -> Array:
    """Return the changes of sides as shares of their limit (n, 3)."""
    limit, n = limits.side + IN_SIDE * _room(noise), len(change.side)
    shares = np.empty((n, 3))
    for i in range(n):
        for k in range(3):
            shares[i, k] = _known(abs(change.side[i, k]) / limit)
    return shares


@kernel(error_model="numpy")
def joints(change: Shape, limits: Limits, noise: float) -> tuple[Array, Array, Array]:
    """Return what :func:`joint_shares` holds."""
    n, room = len(change.twist), IN_OFFSET * _room(noise)
    sideways, along, twist = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        angle = limits.frame_twist if i == 0 else limits.twist
        sideways[i] = _known(_share_sideways(change, i, limits, room))
        along[i] = _known(_share_along(change.offset[:, 2], i, limits, room))
        twist[i] = _known(abs(change.twist[i]) / (angle + IN_TWIST * _room(noise)))
    return sideways, along, twist


@part(error_model="numpy")
def _share_sideways(change: Shape, i: int, limits: Limits, room: float) -> float:
    """Return the change of joint ``i`` sideways, beside where cables pull it, as a share of its limit."""
    x, y, z = change.offset[i]
    give, bend = _given(z), change.bend[i]
    sine = np.hypot(bend[0], bend[1])
    sharp = max(0.0, sine - SHARP) if i < len(change.twist) - 1 else 0.0
    joint = limits.frame_joint if i == 0 else limits.joint
    allowed = joint + limits.per_give * abs(give) + limits.per_bend * sine + limits.per_sharp * sharp + room
    pull = limits.pull + limits.pull_per_give * give
    return float(np.hypot(x - pull * bend[0], y - pull * bend[1]) / allowed)


@part(error_model="numpy")
def _share_along(z: Array, i: int, limits: Limits, room: float) -> float:
    """Return the change of joint ``i`` along the body as a share of its limit; NaN if it is not known.

    Where a joint beside it is not known, those further on stand for it; but where cables end these say little, so a
    joint that gives no more than it can is right there in any case.
    """
    if not limits.along:
        return float(abs(z[i]) / (limits.joint + room))
    expected, moved, near = _beside(z, i)
    share = float(abs(z[i] - expected) / (limits.joint + limits.along * moved + room))
    return share if near else np.fmin(share, abs(z[i]) / (limits.joint + GIVE + room))


@part(error_model="numpy")
def _beside(z: Array, i: int) -> tuple[float, float, bool]:
    """Return what the joints beside one say that it has moved along the body, and the largest that they have [m].

    Between two joints that are known what lies between them, at an end the line through the next two; NaN if there
    are none. A joint that has moved by more than it can says no more. Third: these joints are the next ones.
    """
    one, other = _nearest(z, i, -1), _nearest(z, i, 1)
    if one < 0:
        one, other = other, _nearest(z, other, 1)
    elif other < 0:
        other = _nearest(z, one, -1)
    if one < 0 or other < 0:
        return np.nan, np.nan, False
    there, further = _given(z[one]), _given(z[other])
    expected = there + (further - there) / (other - one) * (i - one)
    next_to = abs(one - i) == 1
    if (i - one) * (i - other) < 0:
        return expected, max(abs(there), abs(further)), next_to and abs(other - i) == 1
    return expected, abs(there), next_to and (i == 0 or i == len(z) - 1)


@part(error_model="numpy")
def _nearest(z: Array, i: int, way: int) -> int:
    """Return the next joint on one side of a joint that is known; -1 if none is."""
    j = i + way
    while 0 <= j < len(z):
        if z[j] == z[j]:
            return j
        j += way
    return -1


@part(error_model="numpy")
def _given(z: float) -> float:
    return min(max(z, -GIVE), GIVE) if z == z else np.nan


@part(error_model="numpy")
def _room(noise: float) -> float:
    """Return what unusual noise of a marker may reach [m]."""
    return SIGMAS * max(0.0, noise - USUAL)


@part(error_model="numpy")
def _known(share: float) -> float:
    return share if share == share else 0.0


@kernel(error_model="numpy")
def is_strange(start: Shape, now: Shape, limits: Limits, noise: float) -> bool:
    """Return whether anything has changed by more than it can since the start."""
    change, worst = change_since(start, now), 0.0
    for share in side_shares(change, limits, noise).ravel():
        worst = max(worst, share)
    sideways, along, twist = joints(change, limits, noise)
    for i in range(len(twist)):
        worst = max(worst, np.hypot(sideways[i], along[i]), twist[i])
    return worst > 1.0

"""Changes of a picture as shares of their limits; see :mod:`tcrctl.picture.limits`. 0 where nothing is known."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

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


@njit(cache=True, error_model="numpy")
def side_shares(change: Shape, limits: Limits, noise: float) -> Array:
    """Return the changes of sides as shares of their limit (n, 3)."""
    limit, n = limits.side + IN_SIDE * _room(noise), len(change.side)
    shares = np.empty((n, 3))
    for i in range(n):
        for k in range(3):
            shares[i, k] = _known(abs(change.side[i, k]) / limit)
    return shares


@njit(cache=True, error_model="numpy")
def joints(change: Shape, limits: Limits, noise: float) -> tuple[Array, Array, Array]:
    """Return what :func:`joint_shares` holds."""
    n, room = len(change.twist), IN_OFFSET * _room(noise)
    sideways, along, twist = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        x, y, z = change.offset[i]
        bend = change.bend[i]
        joint, angle = (limits.frame_joint, limits.frame_twist) if i == 0 else (limits.joint, limits.twist)
        sine = np.hypot(bend[0], bend[1])
        sharp = max(0.0, sine - SHARP) if i < n - 1 else 0.0
        allowed = joint + limits.per_bend * sine + limits.per_sharp * sharp + room
        sideways[i] = _known(np.hypot(x - limits.pull * bend[0], y - limits.pull * bend[1]) / allowed)
        expected, moved = _beside(change.offset[:, 2], i) if limits.along else (0.0, 0.0)
        more = limits.along * moved
        if expected != expected:  # nothing is known beside it: but no joint gives more than it can
            expected, more = 0.0, GIVE
        along[i] = _known(abs(z - expected) / (limits.joint + more + room))
        twist[i] = _known(abs(change.twist[i]) / (angle + IN_TWIST * _room(noise)))
    return sideways, along, twist


@njit(cache=True, error_model="numpy")
def _beside(z: Array, i: int) -> tuple[float, float]:
    """Return what the joints beside one say that it has moved along the body, and the largest that they have [m].

    Between two joints their mean, at an end the line through the next two; NaN where one of these is not known:
    where cables end, one joint alone says little of the next. A joint that has moved by more than it can says no
    more.
    """
    last = len(z) - 1
    if last < 2:
        return np.nan, np.nan
    before, after = _given(z[max(i - 1, 0)]), _given(z[min(i + 1, last)])
    if 0 < i < last:
        return 0.5 * (before + after), np.fmax(abs(before), abs(after))
    beside = after if i == 0 else before
    return 2.0 * beside - _given(z[2 if i == 0 else last - 2]), abs(beside)


@njit(cache=True, error_model="numpy")
def _given(z: float) -> float:
    return min(max(z, -GIVE), GIVE) if z == z else np.nan


@njit(cache=True, error_model="numpy")
def _room(noise: float) -> float:
    """Return what unusual noise of a marker may reach [m]."""
    return SIGMAS * max(0.0, noise - USUAL)


@njit(cache=True, error_model="numpy")
def _known(share: float) -> float:
    return share if share == share else 0.0


@njit(cache=True, error_model="numpy")
def is_strange(start: Shape, now: Shape, limits: Limits, noise: float) -> bool:
    """Return whether anything has changed by more than it can since the start."""
    change = change_since(start, now)
    if (side_shares(change, limits, noise) > 1.0).any():
        return True
    sideways, along, twist = joints(change, limits, noise)
    return bool((np.maximum(np.hypot(sideways, along), twist) > 1.0).any())

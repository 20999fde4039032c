"""How much a ring may move sideways: a little where a robot is straight, more where its joints bend sharply."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.picture.kernel import Shape
from tcrctl.picture.limits import PULL, limits_in_motion
from tcrctl.picture.settings import PictureSettings
from tcrctl.picture.shares import joint_shares

LIMITS = limits_in_motion(PictureSettings())


def sideways_share(bend_deg, beside_mm, joint=1):
    """The share of the limit of one of three joints that bends, its ring so far beside where cables pull it."""
    sine = np.sin(np.radians(bend_deg))
    offset, bend = np.zeros((3, 3)), np.zeros((3, 2))
    offset[joint, :2], bend[joint] = (PULL * sine, 1e-3 * beside_mm), (sine, 0.0)
    change = Shape(np.zeros((3, 3)), offset, np.zeros(3), bend)
    return joint_shares(change, LIMITS, 0.0).sideways[joint]


@pytest.mark.parametrize(("bend_deg", "beside_mm"), [(2, 1.0), (5, 1.4), (8, 2.0), (12, 2.7), (16, 3.8)])
def test_what_healthy_robots_do_is_no_objection(bend_deg, beside_mm):
    assert sideways_share(bend_deg, beside_mm) < 0.9


@pytest.mark.parametrize(("bend_deg", "beside_mm"), [(0, 2.3), (3, 2.5), (6, 2.7), (16, 6.0)])
def test_what_they_never_do_is_one(bend_deg, beside_mm):
    assert sideways_share(bend_deg, beside_mm) > 1.0


def test_the_limit_never_falls_as_a_joint_bends():
    shares = [sideways_share(bend, 2.0) for bend in np.linspace(0.0, 25.0, 200)]
    assert (np.diff(shares) <= 0.0).all()


def test_the_last_ring_on_which_nothing_hangs_has_less_room():
    assert sideways_share(16, 1.6, joint=2) < 0.9
    assert sideways_share(16, 3.0, joint=2) > 1.0

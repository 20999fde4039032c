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


def moved_along(give_mm, sideways_mm=0.0, bend_deg=0.0):
    """The change of joints that give along the body and bend; NaN where the rings are not seen."""
    give = 1e-3 * np.array(give_mm, dtype=float)
    sine = np.where(np.isnan(give), np.nan, np.sin(np.radians(bend_deg)))
    offset = np.stack([1e-3 * sideways_mm + 0.0 * give, 0.0 * give, give], axis=1)
    n = len(give)
    return Shape(np.zeros((n, 3)), offset, np.zeros(n), np.stack([sine, 0.0 * sine], axis=1))


@pytest.mark.parametrize(
    "give_mm",
    [
        [-11.3, -13.0, -11.3, np.nan, np.nan, -9.8, -13.7, -11.3, -8.3, -7.4, -9.3, -8.7, -9.4],
        [np.nan, np.nan, np.nan, -11.8, np.nan, np.nan, -14.2, -11.8, -8.7, -7.7, -9.4, -8.7, -9.4],
        [-10.5, -10.5, -9.4, -10.3, np.nan, np.nan, -9.2, -12.1, np.nan, np.nan, -7.3, -8.0, np.nan],
        [np.nan] * 7 + [-11.1, -6.5, -7.7, -7.7, -7.5, -6.8],
        [-7.0, -7.7, -7.5, -7.9, -7.7, np.nan, np.nan, -6.6, -2.8, -3.7, np.nan, np.nan, np.nan],
        [np.nan] * 12 + [-14.1],
    ],
)
def test_joints_that_give_way_together_are_no_objection_whoever_of_them_is_seen(give_mm):
    """As measured where a robot contracts by a quarter and some markers are lost."""
    assert joint_shares(moved_along(give_mm), LIMITS, 0.0).along.max() < 0.9


@pytest.mark.parametrize("joint", [0, 6, 12])
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_joint_that_gives_way_alone_is_one_also_beside_joints_that_are_not_seen(joint, way):
    give = np.full(13, -11.0)
    give[joint] += 12.0 * way
    give[[2, 3, 8, 9]] = np.nan
    assert joint_shares(moved_along(give), LIMITS, 0.0).along[joint] > 1.0


@pytest.mark.parametrize("give_mm", [0.0, -6.0, -12.0])
def test_tight_cables_pull_a_joint_that_bends_further_sideways(give_mm):
    """3 mm per sine of the angle, and three quarters of the give; the other way it is no pull."""
    bend_deg = 20.0
    pulled = (-3.0 + 0.75 * give_mm) * np.sin(np.radians(bend_deg))
    give = np.full(5, give_mm)
    where_pulled = joint_shares(moved_along(give, pulled, bend_deg), LIMITS, 0.0).sideways
    against = joint_shares(moved_along(give, -pulled, bend_deg), LIMITS, 0.0).sideways
    assert where_pulled.max() < 1e-9
    assert against[-1] > (0.7 if give_mm == 0.0 else 1.0)

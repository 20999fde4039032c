"""Robots that the tests share; without MuJoCo they are skipped."""

from __future__ import annotations

import pytest

pytest.importorskip("mujoco", reason="needs pip install mujoco")

from tcrctl.extend import Robot
from tcrctl.robot.description import load_robot
from tcrctl.robot.robot import build_robot


@pytest.fixture(scope="session", params=["tcr600", "tcr700", "tcr5x4"])
def robot(request: pytest.FixtureRequest) -> Robot:
    """Every shipped robot."""
    return build_robot(load_robot(request.param))


@pytest.fixture(scope="session")
def tcr700() -> Robot:
    """The robot of Table II."""
    return build_robot(load_robot("tcr700"))

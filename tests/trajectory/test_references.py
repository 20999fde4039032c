"""The references of a run: asked for many steps at once, the same to the last bit as step by step."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.experiment.again import load_experiment
from tcrctl.experiment.prepare import make_trajectory
from tcrctl.robot.robot import build_robot
from tcrctl.signals import Array, Reference
from tcrctl.trajectory.references import STEPS, References, in_periods
from tcrctl.trajectory.start_blend import StartBlend
from tcrctl.trajectory.trajectory import Trajectory, sample_reference

PERIOD = 0.05
FIELDS = ("t", "position", "normal", "ahead_position", "ahead_normal", "drive")


def started(name: str) -> StartBlend:
    """Return the trajectory of a shipped experiment as a run begins it, a little beside."""
    loaded = load_experiment(name, ())
    robot = build_robot(loaded.robot)
    beside, tilted = robot.rest_position + 1e-4, np.array([0.0, 0.02, np.sqrt(1.0 - 4e-4)])
    return StartBlend(make_trajectory(loaded.spec, robot), beside, tilted, 1.0, 0.005, 1.0)


def bits(reference: Reference) -> list[bytes | None]:
    values = [getattr(reference, name) for name in FIELDS]
    return [None if value is None else np.asarray(value).tobytes() for value in values]


def step_by_step(trajectory: Trajectory, k: int, ahead: Array) -> Reference:
    return sample_reference(trajectory, k * PERIOD, (k + in_periods(ahead, PERIOD)) * PERIOD)


class Counting:
    """A line that counts how many instants it was asked for, and how often."""

    duration = 100.0
    known_ahead = True

    def __init__(self) -> None:
        self.asked: list[int] = []

    def position(self, t: Array) -> Array:
        self.asked.append(t.size)
        return t[:, None] * np.ones(3)

    def normal(self, t: Array) -> None:
        del t


@pytest.mark.parametrize("name", ["letter_t", "helix", "box_scan", "dynamic_drive"])
@pytest.mark.parametrize(
    "ahead", [np.arange(1.0, 17.0) * 0.05, np.arange(1.0, 17.0) * 0.0325, np.array([0.05])]
)
def test_every_step_has_the_bits_that_it_has_alone(name: str, ahead: Array) -> None:
    trajectory = started(name)
    references = References(trajectory, PERIOD)
    for k in [*range(0, 40, 7), STEPS - 1, STEPS, 3 * STEPS + 5, 2]:
        assert bits(references.at(k, ahead)) == bits(step_by_step(trajectory, k, ahead))


def test_no_instant_is_asked_for_twice_within_a_block() -> None:
    line, ahead = Counting(), np.arange(1.0, 17.0) * PERIOD
    references = References(line, PERIOD)
    for k in range(2 * STEPS):
        references.at(k, ahead)
    assert line.asked == [STEPS + 16] * 2


def test_a_trajectory_that_does_not_promise_to_be_the_same_later_is_asked_when_the_step_is_due() -> None:
    line, ahead = Counting(), np.array([PERIOD])
    line.known_ahead = False
    references = References(line, PERIOD)
    for k in range(3):
        assert len(line.asked) == k
        references.at(k, ahead)
    assert line.asked == [2, 2, 2]


def test_other_instants_are_asked_for_anew() -> None:
    references = References(Counting(), PERIOD)
    references.at(4, np.array([0.05]))
    assert references.at(4, np.array([0.1, 0.2])).ahead_position.shape == (2, 3)

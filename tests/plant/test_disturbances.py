"""What happens to a simulated plant while it runs: loads, pushes, blind cameras, another start."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.errors import SpecError
from tcrctl.experiment.spec import load_spec
from tcrctl.plant.disturbances import pushed, seen
from tcrctl.plant.settings import DropoutSettings, PushSettings, SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.robot import pose
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.model import gravity_force
from tcrctl.robot.module import FIXED
from tcrctl.robot.robot import mismatched
from tcrctl.signals import Command

PERIOD = 0.05
GRAVITY = np.array([0.0, 0.0, -9.81])


def build(robot, **settings):
    return SimulatedPlant(SimulatedSettings(kind="simulated", **settings), robot, PERIOD, seed=1)


def still(plant):
    return Command(np.zeros(plant.robot.n_cables), np.zeros(plant.robot.n_cables))


def test_a_load_adds_its_mass_and_its_weight_and_nothing_else(tcr5x4):
    loaded = mismatched(tcr5x4, tip_load=0.005)
    more = loaded.model.mass - tcr5x4.model.mass
    assert np.trace(more[tcr5x4.tip // FIXED - 1]) == pytest.approx(3 * 0.005)
    assert np.count_nonzero(more) == 9
    pull = (loaded.weight - tcr5x4.weight).reshape(-1, 3).sum(axis=0)
    np.testing.assert_allclose(pull, 0.005 * GRAVITY, atol=1e-12)


def test_the_gravity_of_a_loaded_robot_is_that_of_the_robot(tcr700):
    heavier = mismatched(tcr700, density=1.3)
    np.testing.assert_allclose(heavier.weight, gravity_force(heavier.model, GRAVITY), atol=1e-12)


def test_a_push_adds_its_force_while_it_lasts(tcr5x4):
    push = PushSettings(ring=3, force_n=(0.1, -0.2, 0.3), start_s=1.0, duration_s=0.5)
    for t, acts in ((0.99, False), (1.0, True), (1.49, True), (1.5, False)):
        more = (pushed(tcr5x4.weight, [push], t) - tcr5x4.weight).reshape(-1, 3)
        np.testing.assert_allclose(more.sum(axis=0), np.array([0.1, -0.2, 0.3]) * acts, atol=1e-15)
        assert (np.flatnonzero(more.any(axis=1)) // FIXED == 3).all()


def test_pushes_at_the_same_time_add_up(tcr5x4):
    push = PushSettings(ring=2, force_n=(0.1, 0.0, 0.0), start_s=0.0, duration_s=1.0)
    more = pushed(tcr5x4.weight, [push, push, push], 0.5) - tcr5x4.weight
    assert more.sum() == pytest.approx(0.3)


@pytest.mark.slow
def test_a_pushed_robot_comes_to_rest_where_statics_says(tcr5x4):
    push = {"ring": 5, "force_n": (0.05, 0.0, 0.0), "start_s": 0.0, "duration_s": 1e6}
    plant = build(tcr5x4, pushes=(push,), step_ms=5.0)
    force = pushed(tcr5x4.weight, [PushSettings(**push)], 0.0)
    wanted = equilibrium(tcr5x4.model, np.zeros(tcr5x4.n_cables), force, tcr5x4.rest.q)
    away = np.linalg.norm(pose.position(wanted.q, tcr5x4.tip) - tcr5x4.rest_position)
    for _ in range(600):
        plant.write(still(plant))
    left = np.linalg.norm(plant.truth().position - pose.position(wanted.q, tcr5x4.tip))
    assert away > 1e-3
    assert left < 0.02 * away


def test_a_push_that_has_not_begun_changes_nothing(tcr5x4):
    push = {"ring": 1, "force_n": (1.0, 0.0, 0.0), "start_s": 3 * PERIOD, "duration_s": 1.0}
    plain, later = build(tcr5x4), build(tcr5x4, pushes=(push,))
    for k in range(5):
        same = np.array_equal(plain.truth().q, later.truth().q)
        assert same == (k <= 3)
        plain.write(still(plain))
        later.write(still(later))


def test_a_dropout_hides_its_rings_while_it_lasts_and_keeps_the_others():
    rings, valid = np.repeat([1, 2, 3], 3), np.repeat([True, False, True], 3)
    dropout = DropoutSettings(rings=(1,), start_s=1.0, duration_s=2.0)
    for t, expected in ((0.9, valid), (1.0, valid & (rings != 1)), (2.9, valid & (rings != 1)), (3.0, valid)):
        assert np.array_equal(seen(valid, rings, [dropout], t), expected)
    assert valid[0]


def test_the_dropout_follows_the_time_of_the_picture_not_of_the_reading(tcr5x4):
    dropout = {"rings": (5,), "start_s": 2 * PERIOD, "duration_s": PERIOD}
    plant = build(tcr5x4, latency_ms=50.0, dropouts=(dropout,))
    hidden = []
    for _ in range(6):
        hidden.append(not plant.read().valid[-1])
        plant.write(still(plant))
    assert hidden == [False, False, False, True, False, False]


def test_a_plant_may_rest_with_its_drives_anywhere_within_their_stroke(tcr5x4):
    drives = (3.0, 0.0, -2.0, 0.0)
    plant = build(tcr5x4, start_drives_mm=drives)
    start = plant.truth().q
    np.testing.assert_allclose(plant.read().drive, np.array(drives) / 1000.0, atol=1e-15)
    for _ in range(20):
        plant.write(still(plant))
    np.testing.assert_allclose(plant.truth().q, start, atol=1e-6)
    assert np.linalg.norm(plant.truth().position - tcr5x4.rest_position) > 1e-3


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("plant.pushes=[{ring: 14, force_n: [0.1, 0.0, 0.0], start_s: 1.0, duration_s: 1.0}]", "no ring 14"),
        ("plant.dropouts=[{rings: [3, 20], start_s: 1.0, duration_s: 1.0}]", "no ring 20"),
        ("plant.start_drives_mm=[1.0, 2.0]", "there are 2 lengths"),
        ("plant.start_drives_mm=[0, 0, 0, 0, 0, 900]", "within stroke_mm"),
        ("plant.tip_load_g=-1", "must be >= 0"),
    ],
)
def test_what_the_robot_does_not_have_is_refused(override, said):
    with pytest.raises(SpecError, match=said):
        load_spec("cone_frustum", (override,))

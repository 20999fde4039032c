"""Unlike parts: what is drawn, how it is written down, and that it is the robot that moves."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.config import strict_yaml
from tcrctl.elements import bar
from tcrctl.plant.reality_settings import ScatterSettings
from tcrctl.plant.scatter import scattered
from tcrctl.robot.description import RobotDescription, load_robot, spring_list
from tcrctl.robot.model import build_model, undeformed
from tcrctl.robot.module import RIGID_BARS

ALL = {"springs": 0.1, "masses": 0.05, "geometry_mm": 0.5, "holes_deg": 1.0, "tilt_deg": 0.25}
REST = np.full(6, 0.75)


def drawn(seed=1, name="tcr700", **settings):
    return scattered(load_robot(name), ScatterSettings(**settings), REST, seed)


def test_what_is_drawn_is_a_robot_file_that_says_the_same_again():
    robot = drawn(**ALL)
    text = strict_yaml.dumps(robot.model_dump(mode="json"))
    again = strict_yaml.validate(strict_yaml.loads(text), RobotDescription)
    assert again == robot
    one, other = build_model(robot, REST), build_model(again, REST)
    for a, b in zip(one, other, strict=True):
        assert np.array_equal(a, b)


def test_no_scatter_is_the_robot_as_designed():
    plain, unlike = build_model(load_robot("tcr700"), REST), build_model(drawn(), REST)
    for name, value in plain._asdict().items():
        np.testing.assert_allclose(getattr(unlike, name), value, rtol=1e-12, atol=1e-15, err_msg=name)


def many(value, count=60, **settings):
    """Values of many draws."""
    return np.array([value(drawn(seed, **settings)) for seed in range(count)])


@pytest.mark.slow
def test_springs_of_a_joint_deviate_together_and_each_a_little():
    common = many(lambda d: [s.axial_stiffness for s in spring_list(d)], springs=0.1)
    common /= spring_list(load_robot("tcr700"))[0].axial_stiffness
    joints = common.reshape(-1, 13, 3)
    assert np.ptp(joints, axis=2).max() < 1e-12
    assert joints[..., 0].std() == pytest.approx(0.1, rel=0.1)
    assert joints.mean() == pytest.approx(1.0, abs=0.02)
    single = many(lambda d: [s.axial_stiffness for s in spring_list(d)], single_springs=0.1)
    single /= spring_list(load_robot("tcr700"))[0].axial_stiffness
    assert single.std() == pytest.approx(0.1, rel=0.1)
    assert np.ptp(single.reshape(-1, 13, 3), axis=2).min() > 1e-4


@pytest.mark.slow
def test_masses_geometry_and_holes_have_the_wanted_deviation():
    masses = many(lambda d: [d.modules.of(i).mass_g for i in range(1, 14)], masses=0.05)
    assert masses.std() == pytest.approx(0.5, rel=0.1)
    straight = undeformed(load_robot("tcr700"))
    moved = many(lambda d: undeformed(d) - straight, geometry_mm=0.5)
    assert not moved[:, :12].any()
    assert moved[:, 12:].std() == pytest.approx(5e-4, rel=0.05)
    holes = many(
        lambda d: [hole.hole_deg for route in d.cables.routes for hole in route.through], holes_deg=1.0
    )
    nominal = [0.0] * 14 + [60.0] * 9 + [120.0] * 14 + [180.0] * 9 + [240.0] * 14 + [300.0] * 9
    off = np.remainder(holes - nominal + 180.0, 360.0) - 180.0
    assert off.std() == pytest.approx(1.0, rel=0.05)


@pytest.mark.slow
def test_the_base_is_tilted_by_that_angle_in_any_direction():
    tilts = many(lambda d: d.base.tilt_deg, tilt_deg=0.5)
    np.testing.assert_allclose(np.hypot(*tilts.T), 0.5)
    assert np.abs(tilts.mean(axis=0)).max() < 0.15


def test_parts_are_unstretched_where_they_are_drawn_and_cables_keep_their_rest_lengths():
    robot = drawn(**ALL)
    model = build_model(robot, REST)
    nodes = undeformed(robot).reshape(-1, 3)
    rigid = slice(0, RIGID_BARS * 13)
    ends = nodes[model.bar_nodes[rigid]]
    np.testing.assert_allclose(
        np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), model.bars[rigid, bar.REST], rtol=1e-12
    )
    assert [route.rest_length_mm for route in robot.cables.routes] == [750.0] * 6


def test_one_quantity_is_drawn_whatever_else_is():
    alone, together = drawn(springs=0.1), drawn(**ALL)
    assert alone.springs == together.springs
    assert drawn(seed=2, springs=0.1).springs != alone.springs


def test_a_seed_of_its_own_makes_the_draw_independent_of_the_run():
    settings = ScatterSettings(**ALL, seed=5)
    robot = load_robot("tcr700")
    assert scattered(robot, settings, REST, 1) == scattered(robot, settings, REST, 2)


def test_what_a_robot_file_says_of_single_parts_is_scattered_about_that():
    given = "modules.each=[{module: 3, mass_g: 20, offsets_mm: {apex: [0, 0, -1]}}]"
    spring = "springs.each=[{nodes: [base.apex, m1.n1], youngs_modulus_mpa: 45}]"
    robot = scattered(load_robot("tcr700", overrides=(given, spring)), ScatterSettings(), REST, 1)
    assert robot.modules.of(3).mass_g == 20.0
    assert robot.modules.offsets()[3, "apex"] == (0.0, 0.0, -1.0)
    assert spring_list(robot)[0].axial_stiffness == pytest.approx(spring_list(robot)[1].axial_stiffness / 2.0)

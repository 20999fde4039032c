"""Robots whose modules, springs and holes are not alike, that hang from a tilted base, or that rub."""

from __future__ import annotations

import numpy as np
import pytest

from support import mechanics
from tcrctl.elements import bar, rubbing_cable
from tcrctl.errors import SpecError
from tcrctl.robot.description import load_robot
from tcrctl.robot.model import build_model, undeformed
from tcrctl.robot.module import RIGID_BARS

REST = np.full(4, 0.35)
DEFAULTS = (
    "modules.each=[]",
    "springs.each=[]",
    "friction=off",
    "base.tilt_deg=[0, 0]",
)


def model(*overrides):
    return build_model(load_robot("tcr5x4", overrides=overrides), REST)


def test_the_defaults_of_the_new_sections_change_no_bit():
    plain, given = model(), model(*DEFAULTS)
    for a, b in zip(plain, given, strict=True):
        assert np.array_equal(a, b)


def test_a_module_that_is_not_like_the_others_has_its_own_mass_rods_and_place():
    plain, other = (
        model(),
        model("modules.each=[{module: 3, mass_g: 12, youngs_modulus_mpa: 5000, pitch_mm: 60}]"),
    )
    assert np.flatnonzero((plain.mass != other.mass).any(axis=(1, 2))).tolist() == [2]
    joints = 3 * 0.8e-3
    assert other.mass[2, 0::3, 0::3].sum() - 12e-3 == pytest.approx(plain.mass[2, 0::3, 0::3].sum() - 10e-3)
    assert joints > 0.0
    ratio = other.bars[:, bar.STIFFNESS] / plain.bars[:, bar.STIFFNESS]
    expected = np.ones(plain.bars.shape[0])
    expected[2 * RIGID_BARS : 3 * RIGID_BARS] = 2.0
    np.testing.assert_allclose(ratio, expected, rtol=1e-12)
    lower = undeformed(load_robot("tcr5x4", overrides=("modules.each=[{module: 3, pitch_mm: 60}]",)))
    shift = (lower - undeformed(load_robot("tcr5x4"))).reshape(-1, 4, 3)
    np.testing.assert_allclose(shift[:3], 0.0, atol=1e-15)
    np.testing.assert_allclose(shift[3:], np.tile([0.0, 0.0, -0.01045], (3, 4, 1)), atol=1e-12)


def test_an_offset_moves_one_node_and_stretches_nothing():
    given = "modules.each=[{module: 2, offsets_mm: {n2: [1, 0, -0.5]}}]"
    robot = load_robot("tcr5x4", overrides=(given,))
    moved = np.flatnonzero(
        np.any((undeformed(robot) - undeformed(load_robot("tcr5x4"))).reshape(-1, 3), axis=1)
    )
    assert moved.tolist() == [9]
    built = build_model(robot, REST)
    ends = undeformed(robot).reshape(-1, 3)[built.bar_nodes[: RIGID_BARS * 5]]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    np.testing.assert_allclose(lengths, built.bars[: RIGID_BARS * 5, bar.REST], rtol=1e-12)


def test_a_spring_that_is_not_like_the_others_is_found_by_its_nodes_in_any_order():
    plain = model()
    other = model("springs.each=[{nodes: [m2.n3, m1.apex], youngs_modulus_mpa: 45, natural_length_mm: 20}]")
    changed = np.flatnonzero((plain.bars != other.bars).any(axis=1))
    assert changed.tolist() == [RIGID_BARS * 5 + 5]
    assert other.bars[changed[0], bar.REST] == pytest.approx(0.02)


def test_a_tilted_robot_is_the_same_robot_turned_where_nothing_pulls_it_down():
    free = "gravity_m_s2=[0, 0, 0]"
    straight, tilted = (
        mechanics.altered("tcr5x4", free),
        mechanics.altered("tcr5x4", free, "base.tilt_deg=[2, -3]"),
    )
    x, y = np.radians([2.0, -3.0])
    turn = mechanics.turned(np.array([0.0, y, 0.0])) @ mechanics.turned(np.array([x, 0.0, 0.0]))
    np.testing.assert_allclose(
        tilted.rest.q.reshape(-1, 3), straight.rest.q.reshape(-1, 3) @ turn.T, rtol=0, atol=1e-7
    )
    np.testing.assert_allclose(tilted.rest.tension, straight.rest.tension, rtol=1e-7)


def test_friction_in_a_robot_file_is_known_hole_by_hole(tcr5x4):
    assert tcr5x4.holes is None
    robot = mechanics.altered(
        "tcr5x4", "friction={coefficient: [0.1, 0.2, 0.3, 0.4], least_wrap_deg: 3, drag_n: 0.01}"
    )
    assert robot.holes.shape == (24, 3)
    np.testing.assert_allclose(robot.holes[:, rubbing_cable.COEFFICIENT], np.repeat([0.1, 0.2, 0.3, 0.4], 6))
    np.testing.assert_allclose(robot.holes[:, rubbing_cable.LEAST_WRAP], np.radians(3.0))
    np.testing.assert_allclose(robot.holes[:, rubbing_cable.DRAG], 0.01)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("modules.each=[{module: 6, mass_g: 1}]", "there is no module 6; modules are 1 to 5"),
        ("modules.each=[{module: 2}, {module: 2}]", "module 2 is listed 2 times"),
        ("modules.each=[{module: 2, mass_g: 0}]", "must be > 0"),
        ("modules.each=[{module: 2, offsets_mm: {n4: [0, 0, 0]}}]", "n4"),
        ("springs.each=[{nodes: [m1.n1, m2.n2]}]", "there is no spring between m1.n1 and m2.n2"),
        ("springs.each=[{nodes: [base.apex, m1.n1]}, {nodes: [m1.n1, base.apex]}]", "is listed 2 times"),
        ("friction={coefficient: [0.1, 0.2]}", "there are 4 cables, c1, c2, c3, c4, and 2 values"),
        ("friction={coefficient: -1}", "must be >= 0"),
        ("friction={coefficient: [0.1, 0.1, 0.1, x]}", "must be a number"),
        ("base.tilt_deg=[1]", "too short"),
    ],
)
def test_what_cannot_be_is_refused_where_it_stands(override, words):
    with pytest.raises(SpecError) as caught:
        load_robot("tcr5x4", overrides=(override,))
    assert words in str(caught.value)
    assert f"--set {override.partition('=')[0]}" in str(caught.value)

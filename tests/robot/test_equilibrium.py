"""Static equilibria: balance of forces, symmetry, sensitivities, the paper's measured shapes, honest failure."""

from __future__ import annotations

import numpy as np
import pytest

from support import mechanics
from support.mechanics import FREE
from tcrctl.elements import bar, sliding_cable
from tcrctl.errors import NoEquilibriumError
from tcrctl.robot import pose
from tcrctl.robot.description import load_robot
from tcrctl.robot.equations import make_workspace, residual
from tcrctl.robot.equilibrium import (
    TOLERANCE,
    equilibrium,
    equilibrium_with_tensions,
    static_load,
    with_rest_lengths,
)
from tcrctl.robot.model import build_model, scaled
from tcrctl.robot.module import APEX, FIXED, RIGID_BARS
from tcrctl.robot.robot import build_robot, mismatched

ROBOTS = ["tcr600", "tcr700", "tcr5x4"]
ONE_MODULE = ("modules.count=1", "tip.ring=1")
THREE_CABLES = (
    "cables.routes=[{name: a, hole_deg: 0, to_ring: 1}, {name: b, hole_deg: 120, to_ring: 1}, "
    "{name: c, hole_deg: 240, to_ring: 1}]"
)
#: Table II of [TCR]: drive lengths and measured end positions, and the end at rest [mm].
TABLE_2 = {
    "bending": ([90, 50, 50, 50, 50, 50], [73.75, -261.71, 466.62]),
    "contraction": ([90, 70, 90, 70, 90, 70], [63.14, -159.63, 471.19]),
    "S-shape": ([60, 25, 55, 85, 55, 25], [49.88, 29.85, 506.55]),
}
AT_REST = [62.33, -160.89, 380.19]
#: Cable 1 in the paper's frame [rad]; its cables are numbered clockwise seen from +z.
CABLE_1 = np.radians(-85.7)


@pytest.fixture(params=ROBOTS)
def robot(request):
    return request.getfixturevalue(request.param)


def at(robot, drive):
    """Equilibrium of a robot for drive lengths."""
    return equilibrium(robot.model, np.asarray(drive, dtype=float), robot.weight, robot.rest.q)


def pulled(robot):
    """Moderate drives, all different; every cable stays taut."""
    return 0.01 + 0.004 * np.random.default_rng(1).random(robot.n_cables)


def springs(model, q):
    """Tensions [N] and directions, upper to lower end, of the springs."""
    rows = slice(RIGID_BARS * model.mass.shape[0], None)
    ends = q.reshape(-1, 3)[model.bar_nodes[rows]]
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    bars = model.bars[rows]
    tension = np.maximum(0.0, bars[:, bar.STIFFNESS] * (length - bars[:, bar.REST]))
    return tension, along / length[:, None]


def test_every_node_is_in_balance_and_the_tangent_is_positive(robot):
    found, ws = at(robot, pulled(robot)), make_workspace(robot.model)
    residual(robot.model, found.q, pulled(robot), static_load(robot.model, robot.weight), ws)
    assert np.abs(ws.r).max() <= TOLERANCE
    assert found.residual <= TOLERANCE
    assert np.array_equal(ws.tension, found.tension)
    assert np.array_equal(ws.length, found.length)


def test_one_module_hangs_in_its_cables_and_pulls_against_its_springs():
    robot = mechanics.altered("tcr5x4", *ONE_MODULE, THREE_CABLES)
    tension, direction = springs(robot.model, robot.rest.q)
    weight = 9.81 * (10e-3 + 3 * 0.4e-3)
    # apex above the ring: springs pull the ring down, against the cables
    assert np.ptp(tension) < 1e-6
    assert (direction[:, 2] > 0.0).all()
    assert robot.rest.tension == pytest.approx([5.0] * 3, abs=1e-7)
    assert robot.rest.tension.sum() == pytest.approx(weight + (tension * direction[:, 2]).sum(), abs=1e-6)


def test_the_base_of_any_robot_bears_its_weight(robot):
    found = at(robot, pulled(robot))
    tension, direction = springs(robot.model, found.q)
    from_base = robot.model.bar_nodes[RIGID_BARS * robot.n_modules :, 0] < FIXED
    nodes = found.q.reshape(-1, 3)
    force = (tension[from_base, None] * direction[from_base]).sum(
        axis=0
    )  # of the base on the robot, negative
    for c in range(robot.n_cables):
        hole = robot.model.first_hole[c]
        a, b = (robot.model.hole_weights[k] @ nodes[robot.model.hole_nodes[k]] for k in (hole, hole + 1))
        force += found.tension[c] * (b - a) / np.linalg.norm(b - a)
    np.testing.assert_allclose(force, robot.weight.reshape(-1, 3).sum(axis=0), atol=1e-5)


def test_at_rest_every_cable_carries_its_initial_tension_and_nothing_is_bent(robot):
    np.testing.assert_allclose(robot.rest.tension, 5.0, atol=1e-7)
    np.testing.assert_allclose(robot.rest_position[:2], 0.0, atol=1e-9)
    np.testing.assert_allclose(robot.rest_normal, [0.0, 0.0, 1.0], atol=1e-9)


def test_the_two_segment_robot_is_700_mm_long_at_rest(tcr700):
    apex = tcr700.rest.q.reshape(-1, 3)[FIXED * tcr700.n_modules + APEX]
    assert -1000 * apex[2] == pytest.approx(700.0, abs=0.1)


def test_drives_and_tensions_are_each_others_inverse(robot):
    found = at(robot, pulled(robot))
    model = robot.model
    assert (found.tension > 1.0).all()
    again = equilibrium_with_tensions(model, found.tension, robot.weight, robot.rest.q)
    np.testing.assert_allclose(again.tension, found.tension, atol=1e-9)
    np.testing.assert_allclose(again.q, found.q, atol=1e-7)
    rest, stiffness = model.cables[:, sliding_cable.REST], model.cables[:, sliding_cable.STIFFNESS]
    drive = again.tension / stiffness + rest - again.length
    np.testing.assert_allclose(drive, pulled(robot), atol=1e-7)


def test_given_rest_lengths_and_given_tensions_string_the_same_robot():
    by_tension = mechanics.altered("tcr5x4")
    lengths = 1000 * by_tension.model.cables[:, sliding_cable.REST]
    routes = ", ".join(
        f"{{name: c{c}, hole_deg: {90 * c}, to_ring: 5, rest_length_mm: {float(length)!r}}}"
        for c, length in enumerate(lengths)
    )
    by_length = mechanics.altered("tcr5x4", "cables.initial_tension_n=null", f"cables.routes=[{routes}]")
    np.testing.assert_allclose(by_length.rest.tension, 5.0, atol=1e-6)
    np.testing.assert_allclose(by_length.rest.q, by_tension.rest.q, atol=1e-8)


def test_other_rest_lengths_keep_the_material(robot):
    rest = robot.model.cables[:, sliding_cable.REST]
    longer = with_rest_lengths(robot.model, 1.1 * rest).cables
    ea = robot.model.cables[:, sliding_cable.STIFFNESS] * rest
    np.testing.assert_allclose(longer[:, sliding_cable.STIFFNESS] * longer[:, sliding_cable.REST], ea)


def test_the_gain_is_the_derivative_of_the_equilibrium(robot):
    drive = pulled(robot)
    found = at(robot, drive)
    for c in range(robot.n_cables):
        up, down = drive.copy(), drive.copy()
        up[c] += 2e-5
        down[c] -= 2e-5
        ahead, behind = (equilibrium(robot.model, d, robot.weight, found.q).q for d in (up, down))
        slope = (ahead - behind)[FREE:] / 4e-5
        np.testing.assert_allclose(found.gain[:, c], slope, atol=2e-4 * np.abs(slope).max())


@pytest.mark.parametrize(("name", "shift"), [("tcr600", 1), ("tcr700", 2)])
def test_drives_moved_on_by_a_third_of_a_turn_turn_the_robot_by_it(name, shift, request):
    robot = request.getfixturevalue(name)
    drive = pulled(robot)
    before, after = at(robot, drive), at(robot, np.roll(drive, shift))
    R = mechanics.turned(np.array([0.0, 0.0, 2 * np.pi / 3]))
    expected = (before.q.reshape(-1, 3) @ R.T).reshape(-1, FIXED, 3)
    expected[:, :3] = np.roll(expected[:, :3], 1, axis=1)  # node 1 goes where node 2 was
    np.testing.assert_allclose(after.q, expected.ravel(), atol=1e-8)
    np.testing.assert_allclose(after.tension, np.roll(before.tension, shift), atol=1e-6)


def test_pulling_a_cable_bends_the_robot_to_its_side(robot):
    drive = np.zeros(robot.n_cables)
    drive[0] = 0.02
    end = pose.position(at(robot, drive).q, robot.tip)
    assert end[0] > 0.01
    assert abs(end[1]) < 1e-6
    assert end[2] > robot.rest_position[2]


def paper_frame(displacement):
    """Displacement [m] of our end in the frame of Table II [mm]."""
    x, y, z = 1000 * displacement * [1.0, -1.0, 1.0]
    c, s = np.cos(CABLE_1), np.sin(CABLE_1)
    return np.array([c * x - s * y, s * x + c * y, z])


def test_the_end_positions_of_table_2_are_met_better_than_by_the_papers_model(tcr700):
    apex = slice(3 * (FIXED * 13 + APEX), None)
    errors = []
    for drive, measured in TABLE_2.values():
        moved = at(tcr700, np.array(drive) / 1000.0).q[apex] - tcr700.rest.q[apex]
        errors.append(np.linalg.norm(paper_frame(moved) - np.subtract(measured, AT_REST)))
    assert np.mean(errors) <= 7.0
    assert np.all(np.array(errors) < [13.5, 5.0, 3.5])


def test_far_drives_are_reached_from_rest(tcr700):
    drive = np.array([150.0, 20.0, 10.0, 10.0, 20.0, 100.0]) / 1000.0
    found = at(tcr700, drive)
    assert found.residual <= TOLERANCE
    half = at(tcr700, 0.5 * drive)
    onwards = equilibrium(tcr700.model, drive, tcr700.weight, half.q, start_drive=0.5 * drive)
    np.testing.assert_allclose(onwards.q, found.q, atol=1e-7)


def test_softer_springs_and_heavier_modules_make_another_rest_shape(tcr700):
    other = mismatched(tcr700, springs=0.7, density=1.2)
    assert np.linalg.norm(other.rest_position - tcr700.rest_position) > 1e-4
    np.testing.assert_allclose(other.weight, 1.2 * tcr700.weight)
    np.testing.assert_allclose(other.model.mass, 1.2 * tcr700.model.mass)
    n = RIGID_BARS * 13
    assert np.array_equal(other.model.bars[:n], tcr700.model.bars[:n])
    np.testing.assert_allclose(
        other.model.bars[n:, bar.STIFFNESS], 0.7 * tcr700.model.bars[n:, bar.STIFFNESS]
    )
    assert np.array_equal(other.model.cables, tcr700.model.cables)


def test_models_are_read_only(robot):
    for model in (robot.model, scaled(robot.model, cables=2.0)):
        for value in model:
            if isinstance(value, np.ndarray):
                assert not value.flags.writeable


NO_STABLE_SHAPE = {
    "nothing holds the modules apart": ("springs.joint=[]",),
    "a ring that no cable guides on one side": (
        "cables.routes.3={name: d, through: [{ring: 0, hole_deg: 270}, {ring: 1, hole_deg: 270}, "
        "{ring: 2, hole_deg: 270}, {ring: 4, hole_deg: 270}, {ring: 5, hole_deg: 270}]}",
    ),
}


@pytest.mark.parametrize("why", NO_STABLE_SHAPE)
def test_a_robot_without_a_stable_shape_is_refused_with_the_evidence(why):
    with pytest.raises(NoEquilibriumError, match="no equilibrium found for") as caught:
        mechanics.altered("tcr5x4", *NO_STABLE_SHAPE[why])
    assert caught.value.tolerance == TOLERANCE
    assert caught.value.iterations > 0


def test_a_balance_that_is_a_saddle_is_refused_and_said_to_be_one():
    unguided = NO_STABLE_SHAPE["a ring that no cable guides on one side"]
    with pytest.raises(NoEquilibriumError, match="in balance, but unstable") as caught:
        mechanics.altered("tcr5x4", *unguided, "cables.initial_tension_n=1")
    assert caught.value.residual <= TOLERANCE


def test_the_undeformed_stack_has_rods_at_their_rest_lengths():
    description = load_robot("tcr5x4")
    model = build_model(description, np.ones(4))
    robot = build_robot(description)
    rods = model.bars[: RIGID_BARS * 5]
    expected = [np.hypot(0.035, 0.05582)] * 3 + [0.035 * np.sqrt(3.0)] * 3
    np.testing.assert_allclose(rods[:, bar.REST], expected * 5, rtol=1e-12)
    area = np.pi / 4 * 0.005**2
    np.testing.assert_allclose(rods[:, bar.STIFFNESS] * rods[:, bar.REST], 2500e6 * area, rtol=1e-12)
    assert robot.model.mass.shape == (5, 12, 12)

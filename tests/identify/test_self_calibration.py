"""Laws of the self-calibration: slopes, known values recovered, what cannot be told, files of what was found."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.elements import sliding_cable
from tcrctl.errors import NoEquilibriumError
from tcrctl.identify.calibration.answer_of_drives import fit_answer, followed
from tcrctl.identify.calibration.body import Body
from tcrctl.identify.calibration.design import choose, sensitivities
from tcrctl.identify.calibration.fit import HALVINGS, Calibrator
from tcrctl.identify.calibration.judgement import undetermined
from tcrctl.identify.calibration.loose import hole_forces
from tcrctl.identify.calibration.rests import Rests, _ends, stop
from tcrctl.identify.calibration.robot_values import robot_of
from tcrctl.identify.calibration.rubbing import behind_play
from tcrctl.identify.calibration.settings import RestSettings, SelfCalibrationSpec
from tcrctl.identify.calibration.shapes import Shapes
from tcrctl.identify.calibration.sight import Sight
from tcrctl.identify.calibration.unknowns import SEEN, make_unknowns
from tcrctl.robot.description import load_robot
from tcrctl.robot.robot import build_robot
from tcrctl.trajectory.excitation import draw_poses
from tcrctl.trajectory.excitation_settings import DrawSettings

pytestmark = pytest.mark.slow

ROBOT = "tcr5x4"
SPEC = SelfCalibrationSpec(rest=RestSettings(stick=0.0, play_mm=0.0, noise_um=20.0))
POSES = 14


@pytest.fixture(scope="module")
def body():
    description = load_robot(ROBOT)
    return Body(description, build_robot(description), make_unknowns(description, SPEC))


@pytest.fixture(scope="module")
def drives(body):
    settings = DrawSettings(contraction_mm=(0.0, 20.0), reach_mm=(3.0, 15.0), floor_n=1.0)
    poses = draw_poses(settings, body.robot, POSES, np.random.default_rng(1))
    return 1e-3 * np.vstack([np.zeros((1, body.robot.n_cables)), poses])


def rests_at(drives, markers, pushed=None):
    still = np.zeros_like(drives)
    return Rests(
        np.arange(len(drives), dtype=float), drives, markers, still, still if pushed is None else pushed
    )


def drawn(body, seed=3, scale=0.5):
    """Unknowns as a robot may have them."""
    prior = body.unknowns.prior
    return scale * prior * np.clip(np.random.default_rng(seed).standard_normal(prior.size), -2.0, 2.0)


def seen(body, drives, x, noise=0.0, pushed=None):
    """What cameras report of the robot that x describes, at rest."""
    rests = rests_at(drives, np.zeros((len(drives), 3 * body.robot.n_modules, 3)), pushed)
    said = -Calibrator(body, rests, SPEC).residual(x)
    said = said + noise * np.random.default_rng(5).standard_normal(said.shape)
    return rests_at(drives, said.reshape(len(drives), -1, 3), pushed)


def spread_of(body, fit):
    return np.sqrt(np.diag(fit.covariance))


def test_the_robot_file_is_the_robot_that_was_found(body):
    x = drawn(body)
    said, side = build_robot(robot_of(body, x, "found")), body.side(x)
    for name, array in said.model._asdict().items():
        np.testing.assert_allclose(array, getattr(side.model, name), rtol=1e-9, atol=1e-12, err_msg=name)
    np.testing.assert_allclose(said.rest.q[: side.base.size], side.base, atol=1e-12)


def test_nothing_found_is_the_robot_as_described(body):
    side, model = body.side(np.zeros(len(body.unknowns))), body.robot.model
    for name, array in model._asdict().items():
        np.testing.assert_allclose(getattr(side.model, name), array, rtol=1e-12, atol=1e-15, err_msg=name)


def test_slopes_of_what_is_seen_are_those_of_finite_differences(body, drives):
    x, u = drawn(body), body.unknowns
    pushed = np.ones_like(drives[:2])
    rests = rests_at(drives[:2], np.zeros((2, 3 * body.robot.n_modules, 3)), pushed)
    shapes, sight = Shapes(body, rests, SPEC.rest), Sight(u, body.robot.n_modules)

    def markers(at):
        return sight.of(at, [*shapes.at(at)][1])

    _, slopes = markers(x)
    for group in u.groups:
        i = u.of(group.name).start + len(group.members) // 2
        if u.of(group.name).stop <= i:
            i = u.of(group.name).start
        step = 0.05 * u.prior[i] * np.eye(len(u))[i]
        by_difference = (markers(x + step)[0] - markers(x - step)[0]) / (0.1 * u.prior[i])
        size = np.abs(by_difference).max()
        np.testing.assert_allclose(slopes[:, i], by_difference, atol=0.01 * size, err_msg=u.names[i])


def test_forces_of_holes_are_gradients_of_the_cable_beyond(body):
    model, q = body.robot.model, body.robot.rest.q
    forces, angles = hole_forces(model, q)
    m = body.robot.n_cables
    length, gradient = np.zeros(m), np.zeros((m, q.size))
    sliding_cable.path_gradients(
        q, model.first_hole, model.hole_nodes, model.hole_weights, model.cables, length, gradient
    )
    firsts = np.concatenate([[0], np.cumsum(np.diff(model.first_hole) - 1)[:-1]])
    free = slice(12, None)  # the actuator hangs above the base, which does not move
    np.testing.assert_allclose(forces[firsts][:, free], gradient[:, free], atol=1e-9)
    assert np.all(angles[firsts] == 0.0)


def test_known_values_are_recovered_from_clean_markers(body, drives):
    x = drawn(body)
    fit = Calibrator(body, seen(body, drives, x), SPEC).fit()
    assert fit.converged
    assert 1e3 * np.nanmax(np.abs(fit.residual)) < 0.05
    for name in SEEN:
        part = body.unknowns.of(name)
        off = (fit.x - x)[part] / spread_of(body, fit)[part]
        assert np.sqrt(np.mean(off**2)) < 1.5, name


def test_noisy_markers_give_values_within_their_deviations(body, drives):
    x = drawn(body, seed=4)
    fit = Calibrator(body, seen(body, drives, x, noise=20e-6), SPEC).fit()
    off = (fit.x - x) / spread_of(body, fit)
    assert np.sqrt(np.mean(off**2)) < 1.5
    assert np.abs(off).max() < 5.0
    assert np.all(spread_of(body, fit) <= body.unknowns.prior * (1.0 + 1e-6))


def test_markers_that_are_looser_than_assumed_give_wider_deviations(body, drives):
    """Ten times the noise: values are still within their deviations, which would be ten times too small."""
    x = drawn(body, seed=4)
    fit = Calibrator(body, seen(body, drives, x, noise=200e-6), SPEC).fit()
    off = (fit.x - x) / spread_of(body, fit)
    assert fit.misfit > 20.0
    assert np.sqrt(np.mean(off**2)) < 1.5
    assert np.abs(off).max() < 5.0


def test_rests_that_never_fit_do_not_drive_a_robot_away(body, drives):
    """Two millimetres that nothing explains, at a robot unlike its file: a hundred times what is assumed."""
    x = drawn(body, seed=6)
    for name, value in (("springs", -0.3), ("density", 0.2), ("tension", -0.3)):
        x[body.unknowns.of(name)] = value
    fit = Calibrator(
        body, seen(body, drives, x, noise=2e-3), SPEC.model_copy(update={"iterations": 30})
    ).fit()
    off = (fit.x - x) / spread_of(body, fit)
    assert np.abs(off[: body.unknowns.of("zeros").start]).max() < 3.0  # springs, density, tension
    assert np.abs(fit.x / body.unknowns.prior).max() < 3.0


def test_a_step_to_a_robot_without_a_stable_shape_is_halved(body, drives):
    """Cables so short that the robot tears: half of the way, or a quarter, leaves it whole."""
    calibrator, x = (
        Calibrator(body, seen(body, drives, np.zeros(len(body.unknowns))), SPEC),
        np.zeros(len(body.unknowns)),
    )
    torn = x.copy()
    torn[body.unknowns.of("zeros")] = -1.0
    with pytest.raises(NoEquilibriumError):
        list(calibrator._shapes.at(torn))
    assert np.isnan(calibrator.residual(torn)).all()
    assert np.abs(calibrator.residual(x)).max() < 1e-9
    went, rows = calibrator._towards(x, torn)
    part = went[body.unknowns.of("zeros")] / torn[body.unknowns.of("zeros")]
    assert len(rows) == len(drives)
    assert 2.0**-HALVINGS < part[0] < 1.0
    assert np.allclose(np.log2(part), np.round(np.log2(part[0])))


def test_a_rest_with_an_outlier_counts_less(body, drives):
    rests = seen(body, drives, drawn(body), noise=20e-6)
    rests.markers[3] += 0.02 * np.random.default_rng(2).standard_normal(rests.markers[3].shape)
    fit = Calibrator(body, rests, SPEC).fit()
    assert fit.weight[3] < 0.1 * np.median(fit.weight)


def test_markers_that_are_not_seen_do_not_count(body, drives):
    rests = seen(body, drives, drawn(body))
    rests.markers[2, :7] = np.nan
    fit = Calibrator(body, rests, SPEC).fit()
    assert fit.converged
    assert np.all(np.isfinite(fit.x))


def test_without_data_nothing_can_be_told(body):
    prior = body.unknowns.prior
    sentences = undetermined(body.unknowns, np.diag(prior**2))
    assert len(sentences) == sum(
        1
        for name in body.unknowns.names
        if name.split(".")[0] not in ("joint_springs", "masses", "holes", "geometry", "markers")
    )
    assert undetermined(body.unknowns, 1e-4 * np.diag(prior**2)) == []


def test_turning_cameras_and_base_about_the_vertical_is_not_told(body, drives):
    """Holes, markers and frame that turn together look alike."""
    fit = Calibrator(body, seen(body, drives, np.zeros(len(body.unknowns))), SPEC).fit()
    left = spread_of(body, fit) / body.unknowns.prior
    rotation = left[body.unknowns.of("frame_rotation")]
    assert rotation[2] > rotation[:2].max()
    assert any("zeros" in sentence for sentence in undetermined(body.unknowns, fit.covariance))


def test_play_is_found_from_the_sides_from_which_drives_come(body, drives):
    x = np.zeros(len(body.unknowns))
    place = body.unknowns.of("backlash").start
    x[place] = 0.3e-3
    pushed = np.where(np.arange(len(drives))[:, None] % 2 == 0, 1.0, -1.0) * np.ones_like(drives)
    fit = Calibrator(body, seen(body, drives, x, pushed=pushed), SPEC).fit()
    assert fit.x[place] == pytest.approx(0.3e-3, abs=3.0 * spread_of(body, fit)[place] + 1e-6)
    assert spread_of(body, fit)[place] < 0.3 * body.unknowns.prior[place]


def test_chosen_poses_tell_more_than_drawn_ones_and_each_tells_something(body, drives):
    told = sensitivities(body, drives, SPEC)
    designs = [choose(told, n) for n in (2, 4, 6)]
    assert all(d.information >= d.drawn for d in designs)
    assert designs[0].information < designs[1].information < designs[2].information
    assert all(len(set(d.chosen.tolist())) == n for d, n in zip(designs, (2, 4, 6), strict=True))
    assert np.all(designs[2].left <= 1.0 + 1e-9)


def test_of_poses_that_tell_of_different_things_one_of_each_is_chosen():
    told = np.zeros((4, 1, 2))
    told[:, 0, 0], told[:, 0, 1] = [3.0, 2.9, 0.0, 0.0], [0.0, 0.0, 1.0, 0.5]
    assert sorted(choose(told, 2).chosen.tolist()) == [0, 2]


@pytest.mark.parametrize(("lag", "dead_time"), [(0.03, 0.0), (0.1, 0.05)])
def test_lag_and_dead_time_are_recovered(lag, dead_time):
    t = 0.05 * np.arange(400)
    asked = 0.01 * np.stack([np.sin(t), np.sin(3.0 * t), np.sign(np.sin(t))], axis=1)
    reported = followed(0.05, asked, lag, dead_time)
    applied = np.vstack([asked[1:], asked[-1:]])
    found = fit_answer(0.05, applied, reported)
    assert found.lag == pytest.approx(lag, abs=2e-3)
    assert found.dead_time == pytest.approx(dead_time, abs=2e-3)


def test_drives_that_report_their_set_points_say_nothing_of_lag():
    asked = 0.01 * np.sin(0.05 * np.arange(100))[:, None]
    found = fit_answer(0.05, np.vstack([asked[1:], asked[-1:]]), asked)
    assert np.isnan(found.lag)
    assert np.isnan(found.dead_time)


def test_a_cable_behind_play_follows_late_by_half_of_it():
    drive = 1e-3 * np.concatenate([np.linspace(0, 5, 50), np.linspace(5, 0, 50)])[:, None]
    cable = behind_play(drive, 0.4e-3)
    assert cable[49, 0] == pytest.approx(4.8e-3)
    assert cable[-1, 0] == pytest.approx(0.2e-3)
    np.testing.assert_array_equal(behind_play(drive, 0.0), drive)


def test_a_point_with_friction_is_at_its_edge_after_a_pull_and_near_the_middle_after_a_shake():
    pull = np.linspace(0.0, 5e-3, 20)
    swings = 3e-3 * (1.0 - np.arange(9) / 8) * np.where(np.arange(9) % 2 == 0, 1.0, -1.0)
    assert stop(pull[:, None], 2e-3)[-1, 0] == 1.0
    assert abs(stop(np.concatenate([pull, 5e-3 + swings])[:, None], 2e-3)[-1, 0]) < 0.5


@pytest.mark.parametrize("steps", [0, 1])
def test_a_log_of_a_run_that_never_moved_has_no_rest(steps):
    assert _ends(np.zeros(steps), np.zeros((steps, 3)), 1.5) == []

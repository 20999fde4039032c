"""Laws of the passive observer: follows the truth, rejects noise, survives dropouts, no lasting pose error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from support import mechanics
from tcrctl.errors import InputError
from tcrctl.estimator.estimator import build_estimator
from tcrctl.estimator.settings import ExactSettings, PassiveObserverSettings
from tcrctl.plant.settings import Mismatch, SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.signals import Command

PERIOD = 0.05


def observe(robot, **settings):
    return build_estimator(PassiveObserverSettings(kind="passive_observer", **settings), robot, PERIOD, None)


def watch(
    robot, seconds, *, mismatch=None, noise=0.0, spoil=lambda k, measured: measured, speed=0.01, **settings
):
    """Run a plant with smooth drive speeds beside the observer; yields (truth, estimate, true v) per step."""
    plant = SimulatedPlant(
        SimulatedSettings(kind="simulated", step_ms=2.5, mismatch=mismatch, noise_um=noise), robot, PERIOD, 1
    )
    observer = observe(robot, **settings)
    m = robot.n_cables
    applied = Command(np.zeros(m), np.zeros(m))
    for k in range(round(seconds / PERIOD)):
        measured = spoil(k, plant.read())
        estimate = observer.update(measured, applied)
        yield plant.truth(), estimate, plant.state()[1]
        phase = 2 * np.pi * k * PERIOD / 3.0 + np.arange(m)
        u = speed * (1.0 + np.sin(phase)) * (k * PERIOD < 3.0)
        applied = plant.write(Command(u, measured.drive + PERIOD * u))


@pytest.mark.slow
def test_with_the_right_model_and_no_noise_it_follows_the_truth(tcr700):
    for truth, estimate, _ in watch(tcr700, 3.0):
        assert estimate.converged
        assert np.max(np.abs(estimate.q - truth.q)) < 2e-5
        np.testing.assert_allclose(estimate.tension, truth.tension, atol=0.1)


def test_marker_noise_stretches_no_rods(tcr700):
    """A ring keeps 6 of the 9 coordinates of its noise, its rigid motion; the sides keep their length."""
    ring, sides, tension = [], [], []
    for truth, estimate, _ in watch(tcr700, 5.0, noise=50.0, speed=0.0):
        q = estimate.q.reshape(-1, 3)
        ring.append((estimate.q - truth.q)[3 * tcr700.tip : 3 * tcr700.tip + 9])
        sides.append(np.linalg.norm(q[tcr700.tip] - q[tcr700.tip + 1]))
        tension.append(estimate.tension - truth.tension)
    assert np.std(ring) < 50e-6 * np.sqrt(6 / 9) * 1.1
    assert np.std(sides) < 0.05 * 50e-6
    assert np.std(tension) < 0.2


def test_velocity_follows_within_half_a_period(tcr600):
    states = list(watch(tcr600, 3.0))
    true = np.array([v for _, _, v in states])
    middle = 0.5 * (true[:-1] + true[1:])
    error = np.array([estimate.v for _, estimate, _ in states])[1:] - middle
    assert np.sqrt(np.mean(error**2)) < 0.25 * np.sqrt(np.mean(true**2))


@pytest.mark.slow
def test_the_end_pose_has_no_lasting_error_on_other_material(tcr700):
    mismatch = Mismatch(springs_youngs_modulus=0.7, density=1.2)
    states = list(watch(tcr700, 8.0, mismatch=mismatch, noise=50.0))[-40:]
    position = np.mean([estimate.position - truth.position for truth, estimate, _ in states], axis=0)
    normal = np.mean([estimate.normal - truth.normal for truth, estimate, _ in states], axis=0)
    assert np.linalg.norm(position) < 5e-5
    assert np.linalg.norm(normal) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("ring", [1, 7, 13])
def test_a_ring_that_is_not_seen_for_two_seconds_does_no_harm(tcr700, ring):
    def hide(k, measured):
        valid, nodes = measured.valid.copy(), measured.nodes.copy()
        if 20 <= k < 60:
            valid[3 * ring - 3 : 3 * ring] = False
            nodes[3 * ring - 3 : 3 * ring] = np.nan
        return replace(measured, valid=valid, nodes=nodes)

    for truth, estimate, _ in watch(tcr700, 4.0, spoil=hide):
        assert estimate.converged
        assert np.linalg.norm(estimate.position - truth.position) < 5e-4


def blank(measured):
    """The frame without any marker."""
    return replace(measured, valid=np.zeros_like(measured.valid), nodes=np.full_like(measured.nodes, np.nan))


def test_without_any_marker_the_model_goes_on_alone(tcr600):
    """If it is told to; it has the right material here."""

    def hide_all(k, measured):
        return blank(measured) if k > 10 else measured

    found = list(watch(tcr600, 3.0, spoil=hide_all, hold_blank=False))
    assert max(np.linalg.norm(e.position - t.position) for t, e, _ in found) < 5e-3
    assert not found[-1][1].disturbance.any()


def test_blank_frames_repeat_the_last_one(tcr600):
    seen = []

    def hide(k, measured):
        seen.append(measured)
        return blank(measured) if 10 <= k < 20 else measured

    def repeat(k, measured):
        return replace(measured, nodes=seen[9].nodes, valid=seen[9].valid) if 10 <= k < 20 else measured

    held = [e for _, e, _ in watch(tcr600, 1.5, spoil=hide)]
    repeated = [e for _, e, _ in watch(tcr600, 1.5, spoil=repeat)]
    for one, other in zip(held, repeated, strict=True):
        assert np.array_equal(one.q, other.q)
        assert np.array_equal(one.position, other.position)


def test_before_any_marker_was_seen_there_is_nothing_to_repeat(tcr600):
    """And the model is fitted to the first frame that has some."""
    estimates = [e for _, e, _ in watch(tcr600, 0.5, spoil=lambda k, m: blank(m) if k < 3 else m, speed=0.0)]
    for estimate in estimates:
        assert estimate.converged
        assert np.max(np.abs(estimate.q - tcr600.rest.q)) < 1e-5


def test_a_model_that_is_fitted_to_the_first_frame_does_not_move_there(tcr600):
    """The robot hangs 25 mm beside its model; fitted or not, it ends where the markers are."""
    beside = mechanics.altered("tcr600", "base.tilt_deg=[22.5,0]")
    plant = SimulatedPlant(SimulatedSettings(kind="simulated"), beside, PERIOD, 1)
    frame, still = plant.read(), Command(np.zeros(3), np.zeros(3))
    speeds = {}
    for fit in (True, False):
        observer = observe(tcr600, fit_start=fit)
        estimates = [observer.update(frame, still) for _ in range(60)]
        speeds[fit] = np.abs(estimates[0].v).max()
        assert np.linalg.norm(estimates[-1].position - plant.truth().position) < 1e-4
    assert np.linalg.norm(plant.truth().position - tcr600.rest_position) > 0.02
    assert speeds[True] < 1e-3
    assert speeds[False] > 0.2


def test_a_frame_that_nothing_can_be_fitted_to_leaves_the_model_at_rest(tcr600):
    plant = SimulatedPlant(SimulatedSettings(kind="simulated"), tcr600, PERIOD, 1)
    frame, still = plant.read(), Command(np.zeros(3), np.zeros(3))
    observer = observe(tcr600)
    absurd = replace(frame, nodes=frame.nodes[::-1] * 1e6)
    assert not observer.update(absurd, still).converged
    assert np.max(np.abs(observer.update(frame, still).q - tcr600.rest.q)) < 1e-5


def test_what_it_remembers_is_all_that_the_next_update_depends_on(tcr600):
    """A blank frame too."""
    moved = Command(np.zeros(3), np.full(3, 0.004))
    plant = SimulatedPlant(SimulatedSettings(kind="simulated"), tcr600, PERIOD, 1)
    one, other = observe(tcr600), observe(tcr600)
    other.update(plant.read(), moved)
    for _ in range(30):
        plant.write(Command(np.full(3, 0.01), np.zeros(3)))
        one.update(plant.read(), moved)
        other.update(plant.read(), moved)
    one.update(plant.read(), moved)
    for name, kept in one.memory().items():
        other.memory()[name].values[:] = kept.values
    nothing = blank(plant.read())
    assert np.array_equal(one.update(nothing, moved).q, other.update(nothing, moved).q)


def test_estimates_are_not_changed_by_later_updates(tcr600):
    kept = [(estimate, estimate.q.copy(), estimate.v.copy()) for _, estimate, _ in watch(tcr600, 0.5)]
    for estimate, q, v in kept:
        assert np.array_equal(estimate.q, q)
        assert np.array_equal(estimate.v, v)


def test_the_exact_state_needs_a_simulated_plant(tcr600):
    with pytest.raises(InputError, match="simulated"):
        build_estimator(ExactSettings(kind="exact"), tcr600, PERIOD, None)


def test_the_exact_state_is_the_plants(tcr600):
    plant = SimulatedPlant(SimulatedSettings(kind="simulated"), tcr600, PERIOD, 1)
    exact = build_estimator(ExactSettings(kind="exact"), tcr600, PERIOD, plant.state)
    rest = Command(np.zeros(3), np.zeros(3))
    plant.write(Command(np.full(3, 0.02), np.full(3, 0.001)))
    estimate = exact.update(plant.read(), rest)
    q, v = plant.state()
    assert np.array_equal(estimate.q, q)
    assert np.array_equal(estimate.v, v)
    np.testing.assert_allclose(estimate.tension, plant.truth().tension, atol=0.1)

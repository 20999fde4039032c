"""Laws of the passive observer: follows the truth, rejects noise, survives dropouts, no lasting pose error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tcrctl.errors import InputError
from tcrctl.estimator.estimator import build_estimator
from tcrctl.estimator.settings import ExactSettings, PassiveObserverSettings
from tcrctl.plant.settings import Mismatch, SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.signals import Command

PERIOD = 0.05


def watch(robot, seconds, *, mismatch=None, noise=0.0, spoil=lambda k, measured: measured, speed=0.01):
    """Run a plant with smooth drive speeds beside the observer; yields (truth, estimate, true v) per step."""
    plant = SimulatedPlant(
        SimulatedSettings(kind="simulated", step_ms=2.5, mismatch=mismatch, noise_um=noise), robot, PERIOD, 1
    )
    observer = build_estimator(PassiveObserverSettings(kind="passive_observer"), robot, PERIOD, None)
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


def test_without_any_marker_the_model_goes_on_alone(tcr600):
    def hide_all(k, measured):
        return replace(measured, valid=np.zeros_like(measured.valid)) if k > 10 else measured

    errors = [np.linalg.norm(e.position - t.position) for t, e, _ in watch(tcr600, 3.0, spoil=hide_all)]
    assert max(errors) < 5e-3


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

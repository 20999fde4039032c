"""The simulated plant as a bench: latency, noise, strokes, mismatch, repeatability, divergence."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.errors import DivergenceError
from tcrctl.plant.settings import Mismatch, SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.robot.module import FIXED, ring_rows
from tcrctl.signals import Command

PERIOD = 0.05


def build(robot, seed=1, period=PERIOD, **settings):
    return SimulatedPlant(SimulatedSettings(kind="simulated", **settings), robot, period, seed)


def command(plant, k):
    """Smooth, different speeds for all drives."""
    m = plant.robot.n_cables
    speed = 0.02 * (1.0 - np.cos(0.3 * k)) * np.cos(np.arange(m))
    return Command(speed, np.zeros(m))


def rings(robot, q):
    return q.reshape(-1, 3)[ring_rows(robot.n_modules)]


@pytest.mark.slow
@pytest.mark.parametrize("latency_ms", [0.0, 10.0, 50.0, 60.0, 150.0, 165.0])
def test_without_noise_a_measurement_is_the_truth_one_latency_earlier(tcr5x4, latency_ms):
    """The reference plant runs with a period of 5 ms, which divides every latency."""
    late, fine = build(tcr5x4, latency_ms=latency_ms), build(tcr5x4, period=0.005)
    history = [fine.truth().q]
    for k in range(12):
        measured = late.read()
        seen = max(0.0, late.time - latency_ms / 1000.0)
        assert measured.t == pytest.approx(seen, abs=1e-12)
        assert measured.nodes.dtype == np.float32
        np.testing.assert_allclose(measured.nodes, rings(tcr5x4, history[round(seen / 0.005)]), atol=2e-7)
        now = command(late, k)
        late.write(now)
        for _ in range(10):
            fine.write(now)
            history.append(fine.truth().q)
    assert np.abs(history[-1] - history[0]).max() > 5e-3


def test_the_latency_of_the_cameras_is_not_that_of_the_drives(tcr5x4):
    plant = build(tcr5x4, latency_ms=100.0)
    applied = plant.write(command(plant, 5))
    assert np.array_equal(plant.read().drive, applied.drive)
    assert np.array_equal(plant.read().nodes, rings(tcr5x4, tcr5x4.rest.q).astype(np.float32))


def test_noise_has_the_wanted_standard_deviation_and_no_bias(tcr700):
    plant = build(tcr700, noise_um=50.0)
    exact = rings(tcr700, tcr700.rest.q)
    errors = np.array([plant.read().nodes - exact for _ in range(200)])
    n = errors.size
    assert errors.std() == pytest.approx(50e-6, rel=5.0 / np.sqrt(2 * n))
    assert abs(errors.mean()) < 5.0 * 50e-6 / np.sqrt(n)
    lagged = np.corrcoef(errors[:-1].ravel(), errors[1:].ravel())[0, 1]
    assert abs(lagged) < 5.0 / np.sqrt(n)


def record(plant, steps=10):
    """Bytes of everything the plant says."""
    out = []
    for k in range(steps):
        measured, truth = plant.read(), plant.truth()
        applied = plant.write(command(plant, k))
        parts = (measured.nodes, measured.drive, truth.q, truth.tension, truth.position, truth.normal)
        out += [part.tobytes() for part in (*parts, applied.speed, applied.drive)]
    return out


def test_the_same_seed_gives_the_same_bytes_and_another_one_does_not(tcr700):
    settings = {"noise_um": 50.0, "latency_ms": 10.0}
    first = record(build(tcr700, seed=3, **settings))
    assert record(build(tcr700, seed=3, **settings)) == first
    assert record(build(tcr700, seed=4, **settings)) != first


def test_noise_does_not_touch_the_truth(tcr5x4):
    noisy, clean = build(tcr5x4, noise_um=500.0), build(tcr5x4)
    record(noisy)
    record(clean)
    assert np.array_equal(noisy.truth().q, clean.truth().q)


def test_only_the_chosen_rings_are_seen(tcr5x4):
    measured = build(tcr5x4, measured_rings=(2, 5)).read()
    seen = np.array(ring_rows(5))[measured.valid] // FIXED
    assert sorted(set(seen.tolist())) == [2, 5]
    assert measured.valid.sum() == 6
    assert build(tcr5x4).read().valid.all()


def test_other_material_gives_another_rest_shape_and_starts_at_rest(tcr700):
    mismatch = Mismatch(springs_youngs_modulus=0.7, density=1.2)
    plant = build(tcr700, mismatch=mismatch)
    assert abs(plant.truth().position[2] - tcr700.rest_position[2]) > 1e-4
    before = plant.truth()
    still = Command(np.zeros(6), np.zeros(6))
    for _ in range(5):
        plant.write(still)
    np.testing.assert_allclose(plant.truth().q, before.q, atol=1e-8)
    np.testing.assert_allclose(plant.truth().tension, before.tension, atol=1e-5)


def test_drives_stop_at_the_ends_of_their_stroke_and_say_so(tcr5x4):
    plant, low, high = build(tcr5x4), *tcr5x4.stroke
    fast = np.array([0.3, -0.3, 0.0, 0.0])
    for _ in range(20):
        before = plant.read().drive
        applied = plant.write(Command(fast, np.zeros(4)))
        assert np.all((applied.drive >= low) & (applied.drive <= high))
        np.testing.assert_allclose(applied.drive - before, PERIOD * applied.speed, atol=1e-15)
        assert np.array_equal(plant.read().drive, applied.drive)
    assert applied.drive[:2].tolist() == [high, low]
    assert applied.speed.tolist() == [0.0] * 4


def test_slack_cables_never_push(tcr700):
    plant, slack = build(tcr700), False
    for _ in range(20):
        plant.write(Command(np.array([0.06, 0.06, -0.1, -0.1, -0.1, 0.06]), np.zeros(6)))
        tension = plant.truth().tension
        assert tension.min() >= 0.0
        slack = slack or bool((tension == 0.0).any())
    assert slack


def test_truth_and_measurements_are_not_changed_by_later_steps(tcr5x4):
    plant = build(tcr5x4)
    truth, measured, (q, v) = plant.truth(), plant.read(), plant.state()
    kept = [x.copy() for x in (truth.q, truth.tension, measured.nodes, measured.drive, q, v)]
    record(plant, 3)
    for now, then in zip((truth.q, truth.tension, measured.nodes, measured.drive, q, v), kept, strict=True):
        assert np.array_equal(now, then)


def test_chosen_steps_move_the_robot_as_fixed_ones_do(tcr5x4):
    fixed, chosen = build(tcr5x4), build(tcr5x4, step_ms="auto")
    for k in range(20):
        fixed.write(command(fixed, k))
        chosen.write(command(chosen, k))
    assert 0.0 < np.abs(fixed.truth().q - chosen.truth().q).max() < 5e-6


@pytest.mark.parametrize(
    "effect", [{"friction": {"coefficient": 0.1}}, {"drives": {"lag_s": 0.05}}, {"cameras": {}}]
)
def test_what_is_not_ideal_goes_by_fixed_steps(tcr5x4, effect):
    fixed, chosen = build(tcr5x4, **effect), build(tcr5x4, step_ms="auto", step_error_um=10.0, **effect)
    for k in range(5):
        fixed.write(command(fixed, k))
        chosen.write(command(chosen, k))
    assert np.array_equal(fixed.truth().q, chosen.truth().q)


def test_a_plant_that_cannot_go_on_says_when_and_how_far_it_tried(tcr5x4):
    plant = build(tcr5x4)
    plant.write(command(plant, 3))
    with pytest.raises(DivergenceError) as caught:
        plant.write(Command(np.full(4, np.nan), np.zeros(4)))
    assert caught.value.time == PERIOD
    assert caught.value.smallest_h < 1e-3

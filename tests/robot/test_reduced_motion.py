"""Steps of reduced motion: against the equations of a stage, and without drag as with a drag of nothing."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.robot.reduced_motion import GAMMA, Pull, prepare, step

R, COLUMNS, H, ALPHA = 5, 4, 0.05, 4.0


def case(seed, drag=1.0):
    """Stiffness, and what acts; all drag times ``drag``."""
    rng = np.random.default_rng(seed)
    root, slip = rng.standard_normal((2, R, R))
    steady, held, growing = rng.standard_normal((3, R, COLUMNS))
    pull = Pull(growing, drag * steady, drag * slip @ slip.T, 0.4, drag * held, True)
    return 100.0 * root @ root.T + np.eye(R), pull, *rng.standard_normal((2, R, COLUMNS))


@pytest.mark.parametrize("seed", range(5))
def test_both_stages_hold_the_equations_of_motion(seed):
    stiffness, pull, x, v = case(seed)
    before, speed, held, b = x.copy(), v.copy(), pull.held.copy(), 1.0 / (GAMMA * H)
    stepping, positive = prepare(stiffness, ALPHA, H, pull)
    assert positive
    step(stepping, 0.0, pull, x, v)
    matrix = stiffness + b * pull.drag + (b * b + ALPHA * b) * np.eye(R)

    def stage(t):
        force = (b * b + ALPHA * b) * before + b * speed + b * pull.drag @ before
        force += pull.steady + (1.0 - pull.turned) * held + t * pull.growing
        at = np.linalg.solve(matrix, force)
        return at, b * (at - before)

    _, rate = stage(GAMMA * H)
    before, speed = before + (1.0 - GAMMA) * H * rate, speed + (1.0 - GAMMA) * H * b * (rate - speed)
    held += (1.0 - GAMMA) / GAMMA * (pull.steady - pull.drag @ rate - pull.turned * held)
    at, rate = stage(H)
    np.testing.assert_allclose(x, at, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(v, rate, rtol=1e-9, atol=1e-9)
    held += pull.steady - pull.drag @ rate - pull.turned * held
    np.testing.assert_allclose(pull.held, held, rtol=1e-9, atol=1e-9)


def test_without_drag_it_moves_as_with_a_drag_of_nothing():
    ends = []
    for drags in (True, False):
        stiffness, pull, x, v = case(7, drag=0.0)
        pull = pull._replace(drags=drags)
        stepping, _ = prepare(stiffness, ALPHA, H, pull)
        for n in range(10):
            step(stepping, n * H, pull, x, v)
        ends.append(np.stack([x, v]))
    assert np.array_equal(*ends)


def test_a_matrix_that_is_not_positive_is_told():
    stiffness, pull, _, _ = case(0)
    assert not prepare(stiffness - 1e6 * np.eye(R), ALPHA, H, pull)[1]

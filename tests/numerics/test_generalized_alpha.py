"""The generalized-alpha rule on a linear oscillator: dissipation at infinity, order two, conservation."""

from __future__ import annotations

import numpy as np
import pytest

from tcrctl.numerics.generalized_alpha import coefficients

RADII = [0.0, 0.3, 0.8, 1.0]


def step_matrix(rho, h, omega, damping=0.0):
    """Map of (q, v, a) over one step of q'' + damping q' + omega^2 q = 0, where q'' of (14) is eliminated by it."""
    c = coefficients(rho, h)

    def advance(state):
        q, v, a = state
        acceleration = -damping * v - omega**2 * q

        def rest(new_acceleration):
            """(12)-(14) for a given q'' at the end."""
            new_a = ((1 - c.alpha_f) * new_acceleration + c.alpha_f * acceleration - c.alpha_m * a) / (
                1 - c.alpha_m
            )
            new_q = q + h * v + h * h * ((0.5 - c.beta) * a + c.beta * new_a)
            new_v = v + h * ((1 - c.gamma) * a + c.gamma * new_a)
            return np.array([new_q, new_v, new_a])

        base, slope = rest(0.0), rest(1.0) - rest(0.0)
        # x = q'' solves x = -damping v(x) - omega^2 q(x), which is linear
        x = (-damping * base[1] - omega**2 * base[0]) / (1 + damping * slope[1] + omega**2 * slope[0])
        return base + x * slope

    return np.array([advance(row) for row in np.eye(3)]).T


@pytest.mark.parametrize("rho", RADII)
def test_the_coefficients_satisfy_the_conditions_of_order_two_and_optimal_dissipation(rho):
    c = coefficients(rho, 1e-3)
    assert c.gamma == pytest.approx(0.5 + c.alpha_f - c.alpha_m, abs=1e-15)
    assert c.beta == pytest.approx((0.5 + c.gamma) ** 2 / 4, abs=1e-15)
    assert c.alpha_m <= c.alpha_f <= 0.5


@pytest.mark.parametrize("rho", RADII)
def test_at_infinite_frequency_all_eigenvalues_have_the_given_magnitude(rho):
    polynomial = np.poly(
        step_matrix(rho, 1.0, 1e4)
    )  # the triple root itself would lose two thirds of the digits
    np.testing.assert_allclose(polynomial, [1.0, 3 * rho, 3 * rho**2, rho**3], atol=1e-6)


@pytest.mark.parametrize("rho", RADII)
def test_it_is_stable_at_every_frequency(rho):
    for omega in np.geomspace(1e-3, 1e5, 200):
        assert np.abs(np.linalg.eigvals(step_matrix(rho, 1.0, omega))).max() <= 1.0 + 1e-6


def test_without_dissipation_the_oscillation_keeps_its_amplitude():
    for omega in (0.1, 1.0, 30.0):
        assert np.sort(np.abs(np.linalg.eigvals(step_matrix(1.0, 1.0, omega))))[-2:] == pytest.approx(
            [1.0, 1.0], abs=1e-7
        )


def error_at_one_second(rho, h):
    """Error of position and velocity of a damped oscillator after 1 s."""
    omega, damping = 5.0, 0.8
    state = np.array([1.0, 0.0, -(omega**2)])
    step = step_matrix(rho, h, omega, damping)
    for _ in range(round(1 / h)):
        state = step @ state
    decay, ringing = damping / 2, np.sqrt(omega**2 - damping**2 / 4)
    c, s = np.cos(ringing), np.sin(ringing)
    exact = np.exp(-decay) * np.array([c + decay / ringing * s, -(omega**2) / ringing * s])
    return np.abs(state[:2] - exact)


@pytest.mark.parametrize("rho", RADII)
def test_positions_and_velocities_converge_with_the_square_of_the_step(rho):
    order = np.log2(error_at_one_second(rho, 1 / 200) / error_at_one_second(rho, 1 / 400))
    assert np.all((order > 1.9) & (order < 2.1))


@pytest.mark.parametrize("rho", RADII)
def test_rates_of_the_implicit_position_are_those_of_the_update_formulas(rho):
    h = 2e-3
    c = coefficients(rho, h)
    # q'' = 1 at the end moves a by (1 - alpha_f) / (1 - alpha_m), q by h^2 beta and v by h gamma times that
    a = (1 - c.alpha_f) / (1 - c.alpha_m)
    assert c.acceleration == pytest.approx(1.0 / (h * h * c.beta * a), rel=1e-14)
    assert c.velocity == pytest.approx(h * c.gamma * a / (h * h * c.beta * a), rel=1e-14)

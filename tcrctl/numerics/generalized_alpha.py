"""Coefficients of the generalized-alpha rule (12)-(15), (27) corrected. Source: [CH93], [AB07]."""

from __future__ import annotations

from typing import NamedTuple

from tcrctl.numerics.kernel import kernel


class Coefficients(NamedTuple):
    """Coefficients of one step of the rule.

    Attributes:
        alpha_m: α_m of (14).
        alpha_f: α_f of (14).
        beta: β of (12).
        gamma: γ of (13).
        velocity: ∂q̇/∂q = γ / (β h) [1/s].
        acceleration: ∂q̈/∂q = (1 - α_m) / (β h² (1 - α_f)) [1/s2]; (27) with its missing factor.
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    velocity: float
    acceleration: float


@kernel()
def coefficients(spectral_radius: float, h: float) -> Coefficients:
    """Return (15) for ``spectral_radius`` ρ in [0, 1] at infinite frequency and internal step ``h`` [s]."""
    rho = spectral_radius
    alpha_m = (2.0 * rho - 1.0) / (rho + 1.0)
    alpha_f = rho / (rho + 1.0)
    beta = (1.0 + alpha_f - alpha_m) ** 2 / 4.0
    gamma = 0.5 + alpha_f - alpha_m
    return Coefficients(
        alpha_m,
        alpha_f,
        beta,
        gamma,
        gamma / (beta * h),
        (1.0 - alpha_m) / (beta * h * h * (1.0 - alpha_f)),
    )

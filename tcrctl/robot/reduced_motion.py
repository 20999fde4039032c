"""One time step of reduced equations of motion with drag that follows late.

Positions x, speeds v and drag f of a small orthonormal basis, for several columns of forces at once:

    x'' + α x' + A x = f + t P,        τ f' = F - D x' - f

by the two-stage, L-stable, second-order SDIRK rule with γ = 1 - 1/√2 [A77]. Within a stage the drag is solved for:
γ h / (τ + γ h) of its way count with the stage, the rest is that of its start.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from tcrctl.numerics import block_banded
from tcrctl.signals import Array

GAMMA = 1.0 - np.sqrt(0.5)


class Pull(NamedTuple):
    """What acts on the reduced positions, for a unit ramp of every drive and none.

    Attributes:
        growing: P, force per time (r, m + 1).
        steady: F, force while the drive moves (r, m + 1).
        drag: D, force per speed (r, r).
        turned: Part of the drag that follows the slip within a stage, γ h / (τ + γ h); it is in D and F already.
        held: Drag at the start of a stage (r, m + 1), changed from stage to stage.
    """

    growing: Array
    steady: Array
    drag: Array
    turned: float
    held: Array


@njit(cache=True, error_model="numpy")
def _stage(U: Array, a: float, b: float, t: float, pull: Pull, x: Array, v: Array, X: Array) -> None:
    """Set X = (a I + b D + V'AV)^-1 (a x + b v + b D x + F + f + t P): positions of a stage, from its start x, v.

    D and F are the parts that follow within the stage, f what is left of the drag of its start.
    """
    left = 1.0 - pull.turned
    for i in range(X.shape[0]):
        for c in range(X.shape[1]):
            X[i, c] = a * x[i, c] + b * v[i, c] + pull.steady[i, c] + t * pull.growing[i, c]
            X[i, c] += left * pull.held[i, c]
            for j in range(X.shape[0]):
                X[i, c] += b * pull.drag[i, j] * x[j, c]
    block_banded.solve_transposed(U, X)
    block_banded.solve_upper(U, X)


@njit(cache=True, error_model="numpy")
def _turn(pull: Pull, speed: Array, part: float) -> None:
    """Let the drag go a part of its way in a stage, whose speeds are (r, m + 1)."""
    for i in range(speed.shape[0]):
        for c in range(speed.shape[1]):
            goal = pull.steady[i, c]
            for j in range(speed.shape[0]):
                goal -= pull.drag[i, j] * speed[j, c]
            pull.held[i, c] += part * (goal - pull.turned * pull.held[i, c])


@njit(cache=True, error_model="numpy")
def step(U: Array, damping: float, t: float, h: float, pull: Pull, x: Array, vx: Array) -> None:
    """Move on by one step.

    Args:
        U: Factor of (b² + α b) I + b D + A (r, r), b = 1 / (γ h), D with the part that follows within a stage.
        damping: α [1/s].
        t: Time at the start [s].
        h: Length of the step [s].
        pull: What acts; its drag is changed.
        x: Positions (r, columns), changed.
        vx: Speeds (r, columns), changed.
    """
    b = 1.0 / (GAMMA * h)
    a, stage, speed = b * b + damping * b, np.empty(x.shape), np.empty(x.shape)
    _stage(U, a, b, t + GAMMA * h, pull, x, vx, stage)
    for i in range(x.shape[0]):
        for c in range(x.shape[1]):
            speed[i, c] = b * (stage[i, c] - x[i, c])
            x[i, c] += (1.0 - GAMMA) * h * speed[i, c]
            vx[i, c] += (1.0 - GAMMA) * h * b * (speed[i, c] - vx[i, c])
    _turn(pull, speed, (1.0 - GAMMA) / GAMMA)
    _stage(U, a, b, t + h, pull, x, vx, stage)
    for i in range(x.shape[0]):
        for c in range(x.shape[1]):
            vx[i, c] = b * (stage[i, c] - x[i, c])
            x[i, c] = stage[i, c]
    _turn(pull, vx, 1.0)

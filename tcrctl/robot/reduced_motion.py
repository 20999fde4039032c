"""One time step of reduced equations of motion with drag that follows late.

Positions x, speeds v and drag f of a small orthonormal basis, for several columns of forces at once:

    x'' + α x' + A x = f + t P,        τ f' = F - D x' - f

by the two-stage, L-stable, second-order SDIRK rule with γ = 1 - 1/√2 [A77]. Within a stage the drag is solved for:
γ h / (τ + γ h) of its way count with the stage, the rest is that of its start. Loops run over all columns at
once: seven of them are too few for the processor's vectors.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.numerics import block_banded
from tcrctl.numerics.kernel import part
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
        drags: There is any drag; without it F, D and what is held are zero.
    """

    growing: Array
    steady: Array
    drag: Array
    turned: float
    held: Array
    drags: bool


class Stepping(NamedTuple):
    """What all steps have in common.

    Attributes:
        inverse: ((b² + α b) I + b D + A)^-1 (r, r), b = 1 / (γ h), D with the part that follows within a stage.
        h: Length of a step [s].
        damping: α [1/s].
        force, stage, speed: Scratch (r, m + 1).
    """

    inverse: Array
    h: float
    damping: float
    force: Array
    stage: Array
    speed: Array


@part(error_model="numpy")
def prepare(stiffness: Array, damping: float, h: float, pull: Pull) -> tuple[Stepping, bool]:
    """Get ready for steps of length h; False if the matrix of a stage is not positive definite.

    Args:
        stiffness: A (r, r).
        damping: α [1/s].
        h: Length of a step [s].
        pull: What acts.
    """
    r, columns, b = stiffness.shape[0], pull.growing.shape[1], 1.0 / (GAMMA * h)
    matrix, inverse = np.empty((r, r)), np.zeros((r, r))
    for i in range(r):
        for j in range(r):
            matrix[i, j] = stiffness[i, j] + b * pull.drag[i, j]
        matrix[i, i] += b * b + damping * b
        inverse[i, i] = 1.0
    positive = block_banded.factor_diagonal(matrix)
    if positive:
        block_banded.solve_transposed(matrix, inverse)
        block_banded.solve_upper(matrix, inverse)
    scratch = np.empty((3, r, columns))
    return Stepping(inverse, h, damping, scratch[0], scratch[1], scratch[2]), positive


@part(error_model="numpy")
def _stage(s: Stepping, t: float, pull: Pull, x: Array, v: Array) -> None:
    """Set the positions of a stage, from its start x, v: inverse (a x + b v + b D x + F + f + t P), a = b² + α b.

    D and F are the parts that follow within the stage, f what is left of the drag of its start.
    """
    b, left = 1.0 / (GAMMA * s.h), 1.0 - pull.turned
    a, force = b * b + s.damping * b, s.force.ravel()
    at, speed, growing = x.ravel(), v.ravel(), pull.growing.ravel()
    for k in range(force.shape[0]):
        force[k] = a * at[k] + b * speed[k] + t * growing[k]
    if pull.drags:
        np.dot(pull.drag, x, s.stage)
        slip, steady, held = s.stage.ravel(), pull.steady.ravel(), pull.held.ravel()
        for k in range(force.shape[0]):
            force[k] += b * slip[k] + steady[k] + left * held[k]
    np.dot(s.inverse, s.force, s.stage)


@part(error_model="numpy")
def _turn(s: Stepping, pull: Pull, speed: Array, part: float) -> None:
    """Let the drag go a part of its way in a stage, whose speeds are (r, m + 1)."""
    if pull.drags:
        np.dot(pull.drag, speed, s.force)
        slip, steady, held = s.force.ravel(), pull.steady.ravel(), pull.held.ravel()
        for k in range(held.shape[0]):
            held[k] += part * (steady[k] - slip[k] - pull.turned * held[k])


@part(error_model="numpy")
def step(s: Stepping, t: float, pull: Pull, x: Array, vx: Array) -> None:
    """Move on by one step.

    Args:
        s: From :func:`prepare`.
        t: Time at the start [s].
        pull: What acts; its drag is changed.
        x: Positions (r, columns), changed.
        vx: Speeds (r, columns), changed.
    """
    h, b, way = s.h, 1.0 / (GAMMA * s.h), (1.0 - GAMMA) * s.h
    at, now, stage, speed = x.ravel(), vx.ravel(), s.stage.ravel(), s.speed.ravel()
    _stage(s, t + GAMMA * h, pull, x, vx)
    for k in range(at.shape[0]):
        speed[k] = b * (stage[k] - at[k])
        at[k] += way * speed[k]
        now[k] += way * b * (speed[k] - now[k])
    _turn(s, pull, s.speed, (1.0 - GAMMA) / GAMMA)
    _stage(s, t + h, pull, x, vx)
    for k in range(at.shape[0]):
        now[k] = b * (stage[k] - at[k])
        at[k] = stage[k]
    _turn(s, pull, vx, 1.0)

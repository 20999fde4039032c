"""A prediction of the end pose and the tensions over a horizon: what it is told, what it gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from tcrctl.controller.blocks import Grid
from tcrctl.controller.drive_lag import DriveLag
from tcrctl.controller.inner_map import Linearisable
from tcrctl.controller.ioc import Prediction
from tcrctl.robot.statics import SHARP, TOLERANCE
from tcrctl.signals import Array, Estimate


class Now(NamedTuple):
    """What a kernel is told of the present.

    Attributes:
        q: Node positions (3 n_nodes,) [m].
        v: Node velocities (3 n_nodes,) [m/s].
        drive: Drive lengths d (m,) [m].
        outputs: Outputs as they should be now (7 + m,).
    """

    q: Array
    v: Array
    drive: Array
    outputs: Array
    speed: Array
    behind: Array
    queue: Array


class Tuning(NamedTuple):
    """Numbers that a kernel needs beside arrays.

    Attributes:
        period: Control period [s].
        blend: Part of the way that the offset Δ goes in one step; 0 keeps it.
        tolerance: Largest nodal force left in the equilibrium [N].
    """

    period: float
    blend: float
    tolerance: float = TOLERANCE
    turn: float = 0.0
    drives: DriveLag = DriveLag(0.0, 0.0)

    def sharp(self) -> Tuning:
        """Return the same with solutions that are exact to rounding."""
        return self._replace(tolerance=SHARP)


def make_tuning(period: float, filter_s: float | None) -> Tuning:
    """Return the tuning of an offset filter with a time constant [s], or of none."""
    return Tuning(period, 0.0 if filter_s is None else -float(np.expm1(-period / filter_s)))


@dataclass(frozen=True, slots=True)
class Forecast:
    """A prediction with proof.

    Attributes:
        prediction: Affine in the inputs of all blocks.
        converged: The prediction can be trusted.
        iterations: Newton iterations.
        residual: Largest nodal force left [N].
        reason: Empty, or why it cannot be trusted.
        rest_gain: Derivatives of position and normal by the drives at rest (6, m), for a feedforward; or None.
    """

    prediction: Prediction
    converged: bool
    iterations: int
    residual: float
    reason: str = ""
    rest_gain: Array | None = None


class Predictor(Linearisable, Protocol):
    """One way to predict.

    Attributes:
        grid: Prediction instants and input blocks.
    """

    grid: Grid

    def predict(self, estimate: Estimate, age: float, outputs: Array, speed: Array) -> Forecast:
        """Predict from an estimate that is ``age`` [s] old.

        Args:
            estimate: The state.
            age: Its age [s].
            outputs: Outputs (7 + m,) as they should be now.
            speed: The last input (m,) [m/s].
        """
        ...

"""A prediction of the end pose and the tensions over a horizon: what it is told, what it gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from tcrctl.controller.blocks import Grid
from tcrctl.controller.drag_share import Learning
from tcrctl.controller.drive_lag import DriveLag
from tcrctl.controller.inner_map import Linearisable
from tcrctl.controller.ioc import Prediction
from tcrctl.controller.plan import Situation
from tcrctl.controller.rest_gain import GainLearning
from tcrctl.robot.statics import SHARP, TOLERANCE
from tcrctl.signals import Array


class Now(NamedTuple):
    """What a kernel is told of the present.

    Attributes:
        q: Node positions as measured (3 n_nodes,) [m].
        v: Node velocities (3 n_nodes,) [m/s].
        drive: Drive lengths d (m,) [m].
        outputs: Outputs as they should be now (7 + m,).
        speed: The last input (m,) [m/s].
        age: Time since q was measured, which v has moved it on [s].
        set_point: Drive lengths that were sent last (m,) [m].
        arrived: Those sent a dead time of the drives ago (m,) [m].
        place: Where the dither has moved the drives (m,) [m]: it is counted as if it ended now, what it has moved
            comes back, and the prediction is one of the mean.
    """

    q: Array
    v: Array
    drive: Array
    outputs: Array
    speed: Array
    age: float
    set_point: Array
    arrived: Array
    place: Array


class Tuning(NamedTuple):
    """Numbers that a kernel needs beside arrays.

    Attributes:
        period: Control period [s].
        blend: Part of the way that the offset Δ goes in one step; 0 keeps it.
        tolerance: Largest nodal force left in the equilibrium [N].
        turn: Time of a turn of the friction over the amplitude of the dither [s/m], see robot.hole_drag.
        learning: How the drag is learnt.
        drives: Their lag.
        follow: Time constant with which drag follows the slip [s].
        gain: How it is learnt where the offset goes with the drives.
        rests: The robot is known to rest: the offset is filtered, and nothing is learnt.
    """

    period: float
    blend: float
    tolerance: float = TOLERANCE
    turn: float = 0.0
    learning: Learning = Learning(0.0, 0.0, 0.0, 0.0, 0.0)
    drives: DriveLag = DriveLag(0.0, 0.0)
    follow: float = 0.0
    gain: GainLearning = GainLearning()
    rests: bool = False

    def sharp(self) -> Tuning:
        """Return the same with solutions that are exact to rounding, and nothing learnt any more."""
        return self._replace(tolerance=SHARP, gain=GainLearning())


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

    def predict(self, at: Situation) -> Forecast:
        """Predict from one control step, as far as it is known."""
        ...


def present(at: Situation) -> Now:
    """Return what a kernel is told of a control step."""
    x, place = at.estimate, at.dither.place
    return Now(x.q, x.v, x.drive, at.outputs, at.previous, at.age, x.set_point, x.arrived, place)

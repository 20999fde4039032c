"""What the controller needs of a prediction of the end pose and the tensions over its horizon."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from tcrctl.controller.inner_map import InnerMap
from tcrctl.controller.ioc import Prediction
from tcrctl.memory import Kept
from tcrctl.signals import Array, Estimate


@dataclass(frozen=True, slots=True)
class Forecast:
    """A prediction with proof.

    Attributes:
        prediction: Affine in the inputs of all blocks.
        converged: The prediction can be trusted.
        iterations: Newton iterations.
        residual: Largest nodal force left [N].
        reason: Empty, or why it cannot be trusted.
        rest_gain: Derivatives of position and normal by the drives at rest (6, m), if it knows them.
    """

    prediction: Prediction
    converged: bool
    iterations: int
    residual: float
    reason: str = ""
    rest_gain: Array | None = None


class Predictor(Protocol):
    """One way to predict.

    Attributes:
        ahead: Prediction instants after the step (n,) [s].
        blocks: Number of input blocks.
        edges: Instants at which the blocks begin, and the end (blocks + 1,).
    """

    ahead: Array
    blocks: int
    edges: Array

    def predict(self, estimate: Estimate, age: float, now: Array, speed: Array) -> Forecast:
        """Predict from an estimate that is ``age`` [s] old.

        Args:
            estimate: The state.
            age: Its age [s].
            now: Outputs (7 + m,) as they should be now.
            speed: The last input (m,) [m/s].
        """
        ...

    def sharpen(self) -> None:
        """From now on solve to rounding: what a tick tolerates is a step in the map that is to be linearised."""
        ...

    def memory(self) -> Mapping[str, Kept]:
        """What the next prediction depends on; see :class:`tcrctl.memory.Remembers`."""
        ...

    def inner_map(self) -> InnerMap | None:
        """The iteration of the last prediction; None if it did not end in a solution."""
        ...

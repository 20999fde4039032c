"""The whole loop as one map from its memory to its memory one control step later, and the derivative of that map.

    memory = plant, estimator, controller       x_k+1 = F_k(x_k),  J = ∂F_k/∂x

F_k runs the parts themselves on a copy, so whatever they do is in it: integrator, observer, filters, statics, LCP.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tcrctl.controller.controller import Controller
from tcrctl.estimator.estimator import Estimator
from tcrctl.loop.loop import still
from tcrctl.memory import Kept, Remembers
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.signals import Array, Command, ControlInfo, Reference


@dataclass(slots=True)
class ClosedLoop:
    """The parts of a loop between two steps.

    Attributes:
        plant: Simulated plant, without noise.
        estimator: The estimator.
        controller: The controller.
        applied: What the plant was told last; None before the first step.
    """

    plant: SimulatedPlant
    estimator: Estimator
    controller: Controller
    applied: Command | None = None

    def step(self, reference: Reference) -> ControlInfo:
        """One control step, as in :func:`tcrctl.loop.loop.run_loop`.

        Raises:
            DivergenceError: If the plant's integrator did not converge.
        """
        measured = self.plant.read()
        estimate = self.estimator.update(measured, self.applied or still(measured))
        wanted, info = self.controller.control(estimate, reference)
        self.applied = self.plant.write(wanted)
        return info

    def kept(self) -> dict[str, Kept]:
        """Everything that the next step depends on, by ``part.name``."""
        parts: dict[str, Remembers] = {
            "plant": self.plant,
            "estimator": self.estimator,
            "controller": self.controller,
        }
        return {
            f"{part}.{name}": kept for part, owner in parts.items() for name, kept in owner.memory().items()
        }


class After(NamedTuple):
    """A loop after a step, and how the controller came to its command."""

    loop: ClosedLoop
    info: ControlInfo


class StepMap:
    """F of the module's docstring about one state, in the scales of :class:`tcrctl.memory.Kept`.

    Attributes:
        size: Number of states n.
    """

    def __init__(self, loop: ClosedLoop, reference: Reference) -> None:
        """Take a loop between two steps, and what is wanted in the coming one.

        Args:
            loop: Is copied.
            reference: The same for every state.
        """
        self._loop, self._reference = copy.deepcopy(loop), reference
        kept = self._loop.kept()
        self._blind = {name: part.blind.copy() for name, part in kept.items() if part.blind is not None}
        self.size = sum(part.values.size for part in kept.values())

    def __call__(self, deviation: Array) -> Array:
        """State one step after the present state + ``deviation``, both (n,)."""
        return self._read(self.after(deviation).loop)

    def after(self, deviation: Array) -> After:
        """The loop one step after the present state + ``deviation`` (n,).

        Raises:
            DivergenceError: If the plant's integrator did not converge.
        """
        loop, first = copy.deepcopy(self._loop), 0
        for name, part in loop.kept().items():
            change = deviation[first : first + part.values.size]
            np.add(part.values, part.scale * self._seen(name, change), out=part.values)
            first += part.values.size
        return After(loop, loop.step(self._reference))

    def _read(self, loop: ClosedLoop) -> Array:
        kept = loop.kept()
        return np.concatenate([self._seen(name, part.values / part.scale) for name, part in kept.items()])

    def _seen(self, name: str, values: Array) -> Array:
        """Values without the part that has no effect: left in, it would be an eigenvalue 1 that means nothing."""
        blind = self._blind.get(name)
        return values if blind is None else values - blind * (blind @ values)

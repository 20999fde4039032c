"""The whole loop as one map from its memory to its memory one control step later, and the derivative of that map.

    memory = plant, estimator, controller       x_k+1 = F_k(x_k),  J = ∂F_k/∂x

F_k is the tick of the loop itself on a copy of its parts, so whatever they do is in it: integrator, observer,
filters, statics, LCP.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from tcrctl.errors import InputError
from tcrctl.loop.loop import Parts, tick
from tcrctl.loop.safety import SafetyGuard
from tcrctl.memory import POSITION, Kept, Remembers
from tcrctl.signals import Array, Command, ControlInfo


@dataclass(slots=True)
class ClosedLoop:
    """The parts of a loop between two steps.

    Attributes:
        parts: A simulated plant without noise, estimator, controller and trajectory.
        k: The coming step.
        applied: What the plant was told last; None before the first step.
    """

    parts: Parts
    k: int = 0
    applied: Command | None = None

    def step(self) -> ControlInfo:
        """Do the coming control step.

        Raises:
            StoppedError: If the plant's integrator did not converge, or the command is no number.
        """
        step, broken = tick(self.parts, self.k, self.applied)
        if broken is not None:
            raise broken
        self.k, self.applied = self.k + 1, step.applied
        return step.info

    def kept(self) -> dict[str, Kept]:
        """Return everything that the next step depends on, by ``part.name``.

        Raises:
            InputError: If a part does not tell what it remembers.
        """
        parts = self.parts
        owners = {"plant": parts.plant, "estimator": parts.estimator, "controller": parts.controller}
        found: dict[str, Kept] = {}
        if self.applied is not None:  # from it the drives are known, beside what they report
            found["loop.set_point"] = Kept(self.applied.drive, POSITION)
        for part, owner in owners.items():
            if not isinstance(owner, Remembers):
                raise InputError(f"the {part} does not tell what it remembers, so it cannot be linearised")
            found.update({f"{part}.{name}": kept for name, kept in owner.memory().items()})
        return found

    def __deepcopy__(self, memo: dict[int, Any]) -> ClosedLoop:
        """Copy what a step changes, without limits and record; the trajectory never changes."""
        parts, applied = self.parts, self.applied
        changing = (parts.plant, parts.estimator, parts.controller, applied)
        plant, estimator, controller, applied = copy.deepcopy(changing, memo)
        copied = replace(parts, plant=plant, estimator=estimator, controller=controller, guard=SafetyGuard())
        return ClosedLoop(copied, self.k, applied)


class After(NamedTuple):
    """A loop after a step, and how the controller came to its command."""

    loop: ClosedLoop
    info: ControlInfo


class StepMap:
    """F of the module's docstring about one state, in the scales of :class:`tcrctl.memory.Kept`.

    Attributes:
        size: Number of states n.
    """

    def __init__(self, loop: ClosedLoop) -> None:
        """Copy a loop between two steps."""
        self._loop = copy.deepcopy(loop)
        kept = self._loop.kept()
        self._blind = {name: part.blind.copy() for name, part in kept.items() if part.blind is not None}
        self.size = sum(part.values.size for part in kept.values())

    def __call__(self, deviation: Array) -> Array:
        """Return the state one step after the present state + ``deviation``, both (n,)."""
        return self._read(self.after(deviation).loop)

    def after(self, deviation: Array) -> After:
        """Return the loop one step after the present state + ``deviation`` (n,).

        Raises:
            StoppedError: If the plant's integrator did not converge, or the command is no number.
        """
        loop, first = copy.deepcopy(self._loop), 0
        for name, part in loop.kept().items():
            change = deviation[first : first + part.values.size]
            np.add(part.values, part.scale * self._seen(name, change), out=part.values)
            first += part.values.size
        return After(loop, loop.step())

    def _read(self, loop: ClosedLoop) -> Array:
        kept = loop.kept()
        return np.concatenate([self._seen(name, part.values / part.scale) for name, part in kept.items()])

    def _seen(self, name: str, values: Array) -> Array:
        """Return values without the part that has no effect, which would be an eigenvalue 1 that means nothing."""
        blind = self._blind.get(name)
        return values if blind is None else values - blind * (blind @ values)

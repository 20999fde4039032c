"""Files, options and names that cannot be used, and robots or references that cannot be: exit code 2."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass

from tcrctl.errors.base import TcrctlError
from tcrctl.visible import visible


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong in an input file.

    Attributes:
        where: ``file:line:column`` or ``--set key`` of the offending value.
        key: Dotted path of the value, for instance ``controller.horizon_s``.
        message: What is wrong, with the value and what was allowed.
    """

    where: str
    key: str
    message: str

    def __str__(self) -> str:
        """Return ``where: key: message``, without the key where it would stand twice."""
        if not self.key or self.where == f"--set {self.key}":
            return visible(f"{self.where}: {self.message}")
        return visible(f"{self.where}: {self.key}: {self.message}")


class InputError(TcrctlError):
    """A file, option or name given by the user cannot be used."""

    exit_code = 2


class SpecError(InputError):
    """A YAML file has problems; all of them are listed at once.

    Attributes:
        problems: Every problem found, in file order.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        super().__init__("\n".join(str(problem) for problem in problems))
        self.problems = tuple(problems)


class UnknownNameError(InputError):
    """A name was given that does not exist.

    Attributes:
        kind: What was looked for ("experiment", "robot", "node", ...).
        name: The name given.
        allowed: The names that exist.
    """

    def __init__(self, kind: str, name: str, allowed: Sequence[str]) -> None:
        name = name if len(name) <= 100 else f"{name[:100]}..."
        close = difflib.get_close_matches(name, allowed, n=1)
        hint = f"Did you mean {close[0]}?" if close else ""
        super().__init__(f"there is no {kind} named {name!r}; known: {', '.join(allowed)}", hint=hint)
        self.kind = kind
        self.name = name
        self.allowed = tuple(allowed)


class InfeasibleError(InputError):
    """The reference cannot be followed by this robot within its limits.

    Attributes:
        time: First offending time [s].
        quantity: Name of the quantity that breaks its limit.
        value: Its value.
        limit: The limit.
        unit: Unit of value and limit.
    """

    def __init__(
        self, time: float, quantity: str, value: float, limit: float, unit: str, *, hint: str = ""
    ) -> None:
        super().__init__(
            f"infeasible at t = {time:.3f} s: {quantity} is {value:.4g} {unit}, limit {limit:.4g} {unit}",
            hint=hint,
        )
        self.time = time
        self.quantity = quantity
        self.value = value
        self.limit = limit
        self.unit = unit


class NoEquilibriumError(InputError):
    """The static problem has no solution that the solver could find.

    Attributes:
        residual: Largest remaining nodal force [N].
        tolerance: Force accepted as equilibrium [N].
        iterations: Newton iterations spent.
    """

    def __init__(self, what: str, residual: float, tolerance: float, iterations: int) -> None:
        super().__init__(
            f"no equilibrium found for {what}: largest nodal force {residual:.3g} N after {iterations} "
            f"iterations, accepted {tolerance:.3g} N",
            hint="Check spring stiffness, initial tension and cone height; "
            "a slack or buckled robot has no stable shape.",
        )
        self.residual = residual
        self.tolerance = tolerance
        self.iterations = iterations

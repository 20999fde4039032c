"""What a kind of controller supplies, a plan, and what it is told for it; all else is in the shell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tcrctl.controller.dither import Dithered
from tcrctl.controller.inner_map import Linearisable
from tcrctl.signals import Array, Estimate, Reference


@dataclass(frozen=True, slots=True)
class Situation:
    """One control step as a planner sees it.

    Attributes:
        estimate: The state.
        reference: What is wanted.
        age: Time since the state was measured, which the planner counts [s].
        outputs: Outputs now (7 + m,): end position, normal, twist, tensions.
        error: Wanted minus present end pose (6,): position [m], normal.
        shift: What the integral action adds to the target pose (6,): position [m], normal.
        previous: The speeds that were sent last (m,) [m/s].
        low: Lower limits of the inputs of all blocks (blocks * m,) [m/s].
        high: Upper limits (blocks * m,) [m/s].
        doubt: Empty, or why the estimate is not usable: whatever is planned, the drives will be held.
        dither: What the dither does.
        settling: The run has just begun: whatever is planned, only the dither moves the drives.
    """

    estimate: Estimate
    reference: Reference
    age: float
    outputs: Array
    error: Array
    shift: Array
    previous: Array
    low: Array
    high: Array
    doubt: str
    dither: Dithered
    settling: bool = False

    def within(self, speed: Array) -> Array:
        """Return speeds of the coming period (m,) [m/s], each cut off at its limits."""
        m = speed.shape[0]
        kept: Array = np.minimum(np.maximum(speed, self.low[:m]), self.high[:m])
        return kept


@dataclass(frozen=True, slots=True)
class Plan:
    """Drive speeds with proof.

    Attributes:
        speed: Speeds of the coming period (m,) [m/s].
        tension: Tensions predicted at the end of the horizon (m,) [N].
        iterations: Iterations of the inner problem.
        residual: Its residual at the end [N].
        lcp_residual: Complementarity residual of the LCP solution.
        lcp_pivots: Pivots of Lemke's algorithm.
        reason: Empty, or why the speeds must not be sent.
        expected: End position one period from now (3,) [m], if the plan tells.
    """

    speed: Array
    tension: Array
    iterations: int
    residual: float
    lcp_residual: float = 0.0
    lcp_pivots: int = 0
    reason: str = ""
    expected: Array | None = None


class Planner(Linearisable, Protocol):
    """One kind of controller: build, solve, refuse what is not solved.

    Attributes:
        ahead: Instants after the step at which it wants the reference (n,) [s].
        blocks: Number of input blocks.
        extrapolates: The estimate is moved on by its age before it is compared with the reference.
        anti_windup: The integral action stands still while inputs are saturated.
    """

    ahead: Array
    blocks: int
    extrapolates: bool
    anti_windup: bool

    def plan(self, at: Situation) -> Plan:
        """Find the speeds of the coming period."""
        ...

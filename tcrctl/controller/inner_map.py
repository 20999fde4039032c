"""What only a stability analysis asks of a controller: its memory, and the map z^(j) -> z^(j+1) of (42)."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from tcrctl.memory import Remembers
from tcrctl.robot import linear
from tcrctl.robot.equations import Load, assemble, make_workspace
from tcrctl.robot.module import FIXED
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array


class InnerMap(NamedTuple):
    """One iteration about the point at which it ended.

    Attributes:
        what: What is iterated, for a report.
        point: z^(j) at the end (n,).
        scale: Sizes of changes of its components that are small (n,).
        apply: z^(j+1) for any z^(j), both (n,).
    """

    what: str
    point: Array
    scale: Array
    apply: Callable[[Array], Array]


@runtime_checkable
class Linearisable(Remembers, Protocol):
    """A part of a controller, or a whole one, that can be linearised; the loop itself needs nothing of this."""

    def sharpen(self) -> None:
        """Solve to rounding from now on: what a tick tolerates is a step in the map that is linearised."""
        ...

    def inner_map(self) -> InnerMap | None:
        """Return the iteration of the last step; None if there is none, or it did not end in a solution."""
        ...


def newton_map(what: str, robot: Robot, load: Load, drive: Array, q: Array) -> InnerMap:
    """Return one full Newton step of r(q) = 0 with the drives held, about a solution.

    Its derivative at the solution itself is 0, so what is found there is what the tolerance has left.

    Args:
        what: What is iterated.
        robot: The robot.
        load: Integration rule and loads of the equations (*) of ``robot.equations``.
        drive: Drive lengths (m,) [m].
        q: Solution (3 n_nodes,) [m].
    """
    first, ws = 3 * FIXED, make_workspace(robot.model)
    nodal = load.nodal.copy()
    bars = load.bar_before.copy()
    cables = load.cable_before.copy()
    at = Load(load.inertia, load.w, nodal, bars, cables, None)

    def apply(z: Array) -> Array:
        moved, change = q.copy(), np.empty(z.shape)
        moved[first:] = z
        assemble(robot.model, moved, drive, at, ws, True)
        linear.factor_shifted(ws.K, ws.U)
        linear.solve(ws, ws.r, change)
        return z - change

    q = q.copy()
    return InnerMap(what, q[first:].copy(), np.full(q.size - first, 1e-3), apply)

"""Static equilibrium with prescribed drives or prescribed cable tensions.

Both minimise the potential energy. Where the direct way from the given start fails, the drives are applied in
steps; where that fails too there is no stable shape to be found, and the error says how far it came.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.elements import sliding_cable
from tcrctl.errors import NoEquilibriumError
from tcrctl.robot import linear
from tcrctl.robot.equations import FORCE, Load, Workspace, make_workspace
from tcrctl.robot.model import Model, freeze
from tcrctl.robot.potential import Outcome, minimise
from tcrctl.signals import Array

#: Largest nodal force left in equilibrium [N].
TOLERANCE = 1e-7
MAX_ITERATIONS = 80
LOAD_STEPS = (4, 16, 64)
#: Stiffness of the nearly constant-force cables that stand for prescribed tensions [N/m].
SOFT_CABLE = 1.0
TENSION_PASSES = 50
TENSION_TOLERANCE = 1e-9


class Equilibrium(NamedTuple):
    """A stable static configuration.

    Attributes:
        q: Node positions (3 n_nodes,) [m].
        tension: Cable tensions λ (m,) [N].
        length: Path lengths (m,) [m].
        gain: ∂q/∂d, static response of the free coordinates to the drives (n_free, m).
        iterations: Newton iterations of the last solve.
        residual: Largest nodal force left [N].
    """

    q: Array
    tension: Array
    length: Array
    gain: Array
    iterations: int
    residual: float


def static_load(model: Model, external: Array) -> Load:
    """Return the load of statics: no inertia, no damping, external force (3 n_nodes,) [N] with gravity in it."""
    nodal = np.zeros((4, external.shape[0]))
    nodal[FORCE] = external
    return Load(0.0, 0.0, nodal, np.zeros(model.bars.shape[0]), np.zeros(model.cables.shape[0]), None)


def _in_steps(
    model: Model, start: Array, drives: tuple[Array, Array], load: Load, ws: Workspace
) -> tuple[Array, Outcome]:
    """Go from drives[0] to drives[1] in finer and finer equal steps until one division succeeds."""
    q, outcome = start, Outcome(False, 0, np.inf, 0.0)
    for steps in LOAD_STEPS:
        q = start.copy()
        for i in range(1, steps + 1):
            drive = drives[0] + (drives[1] - drives[0]) * (i / steps)
            outcome = minimise(model, q, drive, load, ws, TOLERANCE, MAX_ITERATIONS, True)
            if not outcome.converged:
                break
        if outcome.converged:
            break
    return q, outcome


def equilibrium(
    model: Model, drive: Array, external: Array, start: Array, start_drive: Array | None = None
) -> Equilibrium:
    """Find the equilibrium for prescribed drive lengths.

    Args:
        model: Robot arrays.
        drive: Drive lengths (m,) [m].
        external: External force, gravity included (3 n_nodes,) [N].
        start: Node positions to start from (3 n_nodes,) [m].
        start_drive: Drives that belong to ``start``; load stepping begins there. Default zeros.

    Raises:
        NoEquilibriumError: If no stable equilibrium was found.
    """
    ws, load = make_workspace(model), static_load(model, external)
    q = np.array(start)
    outcome = minimise(model, q, drive, load, ws, TOLERANCE, MAX_ITERATIONS, True)
    if not outcome.converged:
        first = np.zeros_like(drive) if start_drive is None else start_drive
        q, outcome = _in_steps(model, start, (first, drive), load, ws)
    if not outcome.converged:
        text = ", ".join(f"{1000 * d:.1f}" for d in drive)
        what = f"drives [{text}] mm" + (
            " (in balance, but unstable)" if outcome.residual <= TOLERANCE else ""
        )
        raise NoEquilibriumError(what, outcome.residual, TOLERANCE, outcome.iterations)
    gain, column = np.zeros((ws.r.shape[0], drive.shape[0])), np.zeros(ws.r.shape[0])
    linear.solve(ws, ws.r, column)
    linear.drive_gain(ws, gain)
    return Equilibrium(q, ws.tension, ws.length, gain, outcome.iterations, outcome.residual)


def with_rest_lengths(model: Model, rest: Array) -> Model:
    """Copy of ``model`` with cable rest lengths (m,) [m] and the same EA."""
    cables = model.cables.copy()
    cables[:, sliding_cable.STIFFNESS] *= cables[:, sliding_cable.REST] / rest
    cables[:, sliding_cable.REST] = rest
    return freeze(model._replace(cables=cables))


def equilibrium_with_tensions(model: Model, tension: Array, external: Array, start: Array) -> Equilibrium:
    """Find the equilibrium for prescribed cable tensions (m,) [N], as of cables pulled by constant forces.

    Every cable is replaced by a soft one with the rest length that gives it the wanted tension at the present
    length; the exchange is repeated until the tensions are met. ``gain`` belongs to the soft cables.

    Raises:
        NoEquilibriumError: If no stable equilibrium with these tensions was found.
    """
    cables = model.cables.copy()
    cables[:, sliding_cable.STIFFNESS] = SOFT_CABLE
    found = None
    q, length = start, model.cables[:, sliding_cable.REST]
    for _ in range(TENSION_PASSES):
        cables[:, sliding_cable.REST] = length - tension / SOFT_CABLE
        soft = freeze(model._replace(cables=cables))
        found = equilibrium(soft, np.zeros_like(tension), external, q)
        q, length = found.q, found.length
        error = float(np.max(np.abs(found.tension - tension)))
        if error < TENSION_TOLERANCE:
            return found
    raise NoEquilibriumError(f"tensions {tension} N", error, TENSION_TOLERANCE, TENSION_PASSES)

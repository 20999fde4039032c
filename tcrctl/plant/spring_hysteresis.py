"""Hysteresis of springs: a friction element (Jenkin) parallel to every spring.

It is an elastic bar of stiffness k_f whose unstretched length gives way when its force exceeds F_y:

    |T_f| <= F_y = k_f δ_y,    k_f = 2 s k,    δ_y = Δ / 4

With these, a spring that is stretched and released by Δ passes a loop whose width 2 F_y is the share s of its force
range k Δ; in motions below 2 δ_y it is elastic. Time steps see an elastic bar. Afterwards its force is cut down to
F_y, which can only take energy: dissipative by construction, whatever the step. Source: [IW66] for one element.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcrctl.elements import bar
from tcrctl.numerics.kernel import kernel
from tcrctl.plant.reality_settings import HysteresisSettings
from tcrctl.robot.model import Model
from tcrctl.robot.module import RIGID_BARS
from tcrctl.signals import Array


@kernel(error_model="numpy")
def _give_way(q: Array, nodes: NDArray[np.int64], elements: Array, longest: float) -> float:
    """Move unstretched lengths of ``elements`` (n, 4) so that none is stretched by more than ``longest`` [m]."""
    lost = 0.0
    for b in range(nodes.shape[0]):
        length, _, _, _ = bar.direction(q, nodes[b, 0], nodes[b, 1])
        stretch = length - elements[b, bar.REST]
        held = min(max(stretch, -longest), longest)
        elements[b, bar.REST] += stretch - held
        lost += 0.5 * elements[b, bar.STIFFNESS] * (stretch * stretch - held * held)
    return lost


class SpringHysteresis:
    """Friction elements of all springs.

    Attributes:
        model: The robot's arrays with one more bar for every spring; kernels see them read-only.
        yield_length: δ_y [m].
    """

    def __init__(self, settings: HysteresisSettings, model: Model, q: Array) -> None:
        """Add elements without force to a robot that rests at ``q`` (3 n_nodes,) [m]."""
        first, count = RIGID_BARS * model.mass.shape[0], model.bars.shape[0]
        self._nodes = model.bar_nodes[first:]
        self.yield_length = settings.range_mm / 4000.0
        self._bars = np.vstack([model.bars, model.bars[first:]])
        self._own = self._bars[count:]
        self._own[:, bar.REST] = self._lengths(q)
        self._own[:, bar.STIFFNESS] *= 2.0 * settings.share
        self._own[:, bar.DAMPING] = 0.0
        self._own[:, bar.TENSION_ONLY] = 0.0
        seen = self._bars.view()
        seen.flags.writeable = False
        nodes = np.vstack([model.bar_nodes, self._nodes])
        nodes.flags.writeable = False
        self.model = model._replace(bars=seen, bar_nodes=nodes)

    def give_way(self, q: Array) -> float:
        """Cut forces down after an internal step to ``q`` (3 n_nodes,) [m]; return the energy lost [J]."""
        return _give_way(q, self._nodes, self._own, self.yield_length)

    def _lengths(self, q: Array) -> Array:
        ends = q.reshape(-1, 3)[self._nodes]
        return np.asarray(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))

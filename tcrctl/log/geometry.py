"""What the log must know of the robot to name its columns and to draw it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tcrctl.log.drawing import Drawing
from tcrctl.robot import module
from tcrctl.signals import Array


@dataclass(frozen=True, slots=True)
class CableHoles:
    """Name of one cable and the holes it runs through, from the base to the ring it ends on.

    Attributes:
        name: Name of the cable.
        nodes: Rows of the three ring nodes that carry each hole (n_holes, 3).
        weights: Weights of these nodes for the hole's position, (2) (n_holes, 3).
    """

    name: str
    nodes: NDArray[np.int64]
    weights: Array

    def points(self, nodes: Array) -> Array:
        """Return the hole positions (n_holes, 3) [m] for node positions ``nodes`` (n_nodes, 3) [m]."""
        hole: Array = np.einsum("hj,hjx->hx", self.weights, nodes[self.nodes])
        return hole


@dataclass(frozen=True, slots=True)
class LogGeometry:
    """Names and topology, in the node order of :mod:`tcrctl.robot.module`.

    Attributes:
        n_modules: Modules below the fixed base.
        cables: Holes of every cable, in the order of ``drive``.
        marker_nodes: Row of the node that each row of ``Measurement.nodes`` measures (n_markers,).
        tip_ring: Module whose ring is the end of eq. (11).
        full_scale_tension: Tension drawn in full red [N]; a slack cable is blue.
        springs: Node rows of the ends of every spring (n_springs, 2).
        reference_path: Points on the way that the end shall go (n, 3) [m]; may be empty.
        drawing: What is drawn of the task.

    Raises:
        ValueError: If a node row or the tip ring does not exist.
    """

    n_modules: int
    cables: tuple[CableHoles, ...]
    marker_nodes: tuple[int, ...]
    tip_ring: int
    full_scale_tension: float = 20.0
    springs: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    reference_path: Array = field(default_factory=lambda: np.zeros((0, 3)))
    drawing: Drawing = field(default_factory=Drawing)

    def __post_init__(self) -> None:
        holes = (row for cable in self.cables for row in cable.nodes.ravel().tolist())
        rows = [*self.marker_nodes, *holes, *self.springs.ravel().tolist()]
        if any(not 0 <= row < self.n_nodes for row in rows) or not 0 <= self.tip_ring <= self.n_modules:
            raise ValueError(f"geometry names a node or ring beyond module {self.n_modules}")

    @property
    def n_nodes(self) -> int:
        """Number of nodes, base included."""
        return module.node_count(self.n_modules)

    @property
    def ring_names(self) -> tuple[str, ...]:
        """``base, m1, m2, ...``: names of the modules, also of the ring frames on ``/tf``."""
        return module.module_names(self.n_modules)

    @property
    def node_names(self) -> tuple[str, ...]:
        """``base.n1, base.n2, ..., m1.apex, ...`` in row order."""
        return module.node_names(self.n_modules)

    @property
    def marker_names(self) -> tuple[str, ...]:
        """Node names of the measured nodes, in the order of ``Measurement.nodes``."""
        names = self.node_names
        return tuple(names[row] for row in self.marker_nodes)

    @property
    def cable_names(self) -> tuple[str, ...]:
        """Cable names in the order of ``drive``."""
        return tuple(cable.name for cable in self.cables)

    @property
    def rods(self) -> NDArray[np.int64]:
        """Node rows of the rods from ring to apex (3 (n_modules + 1), 2)."""
        ends = [pair for i in range(self.n_modules + 1) for pair in module.rods(i)]
        return np.array(ends, dtype=np.int64)

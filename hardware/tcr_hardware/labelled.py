"""Markers that come with their names, from whatever sends them: every node in its row, or honestly not there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from tcr_hardware.errors import HardwareError
from tcr_hardware.markers import Gate, Located, NodeMarker, jumped
from tcr_hardware.rigid_transform import IDENTITY, RigidTransform


class UnnamedMarkerError(HardwareError):
    """A node has a marker without a name, which a stream of names does not tell.

    Attributes:
        nodes: Names of such nodes.
    """

    def __init__(self, nodes: Sequence[str]) -> None:
        super().__init__(f"these cameras know markers by their labels; none is given for {', '.join(nodes)}")
        self.nodes = tuple(nodes)


class LabelledMap:
    """Finds the nodes in one frame of named markers after the other.

    Raises:
        UnnamedMarkerError: A node whose marker has no label.
    """

    def __init__(
        self,
        nodes: Sequence[NodeMarker],
        transform: RigidTransform = IDENTITY,
        *,
        gate: Gate | None = None,
    ) -> None:
        unnamed = [node.node for node in nodes if node.label is None]
        if unnamed:
            raise UnnamedMarkerError(unnamed)
        self._labels = [str(node.label) for node in nodes]
        self._transform, self._gate = transform, gate or Gate()
        self._last = np.full((len(nodes), 3), np.nan)
        self._last_at = np.full(len(nodes), -np.inf)

    def locate(self, taken_at: float, markers: Mapping[str, ArrayLike | None]) -> Located:
        """Find the nodes in a frame; frames must come in order.

        Args:
            taken_at: When the markers were there [s].
            markers: Position (3,) in the frame of the cameras by label; None for one that is not seen.
        """
        reasons = np.full(len(self._labels), "", dtype=object)
        found = np.full((len(self._labels), 3), np.nan)
        for row, label in enumerate(self._labels):
            position = markers.get(label)
            if position is None:
                reasons[row] = "occluded" if label in markers else "missing"
                continue
            found[row] = self._transform.apply(np.asarray(position, float))
        reasons[(reasons == "") & ~np.isfinite(found).all(axis=1)] = "not finite"
        far = np.linalg.norm(found - self._last, axis=1) > self._gate.width(taken_at - self._last_at)
        reasons[jumped(reasons == "", far)] = "jump"
        valid = reasons == ""
        self._last[valid], self._last_at[valid] = found[valid], taken_at
        found[~valid] = np.nan
        return Located(found.astype(np.float32), valid, tuple(reasons))

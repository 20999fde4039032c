"""What cameras see of a shape: reported = R (node + A' b) + t, and its derivatives by all unknowns."""

from __future__ import annotations

import numpy as np

from tcrctl.identify.calibration.shapes import Shape
from tcrctl.identify.calibration.unknowns import Unknowns
from tcrctl.numerics.rotation import matrix_from_quaternion, quaternion_exp
from tcrctl.robot.module import RING, ring_rows
from tcrctl.robot.ring_axes import ring_frames
from tcrctl.signals import Array


class Sight:
    """The cameras before one robot."""

    def __init__(self, unknowns: Unknowns, n_modules: int) -> None:
        self._unknowns = unknowns
        self._rows = np.array(ring_rows(n_modules))
        self.coordinates = (3 * self._rows[:, None] + np.arange(3)).ravel()

    def of(self, x: Array, shape: Shape) -> tuple[Array, Array]:
        """Return reported markers (3 n_markers,) [m] and their derivatives by the unknowns (3 n_markers, n)."""
        u = self._unknowns
        nodes = shape.q.reshape(-1, 3)[self._rows]
        axes = np.repeat(ring_frames(nodes), RING, axis=0)
        markers = nodes + np.einsum("ni,nij->nj", u.take(x, "markers").reshape(-1, 3), axes)
        turn = matrix_from_quaternion(quaternion_exp(u.take(x, "frame_rotation")))
        turned = markers @ turn.T
        slopes = self.turned(turn, shape.slopes)
        rotation, translation, marker = (
            u.of(name) for name in ("frame_rotation", "frame_translation", "markers")
        )
        for i in range(3):
            slopes[:, rotation.start + i] = np.cross(np.eye(3)[i], turned).ravel()
            slopes[i::3, translation.start + i] = 1.0
        beside = np.einsum("ij,nkj->nik", turn, axes)
        for i in range(self._rows.size):
            own = slice(marker.start + 3 * i, marker.start + 3 * i + 3)
            slopes[3 * i : 3 * i + 3, own] = beside[i]
        return (turned + u.take(x, "frame_translation")).ravel(), slopes

    def turned(self, turn: Array, columns: Array) -> Array:
        """Return how the markers move (3 n_markers, n) when all nodes move (3 n_nodes, n)."""
        moved = columns[self.coordinates].reshape(self._rows.size, 3, -1)
        return np.asarray(np.einsum("ij,njp->nip", turn, moved).reshape(self.coordinates.size, -1))

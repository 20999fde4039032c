"""A model laid over a picture: the rigid motion that brings its nodes nearest to the markers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcrctl.signals import Array


class LaidOver(NamedTuple):
    """The best rigid motion, picture = rotation model + translation.

    Attributes:
        rotation: (3, 3), a mirror image if it was allowed to be one and fits better.
        translation: (3,) [m].
        residual: Distance of every marker from the moved model (n,) [m].
    """

    rotation: Array
    translation: Array
    residual: Array

    @property
    def rms(self) -> float:
        """Root mean square of the residuals [m]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def mirrored(self) -> bool:
        """Whether it is a mirror image."""
        return bool(np.linalg.det(self.rotation) < 0.0)

    @property
    def tilt(self) -> float:
        """Angle by which the vertical is off [rad]."""
        return float(np.arccos(np.clip(self.rotation[2, 2], -1.0, 1.0)))

    @property
    def turn(self) -> float:
        """Angle about the vertical, after the shortest rotation that rights it [rad]."""
        r = self.rotation
        return float(np.arctan2(r[1, 0] - r[0, 1], r[0, 0] + r[1, 1]))


def laid_over(model: Array, picture: Array, *, mirror: bool = False) -> LaidOver:
    """Lay a model (n, 3) over a picture (n, 3) of it, both [m] [K76].

    Args:
        model: Where its nodes are.
        picture: Where they are seen; all finite.
        mirror: Allow a mirror image.
    """
    a, b = model.mean(axis=0), picture.mean(axis=0)
    u, _, vt = np.linalg.svd((model - a).T @ (picture - b))
    last = 1.0 if mirror else float(np.sign(np.linalg.det(vt.T @ u.T)))
    rotation = vt.T @ np.diag([1.0, 1.0, last]) @ u.T
    translation = b - rotation @ a
    residual = np.linalg.norm(picture - model @ rotation.T - translation, axis=1)
    return LaidOver(rotation, translation, residual)

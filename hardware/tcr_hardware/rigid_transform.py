"""From the axes and the unit of a camera system to those of the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RigidTransform:
    """``x_rig = rotation (scale_m x_camera) + translation``.

    Attributes:
        rotation: Proper rotation (3, 3).
        translation: Origin of the camera system in the rig frame (3,) [m].
        scale_m: Metres per unit of the camera system.
    """

    rotation: Array
    translation: Array
    scale_m: float = 1.0

    def __post_init__(self) -> None:
        """Refuse what is no rigid transform; keep own read-only copies.

        Raises:
            ValueError: Wrong shape, not finite, a reflection or not orthogonal, or a scale that is not positive.
        """
        rotation = np.array(self.rotation, float)
        translation = np.array(self.translation, float)
        if rotation.shape != (3, 3) or translation.shape != (3,):
            raise ValueError(f"shapes {rotation.shape} and {translation.shape}, expected (3, 3) and (3,)")
        if not (np.isfinite(translation).all() and 0.0 < self.scale_m < float("inf")):
            raise ValueError(f"translation {translation} m, scale {self.scale_m} m")
        if not (np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-6 and np.linalg.det(rotation) > 0.0):
            raise ValueError(f"not a rotation: {rotation.tolist()}")
        rotation.flags.writeable = translation.flags.writeable = False
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "translation", translation)

    def apply(self, points: ArrayLike) -> Array:
        """Take points (..., 3) of the camera system to the rig frame [m]."""
        return (self.scale_m * np.asarray(points, float)) @ self.rotation.T + self.translation

    def inverse_apply(self, points: ArrayLike) -> Array:
        """Take points (..., 3) of the rig frame [m] to the camera system."""
        return ((np.asarray(points, float) - self.translation) @ self.rotation) / self.scale_m

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers for a file: quaternion x, y, z, w, translation [m], scale [m]."""
        quaternion: list[float] = Rotation.from_matrix(self.rotation).as_quat(canonical=True).tolist()
        return {
            "quaternion_xyzw": quaternion,
            "translation_m": self.translation.tolist(),
            "scale_m": self.scale_m,
        }

    @classmethod
    def from_dict(cls, numbers: Mapping[str, Any]) -> RigidTransform:
        """Read what ``as_dict`` wrote.

        Raises:
            ValueError: A quaternion that is not of unit length within 1e-3, or as ``__post_init__``.
            KeyError: A number is missing.
        """
        quaternion: Sequence[float] = numbers["quaternion_xyzw"]
        if len(quaternion) != 4 or not abs(float(np.linalg.norm(quaternion)) - 1.0) < 1e-3:
            raise ValueError(f"quaternion {list(quaternion)} is not of unit length")
        rotation = Rotation.from_quat(quaternion).as_matrix()
        return cls(rotation, np.array(numbers["translation_m"], float), float(numbers.get("scale_m", 1.0)))


IDENTITY = RigidTransform(np.eye(3), np.zeros(3))

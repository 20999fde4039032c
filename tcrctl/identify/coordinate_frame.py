"""The measurement's frame: measured = Rz(yaw) S model + offset, S a mirror at y = 0 if it is left-handed.

Vertical is known: z of the frame is up. For given positions the best yaw and offset are found in closed form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tcrctl.identify.settings import FrameSettings
from tcrctl.signals import Array


@dataclass(frozen=True, slots=True)
class CoordinateFrame:
    """Where the frame lies, and what of it is unknown.

    Attributes:
        yaw: Direction of the robot's x axis in the frame [rad].
        offset: Origin of the robot in the frame (3,) [m].
        mirrored: The frame is left-handed.
        free_yaw: Yaw is an unknown.
        free_offset: The offset is an unknown.
    """

    yaw: float
    offset: Array
    mirrored: bool
    free_yaw: bool
    free_offset: bool

    @classmethod
    def of(cls, settings: FrameSettings) -> CoordinateFrame:
        """Return the frame as far as it is known; ``mirrored: try`` begins with no."""
        return cls(
            yaw=math.radians(settings.yaw_deg),
            offset=np.array(settings.offset_mm) / 1e3,
            mirrored=settings.mirrored == "yes",
            free_yaw=settings.yaw == "fit",
            free_offset=settings.offset == "fit",
        )

    @property
    def unknowns(self) -> Array:
        """Values of what is unknown: yaw, then offset; (0,), (1,), (3,) or (4,)."""
        return np.concatenate([[self.yaw] * self.free_yaw, self.offset if self.free_offset else []])

    def with_unknowns(self, values: Array) -> CoordinateFrame:
        """Return the frame with other values of what is unknown."""
        yaw = float(values[0]) if self.free_yaw else self.yaw
        return replace(self, yaw=yaw, offset=values[-3:] if self.free_offset else self.offset)

    def turned(self, model: Array) -> Array:
        """Return the vectors (..., 3) of the robot's frame in the measurement's frame."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        if self.mirrored:
            turn[:, 1] *= -1.0
        out: Array = model @ turn.T
        return out

    def place(self, model: Array) -> Array:
        """Return the positions (n, 3) [m] of the robot's frame in the measurement's frame."""
        return self.turned(model) + self.offset

    def slopes(self, model: Array) -> Array:
        """Return the derivative of :meth:`place` with respect to the unknowns (n, 3, unknowns)."""
        columns: list[Any] = []
        if self.free_yaw:
            turned = self.turned(model)
            columns.append(np.stack([-turned[:, 1], turned[:, 0], np.zeros(len(turned))], axis=1))
        if self.free_offset:
            columns += [np.tile(axis, (len(model), 1)) for axis in np.eye(3)]
        return np.stack(columns, axis=2) if columns else np.zeros((*model.shape, 0))

    def aligned(self, model: Array, measured: Array) -> CoordinateFrame:
        """Return the frame with the unknowns that fit best, points not measured (NaN) left out.

        Args:
            model: Positions in the robot's frame (n, 3) [m].
            measured: Measured positions (n, 3) [m].
        """
        whole = ~np.isnan(measured).any(axis=1)
        if not whole.any() or not (self.free_yaw or self.free_offset):
            return self
        a, b = replace(self, yaw=0.0).turned(model[whole]), measured[whole]
        centre = (a.mean(axis=0), b.mean(axis=0)) if self.free_offset else (np.zeros(3), self.offset)
        yaw = self.yaw
        if self.free_yaw:
            p, q = a - centre[0], b - centre[1]
            sine = (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum()
            cosine = (p[:, :2] * q[:, :2]).sum()
            yaw = math.atan2(sine, cosine)
        found = replace(self, yaw=yaw)
        if self.free_offset:
            found = replace(found, offset=centre[1] - found.turned(model[whole]).mean(axis=0))
        return found

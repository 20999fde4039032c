"""The best answer so far."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcrctl.identify.coordinate_frame import CoordinateFrame
from tcrctl.signals import Array


@dataclass
class Best:
    """The best answer so far.

    Attributes:
        cost: Its cost; what that is, only the method knows.
        x: Its place in the unit cube (n,).
        frame: Its measurement frame.
    """

    cost: float
    x: Array
    frame: CoordinateFrame

    @classmethod
    def none(cls, x: Array, frame: CoordinateFrame) -> Best:
        """Return where a method starts."""
        return cls(np.inf, x.copy(), frame)

    def offer(self, cost: float, x: Array, frame: CoordinateFrame) -> None:
        """Take another answer if it is better."""
        if cost < self.cost:
            self.cost, self.x, self.frame = cost, np.array(x), frame

"""From what cameras report to where ring nodes are: a frame that is off, markers beside their nodes.

    reported = R (node + A' b) + t        A: axes of the ring, b: the marker beside its node, in those axes

The axes are those of the shape that is expected. A ring that lies a degree beside it puts a marker that sits a
millimetre aside wrong by 17 micrometres.
"""  # fmt: skip

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tcrctl.estimator.calibration_settings import CalibrationSettings
from tcrctl.numerics.rotation import matrix_from_quaternion, quaternion_exp
from tcrctl.robot.module import RING, node_index, ring_rows
from tcrctl.robot.ring_axes import ring_frames
from tcrctl.signals import Array, Measurement


@dataclass(frozen=True, slots=True)
class MarkerCalibration:
    """What is known of cameras and markers.

    Attributes:
        rotation: R (3, 3).
        translation: t (3,) [m].
        beside: b of every marker (n_markers, 3) [m].
        known: Whether there is anything to correct.
    """

    rotation: Array
    translation: Array
    beside: Array
    known: bool

    @classmethod
    def of(cls, settings: CalibrationSettings | None, n_modules: int) -> MarkerCalibration:
        """Take what a calibration says, nothing if it is None, of a robot of so many modules."""
        rows, known = ring_rows(n_modules), settings is not None
        settings = settings or CalibrationSettings()
        beside = np.zeros((len(rows), 3))
        for name, offset in settings.markers_mm.items():
            beside[rows.index(node_index(name))] = 1e-3 * np.array(offset)
        turn = np.radians(settings.frame.rotation_deg)
        shift = 1e-3 * np.array(settings.frame.translation_mm)
        return cls(matrix_from_quaternion(quaternion_exp(turn)), shift, beside, known)

    def corrected(self, measured: Measurement, expected: Array) -> Measurement:
        """Return a frame with every marker put on its node, in the frame of the base.

        Args:
            measured: The frame as reported.
            expected: Where the ring nodes are, roughly (n_markers, 3) [m].
        """
        if not self.known:
            return measured
        axes = np.repeat(ring_frames(expected), RING, axis=0)
        nodes = (measured.nodes - self.translation) @ self.rotation
        nodes = nodes - np.einsum("ni,nij->nj", self.beside, axes)
        return replace(measured, nodes=nodes.astype(measured.nodes.dtype))

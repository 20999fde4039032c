"""For authors of cameras: frames of named markers become sightings, with the shipped gates and the calibration."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from tcr_hardware.errors import HardwareError
from tcr_hardware.labelled import LabelledMap
from tcr_hardware.markers import Gate
from tcrctl.errors import InputError
from tcrctl.plant.rig.devices import Sighting
from tcrctl.plant.rig.mounting import Mounting
from tcrctl.signals import RawFrame


class LabelledMarkers:
    """Looks for the markers of a robot among those that cameras name."""

    def __init__(self, mounting: Mounting, jump_gate_m: float = Gate().largest_m) -> None:
        """Begin without a frame.

        Args:
            mounting: What is looked for.
            jump_gate_m: A marker that has jumped further is not used [m].

        Raises:
            InputError: If the rig file gives a marker without a label.
        """
        gate = Gate(smallest_m=min(Gate().smallest_m, jump_gate_m), largest_m=jump_gate_m)
        self._mounting = mounting
        try:
            self._map = LabelledMap(
                mounting.markers,
                mounting.transform,
                gate=gate if mounting.gated else Gate(math.inf, math.inf, math.inf),
            )
        except HardwareError as error:
            raise InputError(
                f"markers: {error}", hint="Use markers.labels, or label in markers.nodes."
            ) from error

    def sighting(
        self,
        taken: float,
        markers: Mapping[str, ArrayLike | None],
        *,
        number: int = 0,
        session: int = 0,
        delay: float = 0.0,
    ) -> Sighting:
        """Return what one frame shows of the robot; frames must come in order.

        Args:
            taken: Middle of the exposure on ``time.monotonic`` [s].
            markers: Position (3,) in the frame and unit of the cameras by label; None for one that is not seen.
            number: Of the frame, counted by the cameras.
            session: Times that the cameras were restarted before.
            delay: Time from the exposure to the arrival [s].
        """
        located = self._map.locate(taken, markers)
        return self._mounting.sighting(located, taken, _raw(markers, number, session, delay))


def _raw(markers: Mapping[str, ArrayLike | None], number: int, session: int, delay: float) -> RawFrame:
    seen = {label: position for label, position in markers.items() if position is not None}
    nothing = np.zeros(0, np.int32)
    positions = np.array([np.asarray(position, np.float32) for position in seen.values()], np.float32)
    return RawFrame(
        number, session, delay, nothing, positions.reshape(-1, 3), nothing, names="\n".join(seen) or None
    )

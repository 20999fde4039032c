"""``tcrctl rig jog``: move single cables slowly, through the same limits and supervisor as a run."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcrctl.commissioning.without_cameras import WithoutCameras
from tcrctl.errors import InputError, NotArrivedError
from tcrctl.loop.loop import step_count
from tcrctl.loop.pacing import RealTime
from tcrctl.plant.rig.assembly import connect_drives, envelope, supervisor_rules
from tcrctl.plant.rig.file import LoadedRig
from tcrctl.plant.rig.mounting import cable_axes
from tcrctl.plant.rig.operation import Operation
from tcrctl.plant.rig.own_limits import check_drives
from tcrctl.plant.rig.plant import RigLimits, RigPlant
from tcrctl.signals import Array, Command

#: Period of the writes [s].
PERIOD = 0.02
#: Drives nearer than this to where they shall be have arrived [m].
ARRIVED = 1e-4
#: How long drives may lag behind the end of the motion [s].
PATIENCE = 1.0


@dataclass(frozen=True, slots=True)
class Jog:
    """A motion asked for.

    Attributes:
        cables: Names of the cables.
        by: How far [m]; None if the place is given.
        to: Where to [m]; None if the distance is given.
        speed: Largest speed [m/s].
    """

    cables: tuple[str, ...]
    by: float | None
    to: float | None
    speed: float

    def distances(self, names: tuple[str, ...], now: Array) -> Array:
        """Return how far every cable has to move (m,) [m] from where it is ``now`` (m,) [m]."""
        moving = np.array([name in self.cables for name in names])
        wanted = np.full(len(names), self.by) if self.to is None else self.to - now
        return np.where(moving, wanted, 0.0)


def jog_rig(
    loaded: LoadedRig,
    names: tuple[str, ...],
    jog: Jog,
    operation: Operation,
    *,
    dry_run: bool,
    check: Callable[[], None],
) -> dict[str, Any]:
    """Move cables and return where they were and are.

    Args:
        loaded: The rig file.
        names: Cables of the robot in the order of the drives.
        jog: The motion.
        operation: Takes events, knows whether the operator has agreed.
        dry_run: Read where the drives are and return what would be done; nothing is written.
        check: Raises if a signal asks to stop.

    Raises:
        InputError: If the motion leaves the limits.
        StoppedError: If the drives are not ready, do not arrive, or the supervisor stops them.
        DeviceError: If they do not answer.
    """
    rules = loaded.rig.safety
    drives = connect_drives(loaded, names)
    limits = RigLimits(
        envelope(loaded.mounted, rules, names), supervisor_rules(rules), 1.0, 0, 0, rules.arm_timeout_s
    )
    pace = RealTime(PERIOD, check)
    plant = RigPlant(WithoutCameras(), drives, limits, PERIOD, operation)
    try:
        check_drives(drives, cable_axes(loaded.mounted, names), rules, PERIOD)
        plant.look()
        start = 1e-6 * plant.position().astype(float)
        distance = jog.distances(names, start)
        duration = _check(jog, limits, names, start + distance, distance)
        result = {
            "from_mm": _by_name(names, start),
            "to_mm": _by_name(names, start + distance),
            "duration_s": duration,
        }
        if dry_run or not distance.any():
            return result
        plant.start()
        for k in range(step_count(duration, PERIOD) + 1):
            pace.wait(k * PERIOD)
            plant.read()
            plant.write(Command(distance * _rate(k, duration), start))
        _arrive(plant, pace, names, start + distance, k)
    finally:
        plant.close()
    return {**result, "to_mm": _by_name(names, 1e-6 * plant.position().astype(float))}


def _arrive(plant: RigPlant, pace: RealTime, names: tuple[str, ...], target: Array, k: int) -> None:
    """Wait until the drives are where they shall be, counting steps from ``k`` on.

    Raises:
        NotArrivedError: If they are not there in time.
    """
    still = Command(np.zeros(len(names)), target)
    for late in range(1, step_count(PATIENCE, PERIOD) + 1):
        pace.wait((k + late) * PERIOD)
        plant.read()
        plant.write(still)
        if np.abs(1e-6 * plant.position() - target).max() <= ARRIVED:
            return
    raise NotArrivedError(names, (1e3 * target).tolist(), (1e-3 * plant.position()).tolist())


def _rate(k: int, duration: float) -> float:
    """Return the distance's share per second in step k: (1 - cos) / T, exact in sum over all steps."""
    steps = step_count(duration, PERIOD)
    if k >= steps:
        return 0.0
    return (1.0 - math.cos(2.0 * math.pi * (k + 0.5) / steps)) / (steps * PERIOD)


def _check(jog: Jog, limits: RigLimits, names: tuple[str, ...], target: Array, distance: Array) -> float:
    """Return the duration [s] of a motion whose highest speed, twice the mean, is the one asked for."""
    unknown = [name for name in jog.cables if name not in names]
    if unknown:
        raise InputError(f"there is no cable {unknown[0]}; there are {', '.join(names)}")
    low, high = 1e-6 * limits.envelope.low, 1e-6 * limits.envelope.high
    for c, name in enumerate(names):
        if distance[c] and not low[c] - 1e-9 <= target[c] <= high[c] + 1e-9:
            raise InputError(
                f"cable {name} would go to {1e3 * target[c]:.3f} mm, outside its limits "
                f"{1e3 * low[c]:g} to {1e3 * high[c]:g} mm"
            )
    return max(2.0 * float(np.abs(distance).max()) / jog.speed, PERIOD)


def _by_name(names: tuple[str, ...], values: Array) -> dict[str, float]:
    return {name: round(1e3 * float(value), 3) for name, value in zip(names, values, strict=True)}

"""How fast a path may be travelled: the quickest rest-to-rest motion under speed and acceleration limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tcrctl.trajectory.time_law import Phase, ramp, ramp_slope

BISECTIONS = 60  # halves the search interval to below rounding
SAFETY = 1.001  # covers what the peak of a ramp's acceleration may exceed its largest value on the grid
_GRID = np.linspace(0.0, 1.0, 401)


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """What a move may not exceed.

    Attributes:
        speed: Peak speed along the path [m/s].
        acceleration: Peak norm of the acceleration vector [m/s2].
        ramp: Shortest duration of a change of speed [s].
    """

    speed: float
    acceleration: float
    ramp: float


@dataclass(frozen=True, slots=True)
class Zone:
    """Part of a path with one speed limit.

    Attributes:
        length: Arc length [m].
        curvature: Largest absolute curvature [1/m].
        speed: That of the move, or lower where the centripetal acceleration would pass its limit [m/s].
    """

    length: float
    curvature: float
    speed: float


def zones(pieces: Iterable[tuple[float, float]], limits: MotionLimits) -> list[Zone]:
    """Join neighbouring pieces that have the same speed limit.

    Args:
        pieces: Length [m] and curvature [1/m] of every piece.
        limits: Limits of the move.
    """
    result: list[Zone] = []
    for length, signed in pieces:
        curvature = abs(signed)
        speed = limits.speed
        if curvature > 0.0:
            speed = min(speed, math.sqrt(limits.acceleration / curvature))
        if result and math.isclose(result[-1].speed, speed, rel_tol=1e-9):
            last = result.pop()
            length, curvature = length + last.length, max(curvature, last.curvature)
            speed = min(speed, last.speed)
        result.append(Zone(length, curvature, speed))
    return result


def ramp_phase(v0: float, v1: float, curvature: float, limits: MotionLimits) -> Phase:
    """Return the shortest ramp within the limits.

    On a curve the tangential acceleration gets what the centripetal one leaves:
    (v')^2 + (curvature v^2)^2 <= acceleration^2.

    Args:
        v0: Speed at its start [m/s].
        v1: Speed at its end [m/s].
        curvature: Absolute curvature of the path [1/m].
        limits: Limits of the move.

    Returns:
        The ramp; its duration is 0 if the speeds are equal.
    """
    if v0 == v1:
        return Phase(0.0, v0, v1)
    centripetal = curvature * (v0 + (v1 - v0) * ramp(_GRID)) ** 2
    left = np.sqrt(np.maximum(limits.acceleration**2 - centripetal**2, 1e-30))
    needed = SAFETY * abs(v1 - v0) * float(np.max(ramp_slope(_GRID) / left))
    return Phase(max(limits.ramp, needed), v0, v1)


def rest_to_rest(path: Sequence[Zone], limits: MotionLimits) -> list[Phase]:
    """Plan the quickest sequence of ramps and cruises from rest to rest, with every ramp inside one zone.

    Args:
        path: Zones in order of travel.
        limits: Limits of the move.

    Returns:
        Phases of non-zero duration whose lengths add up to that of the path.
    """
    speeds = _boundary_speeds(path, limits)
    phases: list[Phase] = []
    for zone, v_in, v_out in zip(path, speeds[:-1], speeds[1:], strict=True):
        phases += _through(zone, v_in, v_out, limits)
    return [phase for phase in phases if phase.duration > 0.0]


def _boundary_speeds(path: Sequence[Zone], limits: MotionLimits) -> list[float]:
    """Return the largest speeds between the zones that can be reached and left within the zones."""
    speeds = [0.0, *(min(a.speed, b.speed) for a, b in pairwise(path)), 0.0]
    for i, zone in enumerate(path):
        speeds[i + 1] = _reachable(zone, speeds[i], speeds[i + 1], limits)
    for i, zone in reversed(list(enumerate(path))):
        speeds[i] = _reachable(zone, speeds[i + 1], speeds[i], limits)
    return speeds


def _reachable(zone: Zone, known: float, wanted: float, limits: MotionLimits) -> float:
    if wanted <= known:
        return wanted
    return _largest(
        lambda v: ramp_phase(known, v, zone.curvature, limits).length <= zone.length, known, wanted
    )


def _through(zone: Zone, v_in: float, v_out: float, limits: MotionLimits) -> list[Phase]:
    def ramps(v: float) -> tuple[Phase, Phase]:
        return ramp_phase(v_in, v, zone.curvature, limits), ramp_phase(v, v_out, zone.curvature, limits)

    cruise = _largest(lambda v: sum(p.length for p in ramps(v)) <= zone.length, max(v_in, v_out), zone.speed)
    up, down = ramps(cruise)
    time = max(0.0, zone.length - up.length - down.length) / cruise
    return [up, Phase(time, cruise, cruise), down]


def _largest(allowed: Callable[[float], bool], low: float, high: float) -> float:
    """Return the largest allowed value from low, which is allowed, to high; all below it are allowed too."""
    if allowed(high):
        return high
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if allowed(middle) else (low, middle)
    return low

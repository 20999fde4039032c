"""What a run had to keep, from the files that its log carries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tcrctl.log.file_names import RESOLVED, ROBOT
from tcrctl.log.reader import Log
from tcrctl.log.run_files import RunFiles


@dataclass(frozen=True, slots=True)
class Limits:
    """What the run had to keep; None where its files do not say.

    Attributes:
        speed: Largest drive speed [m/s].
        stroke: Smallest and largest drive length [m].
        tension: Largest tension allowed [N].
        floor: Smallest tension that the controller wants [N].
        ceiling: Largest tension that the controller wants [N].
    """

    speed: float | None = None
    stroke: tuple[float, float] | None = None
    tension: float | None = None
    floor: float | None = None
    ceiling: float | None = None


def read_limits(log: Log) -> Limits:
    """Read the limits in the attached files; a file of another version may lack any of them."""
    files = RunFiles(log)
    spec, robot = files.data(RESOLVED), files.data(ROBOT)
    stroke = [_number(robot, "stroke_mm", end, scale=1e-3) for end in (0, 1)]
    low, high = stroke
    return Limits(
        speed=_number(spec, "controller", "speed_limit_mm_s", scale=1e-3),
        stroke=None if low is None or high is None else (low, high),
        tension=_number(robot, "tension_limit_n"),
        floor=_number(spec, "controller", "tension", "floor_n"),
        ceiling=_number(spec, "controller", "tension", "ceiling_n"),
    )


def _number(data: Any, *path: str | int, scale: float = 1.0) -> float | None:
    for key in path:
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return None
    return scale * data if isinstance(data, int | float) else None

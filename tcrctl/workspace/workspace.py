"""Many rays together: every pose that was reached, and how far they reach."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, Final

import numpy as np

from tcrctl.errors import TcrctlError
from tcrctl.executors.carried import carried
from tcrctl.executors.engine import Engine
from tcrctl.executors.outcomes import Crash, outcomes
from tcrctl.loop.interruption import Interruption
from tcrctl.robot.description import RobotDescription
from tcrctl.signals import Array
from tcrctl.workspace.ray import Limits, Ray, cast

#: Seed of the scrambled sequence: the same directions every time.
SEED: Final = 0
#: Bands of height in the summary.
BANDS: Final = 8


@dataclass(frozen=True, slots=True)
class Workspace:
    """Poses that a robot reaches at rest with taut cables.

    Attributes:
        robot: Name of the robot.
        cables: Names of its cables.
        ray: Ray of every point (n,).
        drive: Drive lengths (n, m) [m].
        offset: End position from that at rest (n, 3) [m].
        tilt: Angle of the end normal to the vertical (n,) [rad].
        tension: Cable tensions (n, m) [N].
        ends: How many rays were ended by what.
    """

    robot: str
    cables: tuple[str, ...]
    ray: Array
    drive: Array
    offset: Array
    tilt: Array
    tension: Array
    ends: dict[str, int]

    @property
    def radius(self) -> Array:
        """Distance from the vertical through the rest position (n,) [m]."""
        radius: Array = np.hypot(self.offset[:, 0], self.offset[:, 1])
        return radius

    def bands(self) -> list[dict[str, float]]:
        """Return the largest ``radius_mm`` and ``tilt_deg`` in bands of height; ``height_mm`` is their middle."""
        height = self.offset[:, 2]
        edges = np.linspace(height.min(), height.max(), BANDS + 1)
        place = np.clip(np.searchsorted(edges, height, side="right") - 1, 0, BANDS - 1)
        return [
            {
                "height_mm": 500.0 * float(edges[i] + edges[i + 1]),
                "radius_mm": 1e3 * float(self.radius[place == i].max()),
                "tilt_deg": float(np.degrees(self.tilt[place == i].max())),
                "points": int(np.sum(place == i)),
            }
            for i in range(BANDS)
            if np.any(place == i)
        ]

    def as_json(self) -> dict[str, Any]:
        """Return the summary for programs."""
        ranges = {
            f"{axis}_mm": {"min": 1e3 * float(v.min()), "max": 1e3 * float(v.max())}
            for axis, v in zip("xyz", self.offset.T, strict=True)
        }
        return {
            "robot": self.robot,
            "points": int(self.tilt.size),
            "ray_ends": self.ends,
            "offset": ranges,
            "radius_mm": {"max": 1e3 * float(self.radius.max())},
            "tilt_deg": {"max": float(np.degrees(self.tilt.max()))},
            "bands": self.bands(),
        }


def directions(count: int, cables: int) -> Array:
    """Return directions in the space of drives (count, m), evenly spread: a Sobol sequence made normal.

    Args:
        count: How many.
        cables: Dimensions.
    """
    from scipy.stats import qmc  # heavy

    unit = qmc.Sobol(cables, rng=SEED).random_base2(max(count - 1, 1).bit_length())[:count]
    normal = np.vectorize(NormalDist().inv_cdf, otypes=[float])
    found: Array = normal(np.clip(unit, 1e-9, 1.0 - 1e-9))
    return found


def explore(
    robot: RobotDescription, count: int, limits: Limits, engine: Engine, told: Callable[[int, int], None]
) -> Workspace:
    """Cast rays in all directions.

    Args:
        robot: The robot.
        count: How many rays.
        limits: Where they end.
        engine: Where they are followed.
        told: Is told how many of how many are done.

    Raises:
        RunInterruptedError: If a signal came.
        TcrctlError: If a worker process died.
    """
    cables = tuple(route.name for route in robot.cables.routes)
    parcel = carried(robot)
    orders = [(i, parcel, toward, limits) for i, toward in enumerate(directions(count, len(cables)))]
    rays: dict[int, Ray] = {}
    with Interruption() as interruption:
        for (number, *_), ray in outcomes(engine, cast, orders, check=interruption.check):
            if isinstance(ray, Crash):
                raise TcrctlError(f"a ray could not be followed: {ray.reason}")
            rays[number] = ray
            told(len(rays), count)
    return joined(robot.name, cables, [rays[i] for i in range(count)])


def joined(name: str, cables: tuple[str, ...], rays: list[Ray]) -> Workspace:
    """Return what rays from one rest, at least one, have found together.

    Args:
        name: Of the robot.
        cables: Names of its cables.
        rays: What lies on each.
    """
    normal = np.concatenate([ray.normal for ray in rays])
    return Workspace(
        robot=name,
        cables=cables,
        ray=np.repeat(np.arange(len(rays)), [len(ray.drive) for ray in rays]),
        drive=np.concatenate([ray.drive for ray in rays]),
        offset=np.concatenate([ray.position for ray in rays]) - rays[0].position[0],
        tilt=np.arccos(np.clip(normal[:, 2], -1.0, 1.0)),
        tension=np.concatenate([ray.tension for ray in rays]),
        ends=dict(sorted(Counter(ray.end for ray in rays).items())),
    )

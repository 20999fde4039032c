"""A robot file, validated, and its springs and cables one by one in SI units.

YAML -> RobotDescription -> spring_list, cable_routes -> robot.model
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field, model_validator

from tcrctl.config import shipped, strict_yaml
from tcrctl.config.keys import Finding
from tcrctl.config.settings import OrOff, Settings, Vector, quantity, refuse
from tcrctl.robot import checks
from tcrctl.robot.module import ModuleSettings
from tcrctl.robot.sections import (
    BaseSettings,
    CableSettings,
    FreeRoute,
    FrictionSettings,
    Name,
    Route,
    SpringBetween,
    SpringSettings,
    Stroke,
    Tip,
)


class RobotDescription(Settings):
    """One robot: geometry, material, routing and limits, in the units of the file."""

    name: Name
    description: str = Field(default="", description="one line for listings")
    modules: ModuleSettings
    springs: SpringSettings
    cables: CableSettings
    friction: OrOff[FrictionSettings] = Field(default=None, description="friction in the cable holes, or off")
    base: BaseSettings = BaseSettings()
    damping_1_s: float = quantity("1/s", "mass-proportional damping", 0.0, ge=0)
    gravity_m_s2: Vector = quantity("m/s2", "gravity in the world frame", (0.0, 0.0, -9.81))
    tip: Tip
    stroke_mm: Stroke = quantity("mm", "limits of every drive length; negative pays out")
    tension_limit_n: float = quantity("N", "largest tension allowed in any cable", gt=0)

    @model_validator(mode="after")
    def _agrees_with_itself(self) -> RobotDescription:
        refuse(self._disagreements())
        return self

    def _disagreements(self) -> Iterator[Finding]:
        count = self.modules.count
        yield from checks.module_disagreements(self.modules)
        yield from checks.spring_disagreements(self.springs, count)
        yield from checks.cable_disagreements(self.cables, count, self.tension_limit_n)
        yield from checks.friction_disagreements(self.friction, self.cables)
        yield from checks.tip_disagreements(self.tip, count)
        yield from checks.stroke_disagreements(self.stroke_mm)


@dataclass(frozen=True, slots=True)
class Spring:
    """One spring between two nodes.

    Attributes:
        nodes: Names of its end nodes.
        axial_stiffness: EA [N].
        natural_length: Natural length [m].
        mass: Mass [kg].
        damping: Axial damping [N s/m].
        tension_only: Slack when shorter than its natural length.
    """

    nodes: tuple[str, str]
    axial_stiffness: float
    natural_length: float
    mass: float
    damping: float
    tension_only: bool


@dataclass(frozen=True, slots=True)
class CableRoute:
    """One cable.

    Attributes:
        name: Name of the cable.
        holes: Ring number and angle [rad] of every hole, from the actuator on; ring 0 is the base.
        axial_stiffness: EA [N].
        lead: Actuator to first hole [m].
        damping: Axial damping [N s/m].
        initial_tension: Tension at zero drive [N], or None if the rest length is given.
        rest_length: Unstretched length, lead included [m], or None if the tension is given.
    """

    name: str
    holes: tuple[tuple[int, float], ...]
    axial_stiffness: float
    lead: float
    damping: float
    initial_tension: float | None
    rest_length: float | None


def spring_list(robot: RobotDescription) -> tuple[Spring, ...]:
    """Return all springs: those of the joints from the base down, then the further ones.

    Args:
        robot: The robot.
    """
    springs = robot.springs
    own = {
        frozenset(entry.nodes): entry.model_dump(exclude={"nodes"}, exclude_none=True)
        for entry in springs.each
    }
    entries = springs.entries(robot.modules.count)
    return tuple(
        _spring(entry.model_copy(update=own.get(frozenset(entry.nodes), {})), springs) for entry in entries
    )


def _spring(entry: SpringBetween, common: SpringSettings) -> Spring:
    given = {**common.model_dump(), **entry.model_dump(exclude_none=True)}
    return Spring(
        nodes=entry.nodes,
        axial_stiffness=_axial_stiffness(given["youngs_modulus_mpa"], given["diameter_mm"]),
        natural_length=given["natural_length_mm"] / 1e3,
        mass=given["mass_g"] / 1e3,
        damping=float(given["damping_n_s_m"]),
        tension_only=given["tension_only"],
    )


def _axial_stiffness(youngs_modulus_mpa: float, diameter_mm: float) -> float:
    """Return EA [N]; MPa times mm2 is N."""
    return youngs_modulus_mpa * math.pi / 4.0 * diameter_mm**2


def cable_routes(robot: RobotDescription) -> tuple[CableRoute, ...]:
    """Return all cables in the order of the drives.

    Args:
        robot: The robot.
    """
    return tuple(_cable(route, robot.cables) for route in robot.cables.routes)


def _cable(route: Route, common: CableSettings) -> CableRoute:
    if isinstance(route, FreeRoute):
        holes = tuple((hole.ring, math.radians(hole.hole_deg)) for hole in route.through)
    else:
        holes = tuple((ring, math.radians(route.hole_deg)) for ring in range(route.to_ring + 1))
    tension = common.initial_tension_n if route.initial_tension_n is None else route.initial_tension_n
    return CableRoute(
        name=route.name,
        holes=holes,
        axial_stiffness=_axial_stiffness(common.youngs_modulus_mpa, common.diameter_mm),
        lead=common.lead_mm / 1e3,
        damping=float(common.damping_n_s_m),
        initial_tension=tension,
        rest_length=None if route.rest_length_mm is None else route.rest_length_mm / 1e3,
    )


def load_robot(
    name_or_path: str, folder: Path | None = None, overrides: Sequence[str] = ()
) -> RobotDescription:
    """Return a robot.

    Args:
        name_or_path: Shipped name, or path of a YAML file.
        folder: Where a relative path starts; the working directory if left out.
        overrides: Assignments ``a.b=c``, applied in order.

    Raises:
        UnknownNameError: If there is no shipped robot of that name.
        SpecError: If the file has problems; all are listed.
        InputError: If there is no such file.
    """
    document = strict_yaml.load(shipped.find_robot(name_or_path, folder))
    for assignment in overrides:
        document = strict_yaml.override(document, assignment)
    return strict_yaml.validate(document, RobotDescription)

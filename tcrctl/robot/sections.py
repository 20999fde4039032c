"""The sections of a robot file, each with units in its keys."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias, TypeVar

from pydantic import Discriminator, Field, Tag

from tcrctl.config.settings import Settings, quantity
from tcrctl.robot.module import LABELS

T = TypeVar("T")

#: Folders and files are named after it, with times and endings, and 255 bytes is all that file systems give.
Name: TypeAlias = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=100)]
NodeName: TypeAlias = Annotated[str, Field(pattern=rf"^(base|m[1-9][0-9]*)\.({'|'.join(LABELS)})$")]
JointNode: TypeAlias = Annotated[str, Field(pattern=rf"^(upper|lower)\.({'|'.join(LABELS)})$")]
Degrees: TypeAlias = Annotated[
    float,
    Field(
        ge=-360, le=360, description="angle of the hole on the ring, from node n1, counter-clockwise [deg]"
    ),
]


def _one_or_each(value: Any) -> str:
    return "(each)" if isinstance(value, list | tuple) else "(one)"


CablesOrOne = Annotated[
    Annotated[T, Tag("(one)")] | Annotated[tuple[T, ...], Field(strict=False), Tag("(each)")],
    Discriminator(_one_or_each),
]
"""One value for all cables, or a list with one for each."""


class SpringBetween(Settings):
    """A further spring; what is left out is as in ``springs``."""

    nodes: tuple[NodeName, NodeName] = Field(
        description="the nodes it joins, for instance [base.n1, m3.apex]"
    )
    youngs_modulus_mpa: float | None = quantity("MPa", "Young's modulus", None, gt=0)
    diameter_mm: float | None = quantity("mm", "equivalent diameter", None, gt=0)
    natural_length_mm: float | None = quantity("mm", "natural length", None, gt=0)
    mass_g: float | None = quantity("g", "mass, on the two end nodes", None, ge=0)
    damping_n_s_m: float | None = quantity("N s/m", "axial damping", None, ge=0)
    tension_only: bool | None = Field(default=None, description="slack when shorter than its natural length")


def _between_tag(value: Any) -> str:
    return "(pair)" if isinstance(value, list | tuple) else "(map)"


Between: TypeAlias = Annotated[
    Annotated[tuple[NodeName, NodeName], Tag("(pair)")] | Annotated[SpringBetween, Tag("(map)")],
    Discriminator(_between_tag),
]


class SpringSettings(Settings):
    """The springs: values common to all, and which nodes they join."""

    youngs_modulus_mpa: float = quantity("MPa", "Young's modulus", gt=0)
    diameter_mm: float = quantity("mm", "equivalent diameter", gt=0)
    natural_length_mm: float = quantity("mm", "natural length", gt=0)
    mass_g: float = quantity("g", "mass of one spring, on its two end nodes", 0.0, ge=0)
    damping_n_s_m: float = quantity("N s/m", "axial damping of one spring", 0.0, ge=0)
    tension_only: bool = Field(default=True, description="slack when shorter than its natural length")
    joint: tuple[tuple[JointNode, JointNode], ...] = Field(
        default=(), description="node pairs joined between every module (upper) and the next one (lower)"
    )
    between: tuple[Between, ...] = Field(
        default=(), description="further springs between any two named nodes"
    )
    each: tuple[SpringBetween, ...] = Field(
        default=(), description="springs that are not like the others, by the nodes that they join"
    )

    def entries(self, modules: int) -> list[SpringBetween]:
        """Return all springs of a robot of so many modules: joints from the base down, then the further ones."""
        joints = [
            SpringBetween(nodes=(_joint_node(a, upper), _joint_node(b, upper)))
            for upper in range(modules)
            for a, b in self.joint
        ]
        return joints + [e if isinstance(e, SpringBetween) else SpringBetween(nodes=e) for e in self.between]


def _joint_node(name: str, upper: int) -> str:
    side, node = name.split(".")
    module = upper if side == "upper" else upper + 1
    return f"m{module}.{node}" if module else f"base.{node}"


class Hole(Settings):
    """A hole in a ring that a cable runs through."""

    ring: int = Field(description="number of the ring, 0 is the base", ge=0)
    hole_deg: Degrees


class StraightRoute(Settings):
    """A cable through the same hole of every ring from the base to ``to_ring``."""

    name: Name
    hole_deg: Degrees
    to_ring: int = Field(description="ring that the cable ends at", ge=1)
    initial_tension_n: float | None = quantity(
        "N", "tension at zero drive, instead of the common one", None, ge=0
    )
    rest_length_mm: float | None = quantity("mm", "unstretched length with the lead", None, gt=0)


class FreeRoute(Settings):
    """A cable through listed holes, in this order, beginning at the base."""

    name: Name
    through: tuple[Hole, ...] = Field(description="holes in order from the actuator", min_length=2)
    initial_tension_n: float | None = quantity(
        "N", "tension at zero drive, instead of the common one", None, ge=0
    )
    rest_length_mm: float | None = quantity("mm", "unstretched length with the lead", None, gt=0)


def _route_tag(value: Any) -> str:
    through = "through" in value if isinstance(value, dict) else isinstance(value, FreeRoute)
    return "(through)" if through else "(straight)"


Route: TypeAlias = Annotated[
    Annotated[StraightRoute, Tag("(straight)")] | Annotated[FreeRoute, Tag("(through)")],
    Discriminator(_route_tag),
]


class CableSettings(Settings):
    """The cables: values common to all, and their routes."""

    youngs_modulus_mpa: float = quantity("MPa", "Young's modulus", gt=0)
    diameter_mm: float = quantity("mm", "diameter", gt=0)
    lead_mm: float = quantity("mm", "actuator to base ring, part of the cable's length", gt=0)
    damping_n_s_m: float = quantity("N s/m", "axial damping of one cable", 0.0, ge=0)
    initial_tension_n: float | None = quantity(
        "N",
        "tension at zero drive, from which rest lengths follow; or give rest_length_mm per route",
        None,
        ge=0,
    )
    routes: tuple[Route, ...] = Field(
        description="one entry per cable, in the order of the drives", min_length=1
    )


class FrictionSettings(Settings):
    """Friction of the cables in their holes: capstan law, see docs/reality.md."""

    coefficient: CablesOrOne[Annotated[float, Field(ge=0.0, le=3.0)]] = quantity(
        "1", "coefficient of Coulomb friction in the holes, common or per cable", 0.1
    )
    least_wrap_deg: float = quantity("deg", "least angle by which a cable wraps a hole", 2.0, ge=0, le=90)
    drag_n: float = quantity("N", "friction of a hole whatever the tension", 0.0, ge=0)


class BaseSettings(Settings):
    """How the fixed base hangs."""

    tilt_deg: tuple[float, float] = quantity("deg", "turn of the base about the x and the y axis", (0.0, 0.0))


class Tip(Settings):
    """The ring that is the end effector."""

    ring: int = Field(description="end pose = centroid and normal of this ring", ge=1)


Stroke: TypeAlias = tuple[float, float]

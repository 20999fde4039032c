"""What a ``plant:`` section may say, units in the key names."""

from __future__ import annotations

from collections import Counter
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag
from pydantic_core import PydanticCustomError

from tcrctl.settings import OrOff, Settings, quantity


class Mismatch(Settings):
    """Factors by which the plant differs from the model that the controller knows."""

    springs_youngs_modulus: float = quantity("1", "factor on the springs' Young's modulus", 1.0, gt=0)
    cables_youngs_modulus: float = quantity("1", "factor on the cables' Young's modulus", 1.0, gt=0)
    density: float = quantity("1", "factor on all masses", 1.0, gt=0)


def _different(rings: tuple[int, ...]) -> tuple[int, ...]:
    repeated = [ring for ring, times in Counter(rings).items() if times > 1]
    if repeated:
        raise ValueError(f"ring {repeated[0]} is listed more than once")
    return rings


def _must_be_all(value: Any) -> Any:
    if value != "all":
        raise PydanticCustomError("rings", "must be all or a list of ring numbers")
    return value


def _rings_tag(value: Any) -> str:
    return "(list)" if isinstance(value, list | tuple) else "(all)"


Ring: TypeAlias = Annotated[int, Field(ge=1)]
Rings: TypeAlias = Annotated[
    Annotated[Literal["all"], BeforeValidator(_must_be_all), Tag("(all)")]
    | Annotated[tuple[Ring, ...], Field(min_length=1), AfterValidator(_different), Tag("(list)")],
    Discriminator(_rings_tag),
]


class SimulatedSettings(Settings):
    """The robot's equations of motion, integrated by the generalized-alpha method."""

    kind: Literal["simulated"]
    step_ms: float = quantity(
        "ms", "internal time step; a whole number of them makes a control period", 1.0, gt=0
    )
    spectral_radius: float = quantity(
        "1", "spectral radius of the integrator at infinite frequency", 0.8, ge=0, le=1
    )
    mismatch: OrOff[Mismatch] = Field(default=None, description="factors on the plant's parameters, or off")
    noise_um: float = quantity("um", "standard deviation of every measured coordinate", 0.0, ge=0)
    latency_ms: float = quantity("ms", "age of a measurement when it is read", 0.0, ge=0, le=1000)
    measured_rings: Rings = Field(default="all", description="rings whose three nodes carry markers")


class RigSettings(Settings):
    """The real robot, measured by cameras and moved by drives; always paced by the clock."""

    kind: Literal["rig"]
    rig: str = Field(description="shipped rig, or path of a rig file relative to this one", min_length=1)


PlantSettings: TypeAlias = Annotated[
    SimulatedSettings | RigSettings, Field(discriminator="kind", description="what is controlled")
]
"""Union of all kinds of plant, told apart by ``kind``."""

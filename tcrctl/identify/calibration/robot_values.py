"""Unknowns -> the robot as a description: what is found can be read, run, and given to the controller."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tcrctl.identify.calibration.body import Body
from tcrctl.robot.description import RobotDescription, cable_routes
from tcrctl.robot.module import LABELS, ModuleDifference
from tcrctl.robot.sections import FreeRoute, FrictionSettings, Hole, SpringBetween
from tcrctl.signals import Array


def robot_of(body: Body, x: Array, name: str, friction: FrictionSettings | None = None) -> RobotDescription:
    """Return the robot that x describes.

    Args:
        body: What x belongs to.
        x: Unknowns (n,).
        name: Of the new robot.
        friction: Of its cables; that of the described robot if None.
    """
    hung = body.hung(body.unknowns.take(x, "tilt"))
    density = body.mass_factors(x)[0]
    springs = {"each": _springs(body, x), "mass_g": hung.springs.mass_g * density}
    cables = {"initial_tension_n": None, "routes": _routes(body, x)}
    made = hung.model_copy(
        update={
            "name": name,
            "modules": hung.modules.model_copy(update={"each": _modules(body, x)}),
            "springs": hung.springs.model_copy(update=springs),
            "cables": hung.cables.model_copy(update=cables),
            "friction": hung.friction if friction is None else friction,
        }
    )
    return RobotDescription.model_validate_json(made.model_dump_json(exclude_none=True))


def _modules(body: Body, x: Array) -> tuple[ModuleDifference, ...]:
    modules = body.description.modules
    given = {entry.module: entry for entry in modules.each}
    masses, offsets = body.mass_factors(x)[1], body.offsets(x)
    made = []
    for i in range(modules.count):
        entry = given.get(i + 1, ModuleDifference(module=i + 1))
        moved: dict[Any, Any] = {
            label: tuple((np.array(entry.offsets_mm.get(label, (0.0, 0.0, 0.0))) + 1e3 * by).tolist())  # type: ignore[call-overload]
            for label, by in zip(LABELS, offsets[i], strict=True)
        }
        mass = modules.of(i + 1).mass_g * float(masses[i])
        made.append(entry.model_copy(update={"mass_g": mass, "offsets_mm": moved}))
    return tuple(made)


def _springs(body: Body, x: Array) -> tuple[SpringBetween, ...]:
    springs = body.description.springs
    given = {frozenset(entry.nodes): entry for entry in springs.each}
    density, made = body.mass_factors(x)[0], []
    entries = springs.entries(body.description.modules.count)
    for spring, factor in zip(entries, body.spring_factors(x).tolist(), strict=True):
        entry = given.get(frozenset(spring.nodes), SpringBetween(nodes=spring.nodes))
        said = entry.youngs_modulus_mpa or spring.youngs_modulus_mpa or springs.youngs_modulus_mpa
        own: dict[str, Any] = {"youngs_modulus_mpa": said * factor}
        mass = entry.mass_g if entry.mass_g is not None else spring.mass_g
        if mass is not None:
            own["mass_g"] = mass * density
        made.append(entry.model_copy(update=own))
    return tuple(made)


def _routes(body: Body, x: Array) -> tuple[FreeRoute, ...]:
    rest, turned, made, first = body.rest_lengths(x), body.unknowns.take(x, "holes").tolist(), [], 0
    for route, length in zip(cable_routes(body.description), rest.tolist(), strict=True):
        by = turned[first : first + len(route.holes)]
        first += len(route.holes)
        holes = tuple(
            Hole(ring=ring, hole_deg=math.remainder(math.degrees(angle + more), 360.0))
            for (ring, angle), more in zip(route.holes, by, strict=True)
        )
        made.append(FreeRoute(name=route.name, through=holes, rest_length_mm=1e3 * length))
    return tuple(made)

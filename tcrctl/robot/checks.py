"""What must agree between the sections of a robot file; yields path and message of what does not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

from tcrctl.config.settings import Path
from tcrctl.robot.sections import CableSettings, FreeRoute, Route, SpringBetween, SpringSettings

if TYPE_CHECKING:
    from tcrctl.robot.description import RobotDescription


def disagreements(robot: RobotDescription) -> Iterator[tuple[Path, str]]:
    """Yield everything in a robot description that contradicts itself."""
    yield from _springs(robot.springs, robot.modules.count)
    yield from _routes(robot.cables, robot.modules.count)
    yield from _lengths_or_tensions(robot.cables)
    if robot.tip.ring > robot.modules.count:
        yield ("tip", "ring"), _no_ring(robot.tip.ring, robot.modules.count)
    low, high = robot.stroke_mm
    if not low <= 0 <= high or low == high:
        yield ("stroke_mm",), f"must be [lowest, highest] with 0 in between, not [{low:g}, {high:g}]"
    for i, tension in _given_tensions(robot.cables):
        if tension > robot.tension_limit_n:
            path: Path = (
                ("cables", "initial_tension_n") if i < 0 else ("cables", "routes", i, "initial_tension_n")
            )
            yield path, f"{tension:g} N is above tension_limit_n, {robot.tension_limit_n:g} N"


def _no_ring(ring: int, count: int) -> str:
    return f"there is no ring {ring}; rings are 0 (base) to {count}"


def _springs(springs: SpringSettings, count: int) -> Iterator[tuple[Path, str]]:
    seen: set[frozenset[str]] = set()
    for i, pair in enumerate(springs.joint):
        yield from _pair(("springs", "joint", i), pair, seen)
    seen.clear()
    for i, entry in enumerate(springs.between):
        path: Path = ("springs", "between", i)
        nodes = entry.nodes if isinstance(entry, SpringBetween) else entry
        yield from _pair(path, nodes, seen)
        for node in nodes:
            module = node.split(".")[0]
            if module != "base" and int(module[1:]) > count:
                yield path, f"there is no node {node}; modules are base, m1 to m{count}"


def _pair(path: Path, nodes: tuple[str, str], seen: set[frozenset[str]]) -> Iterator[tuple[Path, str]]:
    if nodes[0] == nodes[1]:
        yield path, f"joins {nodes[0]} with itself"
    if frozenset(nodes) in seen:
        yield path, f"{nodes[0]} and {nodes[1]} are joined already"
    seen.add(frozenset(nodes))


def _routes(cables: CableSettings, count: int) -> Iterator[tuple[Path, str]]:
    names = Counter(route.name for route in cables.routes)
    for i, route in enumerate(cables.routes):
        path: Path = ("cables", "routes", i)
        if names[route.name] > 1:
            yield (*path, "name"), f"the name {route.name!r} is used {names[route.name]} times"
        if isinstance(route, FreeRoute):
            yield from _through((*path, "through"), route, count)
        elif route.to_ring > count:
            yield (*path, "to_ring"), _no_ring(route.to_ring, count)


def _through(path: Path, route: FreeRoute, count: int) -> Iterator[tuple[Path, str]]:
    if route.through[0].ring != 0:
        yield (*path, 0, "ring"), f"a cable begins at ring 0 (base), not at ring {route.through[0].ring}"
    for i, hole in enumerate(route.through):
        if hole.ring > count:
            yield (*path, i, "ring"), _no_ring(hole.ring, count)
        if i > 0 and hole == route.through[i - 1]:
            yield (*path, i), "the same hole twice in a row"


def _lengths_or_tensions(cables: CableSettings) -> Iterator[tuple[Path, str]]:
    """Either every cable is given by a tension or every cable by a rest length."""
    by_length = any(route.rest_length_mm is not None for route in cables.routes)
    for i, route in enumerate(cables.routes):
        problem = _length_or_tension(route, by_length, cables.initial_tension_n)
        if problem:
            yield ("cables", "routes", i), problem
    if by_length and cables.initial_tension_n is not None:
        yield ("cables", "initial_tension_n"), "give either this or rest_length_mm per route, not both"


def _length_or_tension(route: Route, by_length: bool, common: float | None) -> str:
    if route.rest_length_mm is not None and route.initial_tension_n is not None:
        return "give either initial_tension_n or rest_length_mm, not both"
    if by_length and route.rest_length_mm is None:
        return "rest_length_mm is missing; it must be given for all routes or for none"
    if not by_length and common is None and route.initial_tension_n is None:
        return "needs initial_tension_n or rest_length_mm, here or (initial_tension_n) for all cables"
    return ""


def _given_tensions(cables: CableSettings) -> Iterator[tuple[int, float]]:
    """Yield route number (-1: common to all) and tension [N] of every tension in the file."""
    if cables.initial_tension_n is not None:
        yield -1, cables.initial_tension_n
    for i, route in enumerate(cables.routes):
        if route.initial_tension_n is not None:
            yield i, route.initial_tension_n

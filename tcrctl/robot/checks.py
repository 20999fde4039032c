"""What must agree between the sections of a robot file; yields path and message of what does not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from tcrctl.config.keys import Finding, Keys
from tcrctl.robot.module import ModuleSettings, module_of, node_index
from tcrctl.robot.sections import (
    CableSettings,
    FreeRoute,
    FrictionSettings,
    Route,
    SpringBetween,
    SpringSettings,
    Stroke,
    Tip,
)


def module_disagreements(modules: ModuleSettings) -> Iterator[Finding]:
    """Yield what is wrong with the modules that are not like the others."""
    times = Counter(entry.module for entry in modules.each)
    for i, entry in enumerate(modules.each):
        path: Keys = ("modules", "each", i, "module")
        if entry.module > modules.count:
            yield path, f"there is no module {entry.module}; modules are 1 to {modules.count}"
        elif times[entry.module] > 1:
            yield path, f"module {entry.module} is listed {times[entry.module]} times"


def friction_disagreements(friction: FrictionSettings | None, cables: CableSettings) -> Iterator[Finding]:
    """Yield what is wrong with a list of coefficients."""
    given = friction.coefficient if friction is not None else 0.0
    if isinstance(given, tuple) and len(given) != len(cables.routes):
        names = ", ".join(route.name for route in cables.routes)
        message = f"there are {len(cables.routes)} cables, {names}, and {len(given)} values"
        yield ("friction", "coefficient"), message


def cable_disagreements(cables: CableSettings, count: int, tension_limit_n: float) -> Iterator[Finding]:
    """Yield what is wrong with the cables of a robot of so many modules."""
    yield from _routes(cables, count)
    yield from _lengths_or_tensions(cables)
    for i, tension in _given_tensions(cables):
        if tension > tension_limit_n:
            path: Keys = (
                ("cables", "initial_tension_n") if i < 0 else ("cables", "routes", i, "initial_tension_n")
            )
            yield path, f"{tension:g} N is above tension_limit_n, {tension_limit_n:g} N"


def tip_disagreements(tip: Tip, count: int) -> Iterator[Finding]:
    """Yield what is wrong with the tip of a robot of so many modules."""
    if tip.ring > count:
        yield ("tip", "ring"), _no_ring(tip.ring, count)


def stroke_disagreements(stroke_mm: Stroke) -> Iterator[Finding]:
    """Yield what is wrong with the limits of the drive lengths."""
    low, high = stroke_mm
    if not low <= 0 <= high or low == high:
        yield ("stroke_mm",), f"must be [lowest, highest] with 0 in between, not [{low:g}, {high:g}]"


def _no_ring(ring: int, count: int) -> str:
    return f"there is no ring {ring}; rings are 0 (base) to {count}"


def spring_disagreements(springs: SpringSettings, count: int) -> Iterator[Finding]:
    """Yield what is wrong with the springs of a robot of so many modules."""
    seen: set[frozenset[str]] = set()
    for i, pair in enumerate(springs.joint):
        yield from _pair(("springs", "joint", i), pair, seen)
    seen.clear()
    for i, entry in enumerate(springs.between):
        path: Keys = ("springs", "between", i)
        nodes = entry.nodes if isinstance(entry, SpringBetween) else entry
        yield from _pair(path, nodes, seen)
        for node in nodes:
            if module_of(node_index(node)) > count:
                yield path, f"there is no node {node}; modules are base, m1 to m{count}"
    yield from _unlike_springs(springs, count)


def _unlike_springs(springs: SpringSettings, count: int) -> Iterator[Finding]:
    """Yield what is wrong with the springs that are not like the others."""
    known = {frozenset(entry.nodes) for entry in springs.entries(count)}
    times = Counter(frozenset(entry.nodes) for entry in springs.each)
    for i, entry in enumerate(springs.each):
        path: Keys = ("springs", "each", i, "nodes")
        a, b = entry.nodes
        if frozenset(entry.nodes) not in known:
            yield path, f"there is no spring between {a} and {b}"
        elif times[frozenset(entry.nodes)] > 1:
            yield path, f"the spring between {a} and {b} is listed {times[frozenset(entry.nodes)]} times"


def _pair(path: Keys, nodes: tuple[str, str], seen: set[frozenset[str]]) -> Iterator[Finding]:
    if nodes[0] == nodes[1]:
        yield path, f"joins {nodes[0]} with itself"
    if frozenset(nodes) in seen:
        yield path, f"{nodes[0]} and {nodes[1]} are joined already"
    seen.add(frozenset(nodes))


def _routes(cables: CableSettings, count: int) -> Iterator[Finding]:
    names = Counter(route.name for route in cables.routes)
    for i, route in enumerate(cables.routes):
        path: Keys = ("cables", "routes", i)
        if names[route.name] > 1:
            yield (*path, "name"), f"the name {route.name!r} is used {names[route.name]} times"
        if isinstance(route, FreeRoute):
            yield from _through((*path, "through"), route, count)
        elif route.to_ring > count:
            yield (*path, "to_ring"), _no_ring(route.to_ring, count)


def _through(path: Keys, route: FreeRoute, count: int) -> Iterator[Finding]:
    if route.through[0].ring != 0:
        yield (*path, 0, "ring"), f"a cable begins at ring 0 (base), not at ring {route.through[0].ring}"
    for i, hole in enumerate(route.through):
        if hole.ring > count:
            yield (*path, i, "ring"), _no_ring(hole.ring, count)
        if i > 0 and hole == route.through[i - 1]:
            yield (*path, i), "the same hole twice in a row"


def _lengths_or_tensions(cables: CableSettings) -> Iterator[Finding]:
    """Check that either every cable is given by a tension or every cable by a rest length."""
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

"""The robot as frozen arrays: what every kernel reads and nothing changes.

``build_model`` turns a validated description (YAML) into a :class:`Model`; ``scaled`` makes the mismatched
twin that a simulated plant uses.
"""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcrctl.elements import bar, sliding_cable, torus
from tcrctl.robot.description import RobotDescription, cable_routes, spring_list
from tcrctl.robot.module import (
    NODES,
    RIGID_BARS,
    RING,
    SIZE,
    mass_block,
    module_of,
    node_index,
    rigid_bars,
    ring_nodes,
    straight_stack,
)
from tcrctl.signals import Array


class Model(NamedTuple):
    """What the kernels read: the arrays of one robot, read-only. Node numbering: robot.module.

    Attributes:
        mass: Mass matrix: rings (4), rods, springs; one block per free module (n_modules, 12, 12) [kg].
        damping: Mass-proportional damping [1/s].
        bandwidth: Upper block bandwidth w of the tangent.
        bar_nodes: End nodes of rods, ring sides and springs (n_bars, 2).
        bars: Their parameters (n_bars, 4), columns as in elements.bar.
        first_hole: Holes of cable c are first_hole[c] .. first_hole[c + 1] - 1 (m + 1,).
        hole_nodes: Ring nodes that carry each hole (n_holes, 3).
        hole_weights: Their weights (n_holes, 3), see elements.torus.
        cables: Cable parameters (m, 4), columns as in elements.sliding_cable.
    """

    mass: Array
    damping: float
    bandwidth: int
    bar_nodes: NDArray[np.int64]
    bars: Array
    first_hole: NDArray[np.int64]
    hole_nodes: NDArray[np.int64]
    hole_weights: Array
    cables: Array


def _mass_matrix(d: RobotDescription) -> Array:
    """Return (n_modules, 12, 12): ring by (4), rods consistent, springs lumped on their end nodes [kg]."""
    blocks = np.stack([mass_block(d.modules.of(module)) for module in range(d.modules.count + 1)])
    for spring in spring_list(d):
        for node in (node_index(name) for name in spring.nodes):
            blocks[module_of(node), node % NODES, node % NODES] += spring.mass / 2.0
    return np.stack([np.kron(b, np.eye(3)) for b in blocks[1:]])


def _bars(d: RobotDescription, nodes: Array) -> tuple[NDArray[np.int64], Array]:
    """End nodes and parameters of rods and ring sides of the free modules (RIGID_BARS each), then springs."""
    pairs: list[tuple[int, int]] = []
    rows: list[list[float]] = []
    for module in range(1, d.modules.count + 1):
        own = d.modules.of(module)
        section = math.pi / 4.0 * (own.rod_diameter_mm / 1000.0) ** 2
        ea = own.youngs_modulus_mpa * 1e6 * section
        for i, j in rigid_bars(module):
            length = float(np.linalg.norm(nodes[j] - nodes[i]))
            pairs.append((i, j))
            rows.append([length, ea / length, own.damping_n_s_m, 0.0])
    for spring in spring_list(d):
        pairs.append((node_index(spring.nodes[0]), node_index(spring.nodes[1])))
        stiffness = spring.axial_stiffness / spring.natural_length
        rows.append([spring.natural_length, stiffness, spring.damping, float(spring.tension_only)])
    return np.array(pairs, dtype=np.int64), np.array(rows)


def _holes(d: RobotDescription) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Return first_hole, hole_nodes and hole_weights of all routes."""
    nodes = []
    weights = []
    first = [0]
    for route in cable_routes(d):
        for ring, angle in route.holes:
            nodes.append(ring_nodes(ring))
            weights.append(torus.point_weights(angle))
        first.append(len(nodes))
    return np.array(first, dtype=np.int64), np.array(nodes, dtype=np.int64), np.array(weights)


def _bandwidth(bars: NDArray[np.int64], hole_nodes: NDArray[np.int64], first: NDArray[np.int64]) -> int:
    """Return the largest distance in modules between two coupled free modules; at least 1."""
    widths = [1]
    for i, j in module_of(bars):
        if i > 0 and j > 0:
            widths.append(abs(int(i) - int(j)))
    rings = module_of(hole_nodes[:, 0])
    for c in range(first.shape[0] - 1):
        path = rings[first[c] : first[c + 1]]
        widths += [abs(int(b) - int(a)) for a, b in itertools.pairwise(path) if a > 0 and b > 0]
    return max(widths)


def freeze(model: Model) -> Model:
    """Copy of ``model`` with every array read-only, so that all kernels see one type."""
    fields: dict[str, Any] = model._asdict()
    for name, value in fields.items():
        if isinstance(value, np.ndarray):
            fields[name] = value.copy()
            fields[name].flags.writeable = False
    return Model(**fields)


def undeformed(d: RobotDescription) -> Array:
    """Return nodes of the straight stack (3 n_nodes,) [m], where no rod is stretched, hung from its base."""
    nodes = straight_stack(d.modules)
    hung: Array = nodes @ _tilt(d).T if any(d.base.tilt_deg) else nodes
    return hung.ravel()


def _tilt(d: RobotDescription) -> Array:
    """Return the rotation of the base (3, 3): about x, then about y."""
    x, y = np.radians(d.base.tilt_deg)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, math.cos(x), -math.sin(x)], [0.0, math.sin(x), math.cos(x)]])
    about_y = np.array([[math.cos(y), 0.0, math.sin(y)], [0.0, 1.0, 0.0], [-math.sin(y), 0.0, math.cos(y)]])
    return np.asarray(about_y @ about_x)


def gravity_force(model: Model, gravity: Array) -> Array:
    """Return the weight of every node coordinate (3 n_nodes,) [N] for gravity (3,) [m/s2]; zero on the base."""
    force = np.zeros(SIZE * (model.mass.shape[0] + 1))
    for i, block in enumerate(model.mass):
        force[SIZE * (i + 1) : SIZE * (i + 2)] = block @ np.tile(gravity, NODES)
    return force


def build_model(d: RobotDescription, cable_rest: Array) -> Model:
    """Make the kernel arrays of the robot described by ``d`` with cable rest lengths (m,) [m], lead included."""
    first_hole, hole_nodes, hole_weights = _holes(d)
    bar_nodes, bars = _bars(d, straight_stack(d.modules))
    routes = cable_routes(d)
    ea = np.array([route.axial_stiffness for route in routes])
    damping = np.array([route.damping for route in routes])
    lead = np.array([route.lead for route in routes])
    return freeze(
        Model(
            mass=_mass_matrix(d),
            damping=float(d.damping_1_s),
            bandwidth=_bandwidth(bar_nodes, hole_nodes, first_hole),
            bar_nodes=bar_nodes,
            bars=bars,
            first_hole=first_hole,
            hole_nodes=hole_nodes,
            hole_weights=hole_weights,
            cables=np.column_stack([cable_rest, ea / cable_rest, damping, lead]),
        )
    )


def scaled(model: Model, springs: float = 1.0, cables: float = 1.0, density: float = 1.0) -> Model:
    """Return a twin of ``model`` with factors on moduli of springs and cables and on masses; same rest lengths."""
    bars, strings = model.bars.copy(), model.cables.copy()
    bars[RIGID_BARS * model.mass.shape[0] :, bar.STIFFNESS] *= springs
    strings[:, sliding_cable.STIFFNESS] *= cables
    return freeze(model._replace(bars=bars, cables=strings, mass=density * model.mass))


def with_load(model: Model, ring: int, mass: float) -> Model:
    """Return a twin of ``model`` whose ring from node row ``ring`` on carries ``mass`` [kg], a third per node."""
    blocks = model.mass.copy()
    load = blocks[module_of(ring) - 1]
    load[np.arange(3 * RING), np.arange(3 * RING)] += mass / 3.0
    return freeze(model._replace(mass=blocks))

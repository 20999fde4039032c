"""What is drawn of a robot besides its nodes: springs and cables, from the robot file that a log carries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcrctl.elements.torus import point_weights
from tcrctl.log.geometry import CableHoles
from tcrctl.log.reader import Log
from tcrctl.log.run_files import RunFiles
from tcrctl.robot.description import cable_routes, spring_list
from tcrctl.robot.module import node_count, node_index, ring_nodes


@dataclass(frozen=True, slots=True)
class Structure:
    """Which nodes are joined; node rows as in the notation table (:mod:`tcrctl`).

    Attributes:
        springs: End nodes of every spring (n_springs, 2).
        natural_length: Their natural lengths (n_springs,) [m].
        cables: Holes of every cable, in the order of the drives.
        tip_ring: Module whose ring is the end.
    """

    springs: NDArray[np.int64]
    natural_length: NDArray[np.float64]
    cables: tuple[CableHoles, ...]
    tip_ring: int


def read_structure(log: Log, n_nodes: int) -> Structure | None:
    """Find what joins the nodes of a logged robot.

    Args:
        log: The log.
        n_nodes: Nodes of its shapes.

    Returns:
        None if the log carries no robot file, or one that this version does not understand or that is not that
        of its shapes: a picture without springs and cables is better than none.
    """
    robot = RunFiles(log).robot_if_known()
    if robot is None or node_count(robot.modules.count) != n_nodes:
        return None
    springs = spring_list(robot)
    ends = [[node_index(name) for name in spring.nodes] for spring in springs]
    return Structure(
        springs=np.array(ends, dtype=np.int64).reshape(-1, 2),
        natural_length=np.array([spring.natural_length for spring in springs]),
        cables=tuple(
            CableHoles(
                name=route.name,
                nodes=np.array([ring_nodes(ring) for ring, _ in route.holes]),
                weights=np.array([point_weights(angle) for _, angle in route.holes]),
            )
            for route in cable_routes(robot)
        ),
        tip_ring=robot.tip.ring,
    )

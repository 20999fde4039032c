"""Names of measured points: nodes (``m7.apex``), ring centres (``ring8``), the end (``end``)."""

from __future__ import annotations

import re

from tcrctl.robot.description import RobotDescription
from tcrctl.robot.module import LABELS, node_index, ring_nodes

_NODE = re.compile(rf"m([1-9][0-9]*)\.({'|'.join(LABELS)})")
_RING = re.compile(r"ring([1-9][0-9]*)")


def node_rows(name: str, robot: RobotDescription) -> tuple[int, int, int]:
    """Return the rows of the three nodes whose mean is the point; a single node stands there three times.

    Args:
        name: Name of the point.
        robot: The robot.

    Raises:
        ValueError: If the robot has no such point; the message says what it has.
    """
    count = robot.modules.count
    node, ring = _NODE.fullmatch(name), _RING.fullmatch(name)
    if node and int(node[1]) <= count:
        row = node_index(name)
        return row, row, row
    number = robot.tip.ring if name == "end" else int(ring[1]) if ring else 0
    if 1 <= number <= count:
        return ring_nodes(number)
    raise ValueError(
        f"{robot.name} has no point {name!r}; it has nodes m1.n1, m1.n2, m1.n3, m1.apex to m{count}.apex, "
        f"ring centres ring1 to ring{count}, and end, the centre of the tip ring"
    )

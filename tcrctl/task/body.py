"""The robot as something that can bump into things: rods and rings of all modules."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from tcrctl.robot.module import LABELS, RING, apexes, module_names, rings
from tcrctl.signals import Array

#: Sides of the polygon that stands for a ring. It is drawn around the circle, so that it never misses a contact and
#: lies outside by 0.4 % of the radius at most.
SIDES: Final = 36
_ANGLES: Final = 2.0 * math.pi * np.arange(SIDES) / SIDES
_OUTSIDE: Final = 1.0 / math.cos(math.pi / SIDES)


def segments(q: Array) -> tuple[Array, Array]:
    """Return the centre lines of rods and rings of every module, base included.

    Springs, cables and anything mounted at the end are left out.

    Args:
        q: Node positions (3 n_nodes,) [m].

    Returns:
        Where they begin and where they end, both (n_modules + 1) (3 + SIDES) rows (n, 3) [m]; see
        :func:`segment_name` for their order.
    """
    ring, apex = rings(q), apexes(q)[:, None]
    centre = ring.mean(axis=1, keepdims=True)
    first = ring[:, :1] - centre
    second = (ring[:, 1:2] - ring[:, 2:3]) / math.sqrt(3.0)
    turn = _ANGLES[None, :, None]
    corner = centre + _OUTSIDE * (np.cos(turn) * first + np.sin(turn) * second)
    start = np.concatenate((ring, corner), axis=1)
    end = np.concatenate((np.broadcast_to(apex, ring.shape), np.roll(corner, -1, axis=1)), axis=1)
    return start.reshape(-1, 3), end.reshape(-1, 3)


def segment_name(row: int) -> str:
    """Return the name of the part that a row of :func:`segments` belongs to."""
    module, part = divmod(row, RING + SIDES)
    name = module_names(module)[module]
    return f"rod {name}.{LABELS[part]}" if part < RING else f"ring {name}"

"""A log as one table: every number of a step in a column of its own, with its unit and meaning.

Names are the column names of :mod:`tcrctl.log.columns` with the component, where there is one, and the SI
unit at the end: ``t_s``, ``estimate_position_x_m``, ``applied_speed_c1_m_s``, ``truth_tension_c3_n``,
``measurement_nodes_m7_n1_z_m``; what has no unit at the end is a number without one. Two columns are made here:
``error_position_m`` and ``error_orientation_rad``, of the end of the simulated plant, on a rig of the estimate.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.analysis.end_error import angle, distance
from tcrctl.log.columns import COLUMNS, Column, meanings
from tcrctl.log.reader import Log

AXES: Final = ("x", "y", "z")
UNIT_SUFFIX: Final = {"m": "_m", "m/s": "_m_s", "N": "_n", "s": "_s", "rad": "_rad"}
PER_NODE: Final = ("q", "v", "disturbance", "nodes", "valid")
PER_CABLE: Final = ("drive", "speed", "tension", "predicted_tension", "saturated")
PER_AXIS: Final = ("position", "normal", "ahead_position", "ahead_normal")
#: Unit and meaning of the columns that are made here, by name.
ERRORS: Final = {
    "error_position": ("m", "Distance of the end from where it is wanted; of the plant if it is simulated."),
    "error_orientation": ("rad", "Angle of the end normal from the one wanted; of the plant if simulated."),
}


@dataclass(frozen=True, slots=True)
class Series:
    """One column of a table.

    Attributes:
        values: One per step (n,).
        unit: SI unit; empty or 1 if it has none.
        meaning: What it is, in words.
    """

    values: NDArray[Any]
    unit: str
    meaning: str


def table(log: Log, *, nodes: bool = False, ahead: bool = False) -> dict[str, Series]:
    """Return every number of every step by full name.

    Args:
        log: The log.
        nodes: Also every node's coordinates, velocities, forces and markers.
        ahead: Also what is wanted at the instants that a controller looks ahead to.

    Raises:
        LogError: If the log is damaged inside.
    """
    wanted = [name for name, column in COLUMNS.items() if _is_wanted(column, nodes, ahead)]
    columns, said = log.columns(wanted), meanings()
    made: dict[str, Series] = {}
    for name, values in columns.items():
        for label, unit, part in _parts(name, values, log):
            made[label + UNIT_SUFFIX.get(unit, "")] = Series(part, unit, said.get(name, ""))
    for name, values in errors(columns).items():
        unit, meaning = ERRORS[name]
        made[name + UNIT_SUFFIX[unit]] = Series(values, unit, meaning)
    return made


def errors(columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return both errors of the end (n,) by name, from columns of a log."""
    part = "truth" if "truth_position" in columns else "estimate"
    position, normal = columns[f"{part}_position"], columns[f"{part}_normal"]
    if not len(position):  # of no step the shape is not known either
        return {name: np.zeros(0) for name in ERRORS}
    found = distance(position, columns["reference_position"]), angle(normal, columns["reference_normal"])
    return dict(zip(ERRORS, found, strict=True))


def _is_wanted(column: Column, nodes: bool, ahead: bool) -> bool:
    """Tell whether a quantity has not so many numbers that a table is better off without."""
    raw = column.path.startswith("measurement.raw.") and (
        column.kind.endswith("[]") or column.field == "names"
    )
    if raw or column.field in PER_NODE:
        return nodes
    return ahead or not column.path.startswith("reference.ahead_")


def _parts(name: str, values: NDArray[Any], log: Log) -> Iterator[tuple[str, str, NDArray[Any]]]:
    """Split a quantity into its numbers: name, unit, values (n_steps,)."""
    unit = COLUMNS[name].unit
    if values.ndim == 1:
        yield name, unit, values
    elif not len(values):  # how many numbers a step would have is not known
        if values.shape[1:] == (3,):
            yield from ((f"{name}_{label}", unit, values.reshape(-1)) for label in AXES)
    else:
        numbers = values.reshape(len(values), -1) if values.size else values.reshape(len(values), 0)
        for i, label in enumerate(_labels(COLUMNS[name], values.shape[1:], log)):
            yield f"{name}_{label}", _unit_of_part(unit, i), numbers[:, i]


def _unit_of_part(unit: str, index: int) -> str:
    """Return the unit of a component: ``m, 1`` is a position and then a direction."""
    first, _, second = unit.partition(", ")
    return second if second and index >= len(AXES) else first


def _labels(column: Column, shape: tuple[int, ...], log: Log) -> list[str]:
    """Return the name of every component, in memory order; numbers where the log knows no names."""
    count = int(np.prod(shape))
    if column.field in PER_CABLE:
        labels = list(log.cable_names)
    elif column.field == "valid":
        labels = list(log.marker_names)
    elif column.field == "nodes":
        labels = _by_axis(log.marker_names)
    elif column.field in PER_NODE:
        labels = _by_axis(log.node_names)
    elif column.field in PER_AXIS:
        labels = list(AXES) if len(shape) == 1 else _by_axis(str(i) for i in range(shape[0]))
    else:
        labels = []
    names = labels if len(labels) == count else [str(i) for i in range(count)]
    return [name.replace(".", "_") for name in names]


def _by_axis(names: Iterable[str]) -> list[str]:
    return [f"{name}_{axis}" for name in names for axis in AXES]

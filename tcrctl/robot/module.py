"""The module of the robot, a cone: three nodes on a ring, an apex, and three rods between them.

All that follows from it is here: its section of a robot file, how nodes are numbered and named, what is rigid,
where the mass is. Everybody else asks for rings, apexes and rows. Kernels know the two sizes, ``NODES`` and
``SIZE``, and that the fixed base, module 0, comes first. Another kind of module, a disc on a backbone for
instance, begins as another file like this one.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Literal, TypeVar

from pydantic import Field

from tcrctl.config.settings import Settings, Vector, quantity

if TYPE_CHECKING:  # numpy is imported where arrays are made: checking a robot file needs none
    import numpy as np
    from numpy.typing import NDArray

    from tcrctl.signals import Array

LABELS: Final = ("n1", "n2", "n3", "apex")
#: Nodes of one module: first those of its ring, counter-clockwise seen from +z, then the apex.
NODES: Final = 4
RING: Final = 3
APEX: Final = 3
#: Coordinates of one module: size of the blocks of mass and tangent.
SIZE: Final = 3 * NODES
#: Nodes of the fixed base; their rows come first.
FIXED: Final = NODES
#: Rods and ring sides per module; they come first among the bars.
RIGID_BARS: Final = 6

_Rows = TypeVar("_Rows", int, "NDArray[np.int64]")


class ModuleDifference(Settings):
    """A module that is not like the others; what is left out is as in ``modules``."""

    module: int = Field(description="number of the module, 1 is the first below the base", ge=1)
    pitch_mm: float | None = quantity("mm", "distance of its ring plane from the one above", None, gt=0)
    ring_diameter_mm: float | None = quantity("mm", "diameter of the ring", None, gt=0)
    cone_height_mm: float | None = quantity("mm", "ring plane to apex", None, gt=0)
    rod_diameter_mm: float | None = quantity("mm", "diameter of rods and ring sides", None, gt=0)
    youngs_modulus_mpa: float | None = quantity("MPa", "Young's modulus of rods and ring sides", None, gt=0)
    mass_g: float | None = quantity("g", "mass", None, gt=0)
    ring_mass_fraction: float | None = quantity("1", "part of the mass on the ring", None, ge=0, lt=1)
    damping_n_s_m: float | None = quantity("N s/m", "axial damping of rods and ring sides", None, ge=0)
    offsets_mm: dict[Literal["n1", "n2", "n3", "apex"], Vector] = quantity(
        "mm", "where its nodes are in the straight robot, beside the place of an ideal module", {}
    )


class ModuleSettings(Settings):
    """The modules: a ring and an apex joined by three rods; the fixed base is one more."""

    count: int = Field(description="number of moving modules", ge=1, le=200)
    pitch_mm: float = quantity("mm", "distance between neighbouring ring planes", gt=0)
    ring_diameter_mm: float = quantity("mm", "diameter of the ring through its three nodes", gt=0)
    cone_height_mm: float = quantity("mm", "ring plane to apex", gt=0)
    rod_diameter_mm: float = quantity("mm", "diameter of rods and ring sides", gt=0)
    youngs_modulus_mpa: float = quantity("MPa", "Young's modulus of rods and ring sides", gt=0)
    mass_g: float = quantity("g", "mass of one module", gt=0)
    ring_mass_fraction: float = quantity(
        "1", "part of the mass on the ring; the rest is on the rods", 0.5, ge=0, lt=1
    )
    damping_n_s_m: float = quantity("N s/m", "axial damping of rods and ring sides", 0.0, ge=0)
    each: tuple[ModuleDifference, ...] = Field(default=(), description="modules that are not like the others")

    def of(self, module: int) -> ModuleSettings:
        """Return the settings of one module, 0 for the base."""
        own = next((entry for entry in self.each if entry.module == module), None)
        if own is None:
            return self
        return self.model_copy(update=own.model_dump(exclude_none=True, exclude={"module", "offsets_mm"}))

    def offsets(self) -> dict[tuple[int, str], Vector]:
        """Return the offset of every node that has one, by module and label [mm]."""
        return {(e.module, label): offset for e in self.each for label, offset in e.offsets_mm.items()}


def node_count(n_modules: int) -> int:
    """Return the number of nodes of a robot, base included."""
    return NODES * (n_modules + 1)


def module_count(n_nodes: int) -> int:
    """Return the number of free modules of a robot with so many nodes."""
    return n_nodes // NODES - 1


def module_of(rows: _Rows) -> _Rows:
    """Return the module that node rows belong to; 0 is the base."""
    return rows // NODES


def ring_nodes(module: int) -> tuple[int, int, int]:
    """Return the rows of the three ring nodes of a module."""
    first = NODES * module
    return first, first + 1, first + 2


def ring_rows(n_modules: int) -> list[int]:
    """Return the rows of all ring nodes of the free modules, in order."""
    return [row for module in range(1, n_modules + 1) for row in ring_nodes(module)]


def apex_row(module: int) -> int:
    """Return the row of the apex of a module."""
    return NODES * module + APEX


def rings(nodes: Array) -> Array:
    """Return the ring nodes of all modules (n_modules + 1, 3, 3) out of all nodes (n_nodes, 3)."""
    return nodes.reshape(-1, NODES, 3)[:, :RING]


def apexes(nodes: Array) -> Array:
    """Return the apexes of all modules (n_modules + 1, 3) out of all nodes (n_nodes, 3)."""
    return nodes.reshape(-1, NODES, 3)[:, APEX]


def module_names(n_modules: int) -> tuple[str, ...]:
    """Return ``base, m1, m2, ...``."""
    return ("base", *(f"m{i}" for i in range(1, n_modules + 1)))


def node_names(n_modules: int) -> tuple[str, ...]:
    """Return ``base.n1, base.n2, ..., m1.apex, ...`` in row order."""
    return tuple(f"{name}.{label}" for name in module_names(n_modules) for label in LABELS)


def node_index(name: str) -> int:
    """Return the row of a node named ``base.n1`` .. ``m7.apex``."""
    module, _, label = name.partition(".")
    return NODES * (0 if module == "base" else int(module[1:])) + LABELS.index(label)


def is_ring_node(name: str) -> bool:
    """Return whether a node of that name is on a ring."""
    return name.partition(".")[2] in LABELS[:RING]


def rods(module: int) -> list[tuple[int, int]]:
    """Return the rods of a module as pairs of node rows, ring node and apex."""
    return [(node, apex_row(module)) for node in ring_nodes(module)]


def rigid_bars(module: int) -> list[tuple[int, int]]:
    """Return rods and ring sides of a module, RIGID_BARS pairs of node rows."""
    from tcrctl.elements import torus

    return rods(module) + torus.sides(ring_nodes(module))


def straight_stack(modules: ModuleSettings) -> Array:
    """Return the node positions of the straight, undeformed stack (n_nodes, 3) [m].

    Args:
        modules: Section of the robot file.
    """
    import numpy as np

    from tcrctl.elements import torus

    nodes = np.zeros((node_count(modules.count), 3))
    offsets = modules.offsets()
    for module in range(modules.count + 1):
        own = modules.of(module)
        radius, height = own.ring_diameter_mm / 2000.0, 0.0 - _depth(modules, module)
        for k, row in enumerate(ring_nodes(module)):
            angle = k * torus.TURN_THIRD
            nodes[row] = [radius * math.cos(angle), radius * math.sin(angle), height]
        nodes[apex_row(module)] = [0.0, 0.0, height - own.cone_height_mm / 1000.0]
    for (module, label), offset in offsets.items():
        nodes[NODES * module + LABELS.index(label)] += np.array(offset) / 1000.0
    return nodes


def _depth(modules: ModuleSettings, module: int) -> float:
    """Return the distance of a ring plane of the straight stack below the base [m]."""
    pitch = modules.pitch_mm / 1000.0
    return module * pitch + math.fsum(modules.of(i).pitch_mm / 1000.0 - pitch for i in range(1, module + 1))


def mass_block(modules: ModuleSettings) -> Array:
    """Return the masses of one module by node pairs (NODES, NODES) [kg]: ring by (4), rods consistent.

    Args:
        modules: Section of the robot file, as it is for that module.
    """
    import numpy as np

    from tcrctl.elements import torus

    cell = modules.mass_g / 1000.0
    block = np.zeros((NODES, NODES))
    for k in range(RING):
        block[k, k] += torus.node_mass(cell * modules.ring_mass_fraction)
        rod = cell * (1.0 - modules.ring_mass_fraction) / 3.0
        for i, j in ((k, k), (APEX, APEX)):
            block[i, j] += rod / 3.0
        block[k, APEX] += rod / 6.0
        block[APEX, k] += rod / 6.0
    return block

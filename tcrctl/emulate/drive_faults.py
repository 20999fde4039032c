"""Which faults the emulated drives of a robot have: those of a PLC, or fewer of motors on a bus."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tcr_hardware.emulators import plc_faults
from tcrctl.config.keys import Finding
from tcrctl.emulate import winch_faults
from tcrctl.plant.rig.settings import Dynamixel

if TYPE_CHECKING:
    from tcrctl.plant.rig.settings import RigFile

_OF_A_PLC = {name: frozenset(kind.arguments) for name, kind in plc_faults.FAULTS.items()}
_OF_MOTORS = {name: frozenset(kind.arguments) for name, kind in winch_faults.FAULTS.items()}
#: Every fault that some drives have, and every argument that it takes on some.
ARGUMENTS: Mapping[str, frozenset[str]] = {
    name: _OF_A_PLC.get(name, frozenset()) | _OF_MOTORS.get(name, frozenset())
    for name in (*_OF_A_PLC, *(name for name in _OF_MOTORS if name not in _OF_A_PLC))
}


@dataclass(frozen=True, slots=True)
class Drives:
    """What can go wrong with the drives of a robot.

    Attributes:
        faults: Names of faults, and the arguments that each takes.
        axes: Numbers of the axes that there are.
    """

    faults: Mapping[str, Collection[str]]
    axes: tuple[int, ...]

    def wrong(self, fault: str, given: Mapping[str, float]) -> Iterator[Finding]:
        """Yield what these drives cannot do of a fault, and where a script says it."""
        taken = self.faults.get(fault)
        if taken is None:
            yield ("plc",), f"have no fault {fault}; they have {', '.join(self.faults)}"
            return
        for name, value in given.items():
            if name not in taken:
                known = ", ".join(sorted(taken)) or "no arguments"
                yield ("with", name), f"have a fault {fault} that takes {known}"
            elif name == "axis" and value not in self.axes:
                yield ("with", name), f"have no axis {value:g}; they have {', '.join(map(str, self.axes))}"


def drives_of(file: RigFile) -> dict[str, Drives]:
    """Return what can go wrong with the drives of every robot of a rig file."""
    return {
        name: Drives(
            _OF_MOTORS if isinstance(robot.plc, Dynamixel) else _OF_A_PLC,
            tuple(sorted(cable.axis for cable in robot.cables.values())),
        )
        for name, robot in file.robots.items()
    }

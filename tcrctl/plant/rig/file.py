"""Rig files: found, read, and held against the robot that is to hang there."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tcr_hardware.modbus.wire_time import WATCHDOG_PERIODS
from tcrctl.config import shipped, strict_yaml
from tcrctl.config.keys import Finding, Keys
from tcrctl.config.strict_yaml import Document
from tcrctl.errors import InputError, TcrctlError
from tcrctl.log.file_names import PLUGINS, RIG
from tcrctl.plant.rig.plugged import device_origins, with_devices
from tcrctl.plant.rig.settings import MountedRobot, RigFile
from tcrctl.plugins.faults import told
from tcrctl.plugins.origin import Origin
from tcrctl.plugins.trust import Trust
from tcrctl.robot.description import RobotDescription, cable_routes
from tcrctl.robot.module import is_ring_node, module_of, node_index


@dataclass(frozen=True, slots=True)
class LoadedRig:
    """A bench and one of the robots on it.

    Attributes:
        rig: The bench.
        robot: Name of the robot.
        path: The rig file.
        given: Its contents as they are on disk.
    """

    rig: RigFile
    robot: str
    path: Path
    given: bytes

    @property
    def mounted(self) -> MountedRobot:
        """What the file says about the robot."""
        return self.rig.robots[self.robot]

    @property
    def origins(self) -> tuple[Origin, ...]:
        """Where its cameras and drives come from, as far as they are not built in."""
        return device_origins(self.rig, self.robot)


def read_rig(name_or_path: str, folder: Path | None = None) -> tuple[RigFile, Path, bytes, Document]:
    """Read a rig file.

    Args:
        name_or_path: Shipped name, or path of a YAML file.
        folder: Where a relative path starts.

    Raises:
        UnknownNameError: If there is no shipped rig of that name.
        SpecError: If the file has problems; all are listed.
        InputError: If there is no such file.
    """
    path = shipped.find_rig(name_or_path, folder)
    given = strict_yaml.read(path)
    document = strict_yaml.loads(given, str(path))
    model = with_devices(document, _trust_of(path))
    return _validated(document, model), path, given, document


def _trust_of(path: Path) -> Trust:
    """Return where the files of kinds are: in the folder of a run beside the rig file, all of them."""
    return Trust(path.parent, by_name=path.name == RIG and (path.parent / PLUGINS).is_file())


def _validated(document: Document, model: type[RigFile]) -> RigFile:
    try:
        return strict_yaml.validate(document, model)
    except TcrctlError:
        raise
    except Exception as error:  # a validator from elsewhere raised what none may
        raise InputError(f"{document.name}: its settings could not be checked: {told(error, '')}") from error


def load_rig(name_or_path: str, robot: RobotDescription, folder: Path | None = None) -> LoadedRig:
    """Read a rig file for a robot.

    Args:
        name_or_path: Shipped name, or path of a YAML file.
        robot: The robot that hangs there.
        folder: Where a relative path starts.

    Raises:
        SpecError: If the file has problems, or does not fit the robot.
        InputError: If there is no such file, or the robot does not hang there.
    """
    rig, path, given, document = read_rig(name_or_path, folder)
    if robot.name not in rig.robots:
        there = ", ".join(rig.robots)
        raise InputError(f"{path}: robot {robot.name} does not hang on rig {rig.name}; there hang: {there}")
    document.refuse(_misfits(rig.robots[robot.name], robot))
    return LoadedRig(rig, robot.name, path, given)


def period_misfits(loaded: LoadedRig, period: float) -> Iterator[str]:
    """Yield why a rig cannot be run with a control period [s], as far as its file tells.

    Ticks must come often enough to notice in time that the cameras have stopped, and to feed the PLC's watchdog
    even if some of them are late. What the PLC itself says is looked at when it is connected.
    """
    period_ms, stale = 1e3 * period, loaded.rig.safety.stale_stop_ms
    watchdog = getattr(
        loaded.mounted.plc, "watchdog_ms", math.inf
    )  # drives of one's own tell it when connected
    if period_ms > stale:
        yield f"is {period:g} s, longer than safety.stale_stop_ms of {loaded.path}, {stale:g} ms"
    if WATCHDOG_PERIODS * period_ms > watchdog:
        longest = 1e-3 * watchdog / WATCHDOG_PERIODS
        yield (
            f"is {period:g} s; the watchdog of the drives has to be at least {WATCHDOG_PERIODS} periods, and "
            f"plc.watchdog_ms of {loaded.path} is {watchdog:g} ms: at most {longest:.3g} s"
        )


def _misfits(mounted: MountedRobot, robot: RobotDescription) -> Iterator[Finding]:
    at: Keys = ("robots", robot.name)
    names = [route.name for route in cable_routes(robot)]
    low, high = robot.stroke_mm
    for name in names:
        if name not in mounted.cables:
            yield (*at, "cables"), f"cable {name} of {robot.name} has no drive"
    for name, drive in mounted.cables.items():
        if name not in names:
            yield (*at, "cables", name), f"{robot.name} has no cable {name}; it has {', '.join(names)}"
        for key, value in (("min_mm", drive.min_mm), ("max_mm", drive.max_mm)):
            if not low <= value <= high:
                limit = f"stroke_mm of {robot.name}, {low:g} to {high:g}"
                yield (*at, "cables", name, key), f"must be within {limit}, not {value:g}"
    yield from _marker_misfits(mounted, robot.modules.count, (*at, "markers"))


def _marker_misfits(mounted: MountedRobot, count: int, at: Keys) -> Iterator[Finding]:
    rings = mounted.markers.rings
    for i, ring in enumerate(() if rings == "all" else rings):
        if ring > count:
            yield (*at, "rings", i), f"there is no ring {ring}; there are rings 1 to {count}"
    for i, marker in enumerate(mounted.markers.nodes):
        if not is_ring_node(marker.node) or not 1 <= module_of(node_index(marker.node)) <= count:
            yield (*at, "nodes", i, "node"), f"must be a ring node m1.n1 .. m{count}.n3, not {marker.node}"

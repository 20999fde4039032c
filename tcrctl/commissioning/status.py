"""``tcrctl rig status``: where the drives are and what they say now; only reads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tcrctl.errors import DeviceError, InputError, with_hint
from tcrctl.plant.rig.assembly import connect_cameras, connect_drives
from tcrctl.plant.rig.devices import DriveStatus
from tcrctl.plant.rig.file import LoadedRig
from tcrctl.plant.rig.mounting import NO_MARKERS

FIRST_FRAME_S = 0.5


@dataclass(frozen=True, slots=True)
class RigStatus:
    """What one robot's devices say.

    Attributes:
        robot: Name of the robot.
        drives: Status of the drives; None if they do not answer.
        position_mm: Positions by cable [mm].
        cameras: What the cameras say, or why they do not.
        trouble: What went wrong; empty if nothing did.
        exit_code: 0, or that of the trouble.
    """

    robot: str
    drives: DriveStatus | None
    position_mm: dict[str, float]
    cameras: dict[str, Any]
    trouble: str
    exit_code: int

    def as_json(self) -> dict[str, Any]:
        """Return the status as an object."""
        bits: dict[str, Any] = {}
        if self.drives is not None:
            names = (
                "enabled",
                "zeroed",
                "stopping",
                "estop",
                "watchdog",
                "fault",
                "following_error",
                "remote",
                "slack",
            )
            bits = {name: getattr(self.drives, name) for name in names}
        return {
            "robot": self.robot,
            "drives": {**bits, "position_mm": self.position_mm} if bits else None,
            "cameras": self.cameras,
            "trouble": self.trouble,
        }


def rig_status(loaded: LoadedRig, names: tuple[str, ...]) -> RigStatus:
    """Read drives and cameras once.

    Args:
        loaded: The rig file.
        names: Cables in the order of the drives.
    """
    cameras, camera_error, code = _cameras(loaded)
    try:
        drives = connect_drives(loaded, names)
    except (DeviceError, InputError) as error:
        return RigStatus(loaded.robot, None, {}, cameras, with_hint(error), error.exit_code)
    try:
        status = drives.status()
    except DeviceError as error:
        return RigStatus(loaded.robot, None, {}, cameras, with_hint(error), error.exit_code)
    finally:
        drives.close()
    positions = {name: int(um) / 1e3 for name, um in zip(names, status.position, strict=True)}
    return RigStatus(loaded.robot, status, positions, cameras, camera_error, code)


def _cameras(loaded: LoadedRig) -> tuple[dict[str, Any], str, int]:
    """Return what the cameras say, what went wrong, and its exit code."""
    try:
        cameras = connect_cameras(loaded, NO_MARKERS)
    except (DeviceError, InputError) as error:
        return {}, with_hint(error), error.exit_code
    try:
        seen = cameras.next(FIRST_FRAME_S, fresh=False)
        told = {
            **cameras.identity.details,
            "frame": None if seen is None else seen.raw.number,
            "markers": None if seen is None else cameras.status().markers,
        }
    except DeviceError as error:
        return {}, with_hint(error), error.exit_code
    finally:
        cameras.close()
    return (told, "", 0) if seen else (told, "the cameras send no frames", DeviceError.exit_code)

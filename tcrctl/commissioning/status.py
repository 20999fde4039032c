"""``tcrctl rig status``: where the drives are and what they say now; only reads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tcrctl.errors import DeviceError, InputError
from tcrctl.plant.rig.assembly import connect_drives
from tcrctl.plant.rig.devices import DriveStatus
from tcrctl.plant.rig.file import LoadedRig
from tcrctl.plant.rig.natnet_cameras import connect

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
    cameras, camera_error = _cameras(loaded)
    try:
        drives = connect_drives(loaded, names)
    except (DeviceError, InputError) as error:
        return RigStatus(loaded.robot, None, {}, cameras, str(error), error.exit_code)
    try:
        status = drives.status()
    except DeviceError as error:
        return RigStatus(loaded.robot, None, {}, cameras, str(error), error.exit_code)
    finally:
        drives.close()
    positions = {name: int(um) / 1e3 for name, um in zip(names, status.position, strict=True)}
    code = DeviceError.exit_code if camera_error else 0
    return RigStatus(loaded.robot, status, positions, cameras, camera_error, code)


def _cameras(loaded: LoadedRig) -> tuple[dict[str, Any], str]:
    try:
        client = connect(loaded.rig.cameras)
    except DeviceError as error:
        return {}, str(error)
    try:
        frame, server = client.wait_next(None, FIRST_FRAME_S), client.server
        return {
            "server": "" if server is None else server.application,
            "natnet": str(client.version),
            "frame": None if frame is None else frame.number,
            "markers": None if frame is None else len(frame.data.markers),
        }, "" if frame is not None else "the cameras send no frames"
    finally:
        client.close()

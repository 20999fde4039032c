"""A rig file becomes a plant: cameras and drives are connected, and held against what the file says."""

from __future__ import annotations

import numpy as np

from tcrctl.errors import InputError
from tcrctl.plant.rig.devices import Cameras, Drives
from tcrctl.plant.rig.file import LoadedRig, period_misfits
from tcrctl.plant.rig.health import Rules
from tcrctl.plant.rig.mounting import CableAxis, Mounting, cable_axes, mounting
from tcrctl.plant.rig.operation import Operation
from tcrctl.plant.rig.own_cameras import OwnCameras
from tcrctl.plant.rig.own_drives import OwnDrives
from tcrctl.plant.rig.own_limits import check_drives
from tcrctl.plant.rig.plant import RigLimits, RigPlant
from tcrctl.plant.rig.set_points import AntagonistGroup, DriveEnvelope
from tcrctl.plant.rig.settings import Dynamixel, MountedRobot, SafetyRules
from tcrctl.plugins.plugin import plugin_of
from tcrctl.robot.module import ring_rows
from tcrctl.robot.robot import Robot


def envelope(mounted: MountedRobot, rules: SafetyRules, names: tuple[str, ...]) -> DriveEnvelope:
    """Return the limits of the set-points.

    Args:
        mounted: Section of the rig file.
        rules: Safety section.
        names: Cables in the order of the drives.
    """
    cables = [mounted.cables[name] for name in names]
    acceleration = rules.acceleration_limit_mm_s2
    return DriveEnvelope(
        names=names,
        low=np.array([round(1e3 * cable.min_mm) for cable in cables]),
        high=np.array([round(1e3 * cable.max_mm) for cable in cables]),
        change=np.full(len(cables), int(1e3 * rules.max_step_mm)),
        speed=np.array([1e3 * cable.speed_limit_mm_s for cable in cables]),
        acceleration=np.full(len(cables), np.inf if acceleration is None else 1e3 * acceleration),
        groups=tuple(
            AntagonistGroup(
                tuple(names.index(name) for name in group.cables),
                round(1e3 * group.min_sum_mm),
                round(1e3 * group.max_sum_mm),
            )
            for group in mounted.antagonists
        ),
    )


def supervisor_rules(rules: SafetyRules) -> Rules:
    """Return the safety section in seconds and micrometres."""
    return Rules(
        stale=rules.stale_after_ms / 1e3,
        stale_stop=rules.stale_stop_ms / 1e3,
        silence=rules.silence_stop_ms / 1e3,
        rejects=rules.max_rejects,
        following=round(1e3 * rules.following_mm),
        standstill=rules.standstill_s,
    )


def connect_cameras(loaded: LoadedRig, wanted: Mounting) -> Cameras:
    """Connect to the cameras of a rig.

    Args:
        loaded: The rig file.
        wanted: Markers to look for.

    Raises:
        DeviceError: If they do not answer.
        InputError: If they do not know the markers that the rig file names, or are a plug-in that cannot be built.
    """
    settings = loaded.rig.cameras
    plugin = plugin_of(settings)
    if plugin is not None:
        return OwnCameras(settings, plugin, wanted)
    from tcrctl.plant.rig.natnet_cameras import NatNetCameras

    return NatNetCameras(settings, wanted)


def connect_drives(loaded: LoadedRig, names: tuple[str, ...]) -> Drives:
    """Connect to the drives of a rig; nothing is written.

    Args:
        loaded: The rig file.
        names: Cables in the order of the drives.

    Raises:
        DeviceError: If they do not answer.
        InputError: If they are not what the rig file says, or are a plug-in that cannot be built.
    """
    settings, cables = loaded.mounted.plc, cable_axes(loaded.mounted, names)
    plugin = plugin_of(settings)
    if plugin is not None:
        return OwnDrives(settings, plugin, cables)
    if isinstance(settings, Dynamixel):
        return _dynamixel(settings, cables)
    from tcrctl.plant.rig.modbus_drives import ModbusDrives

    return ModbusDrives(settings, cables)


def _dynamixel(settings: Dynamixel, cables: tuple[CableAxis, ...]) -> Drives:
    try:
        from tcrctl.plant.rig.dynamixel_drives import DynamixelDrives
    except ModuleNotFoundError as error:
        if error.name != "dynamixel_sdk":
            raise
        hint = "Install it: pip install 'tcrctl[dynamixel]'."
        raise InputError("plc.kind: dynamixel needs the package dynamixel-sdk", hint=hint) from error
    return DynamixelDrives(settings, cables)


def build_rig(loaded: LoadedRig, robot: Robot, period: float, operation: Operation) -> RigPlant:
    """Connect to a rig; nothing moves before it is started.

    Args:
        loaded: The rig file.
        robot: The robot that hangs there.
        period: Control period [s].
        operation: The run.

    Raises:
        DeviceError: If cameras or drives do not answer.
        InputError: If they are not what the rig file says, or the period is impossible.
        ArmingRefusedError: If the drives have no watchdog.
    """
    rules = loaded.rig.safety
    for text in period_misfits(loaded, period):
        raise InputError(f"controller.period_s {text}")
    wanted, names = mounting(loaded.mounted, robot), robot.cable_names
    cameras = connect_cameras(loaded, wanted)
    try:
        drives = connect_drives(loaded, names)
        try:
            check_drives(drives, cable_axes(loaded.mounted, names), rules, period)
        except BaseException:
            drives.close()
            raise
    except BaseException:
        cameras.close()
        raise
    limits = RigLimits(
        envelope=envelope(loaded.mounted, rules, names),
        rules=supervisor_rules(rules),
        min_seen=rules.min_seen_fraction,
        mapped=len(wanted.markers),
        nodes=len(ring_rows(robot.n_modules)),
        arm_timeout=rules.arm_timeout_s,
    )
    return RigPlant(cameras, drives, limits, period, operation)

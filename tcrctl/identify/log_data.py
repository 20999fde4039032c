"""Logged runs as data: what the drives did, and where the cameras saw the markers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcrctl.errors import InputError
from tcrctl.identify.loading import LogSource
from tcrctl.identify.points import node_rows
from tcrctl.log.file_names import ROBOT
from tcrctl.log.reader import Log, read_log
from tcrctl.log.run_files import RunFiles
from tcrctl.robot.description import RobotDescription, cable_routes
from tcrctl.robot.module import module_count
from tcrctl.robot.robot import build_robot
from tcrctl.signals import Array

_COLUMNS = ("t", "period", "measurement_t", "measurement_nodes", "measurement_valid", "measurement_drive")


@dataclass(frozen=True, slots=True)
class Recording:
    """One logged run, SI units.

    Attributes:
        name: Name in reports.
        time: Instants at which the drives were read (n,) [s].
        drive: Drive lengths then (n, m) [m]; in between they moved at constant speed.
        points: Names of the markers (k,).
        rows: Node rows whose mean each marker is (k, 3).
        frame_time: Instants of the camera frames that are compared (f,) [s].
        frames: Marker positions (f, k, 3) [m]; NaN where a marker was not seen.
        rest_length: Rest lengths of the cables (m,) [m] that the simulated plant kept; None on a rig.
    """

    name: str
    time: Array
    drive: Array
    points: tuple[str, ...]
    rows: Array
    frame_time: Array
    frames: Array
    rest_length: Array | None


def read_recording(source: LogSource, robot: RobotDescription) -> Recording:
    """Read a log and hold it against a robot.

    Args:
        source: Which log, and which part of it.
        robot: The robot that ran.

    Raises:
        InputError: If it is no log, a log of another robot, or has nothing to compare.
        LogError: If it is damaged.
    """
    log = read_log(source.path)
    columns = log.columns(_COLUMNS)
    if len(columns["t"]) < 2:
        raise InputError(f"{source.path}: has {len(columns['t'])} steps; nothing moves in it")
    _check_robot(log, robot)
    settings = source.settings
    stop = np.inf if settings.stop_s is None else settings.stop_s
    seen = columns["measurement_valid"].any(axis=1)
    within = (columns["t"] >= settings.start_s) & (columns["t"] <= stop)
    chosen = np.flatnonzero(seen & within & (columns["measurement_t"] >= columns["t"][0]))
    if not len(chosen):
        raise InputError(f"{source.path}: no marker is seen from {settings.start_s:g} to {stop:g} s")
    chosen = chosen[np.unique(np.linspace(0, len(chosen) - 1, settings.frames).round().astype(int))]
    frames = columns["measurement_nodes"][chosen].astype(float)
    frames[~columns["measurement_valid"][chosen]] = np.nan
    last = int(chosen[-1]) + 1
    return Recording(
        name=source.path.parent.name if source.path.stem == "log" else source.path.stem,
        time=columns["t"][:last],
        drive=columns["measurement_drive"][:last],
        points=log.marker_names,
        rows=np.array([node_rows(name, robot) for name in log.marker_names]),
        frame_time=columns["measurement_t"][chosen],
        frames=frames,
        rest_length=_kept_lengths(log),
    )


def _check_robot(log: Log, robot: RobotDescription) -> None:
    cables = tuple(route.name for route in cable_routes(robot))
    modules = module_count(len(log.node_names))
    ran = log.start.get("robot", "unknown")
    for what, found, wanted in (
        ("modules", modules, robot.modules.count),
        ("cables", log.cable_names, cables),
    ):
        if found != wanted:
            raise InputError(
                f"{log.path}: is a log of another robot, {ran}: it has {what} {_shown(found)}, "
                f"{robot.name} has {_shown(wanted)}"
            )


def _shown(value: object) -> str:
    return ", ".join(value) if isinstance(value, tuple) else str(value)


def _kept_lengths(log: Log) -> Array | None:
    """Rest lengths of the robot in the log if its plant was simulated."""
    files = RunFiles(log)
    if log.start.get("plant") != "simulated" or ROBOT not in files:
        return None
    rest: Array = build_robot(files.robot()).model.cables[:, 0].copy()
    return rest

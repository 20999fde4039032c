"""``tcrctl rig calibrate``: where the cameras' frame lies in the robot's, from the markers on the base ring."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from tcr_hardware.calibration import CalibrationResult, average, calibrate
from tcr_hardware.errors import HardwareError
from tcrctl.config import strict_yaml
from tcrctl.config.yaml_core import compose
from tcrctl.errors import DeviceError, InputError
from tcrctl.plant.rig.assembly import connect_cameras
from tcrctl.plant.rig.devices import Cameras
from tcrctl.plant.rig.file import LoadedRig
from tcrctl.plant.rig.mounting import BASE_NODES, base_mounting
from tcrctl.plant.rig.settings import MarkerSettings, RigFile
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array


def calibrate_rig(loaded: LoadedRig, robot: Robot, *, seconds: float, free: bool) -> CalibrationResult:
    """Measure the base ring and find the transform.

    Args:
        loaded: The rig file; names the labels of the base ring and the vertical axis.
        robot: The robot that hangs there.
        seconds: How long to measure [s].
        free: Fit the vertical too, instead of trusting that of the cameras.

    Raises:
        DeviceError: If the cameras do not answer or do not see the ring.
        InputError: If what they see does not fit the robot.
    """
    cameras = connect_cameras(loaded, base_mounting(loaded.mounted.markers))
    try:
        measured = _measured(cameras, loaded.mounted.markers, seconds)
    finally:
        cameras.close()
    known = robot.rest.q.reshape(-1, 3)[: len(BASE_NODES)]
    try:
        return calibrate(
            measured,
            known,
            up_axis=loaded.rig.cameras.up_axis,
            scale_m=loaded.mounted.calibration.scale_m,
            level=not free,
        )
    except HardwareError as error:
        raise InputError(str(error), hint=error.hint) from error


def _measured(cameras: Cameras, markers: MarkerSettings, seconds: float) -> Array:
    """Return the mean positions of the base ring's markers in the cameras' frame (3, 3)."""
    positions = []
    valid = []
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        seen = cameras.next(left, fresh=True)
        if seen is None:
            break
        positions.append(seen.nodes.astype(float))
        valid.append(seen.valid)
    if not positions:
        raise DeviceError("the cameras send no frames")
    mean = average(np.array(positions), np.array(valid))
    if not mean.seen.all():
        labels = [markers.base.format(node=node) for node in (1, 2, 3)]
        unseen = ", ".join(label for label, seen in zip(labels, mean.seen, strict=True) if not seen)
        raise DeviceError(f"markers never seen: {unseen}")
    return mean.mean


def calibration_text(found: CalibrationResult) -> str:
    """Write the section ``calibration`` of a rig file, in one line."""
    numbers: dict[str, Any] = found.transform.as_dict()
    rounded = {
        "quaternion_xyzw": [round(x, 9) for x in numbers["quaternion_xyzw"]],
        "translation_m": [round(x, 6) for x in numbers["translation_m"]],
        "scale_m": numbers["scale_m"],
    }
    return "{" + ", ".join(f"{key}: {value}" for key, value in rounded.items()) + "}"


def with_calibration(text: str, robot: str, section: str, model: type[RigFile] = RigFile) -> str:
    """Return a rig file with the calibration of one robot replaced, everything else kept as it is.

    Args:
        text: The file.
        robot: Name of the robot in it.
        section: What :func:`calibration_text` made.
        model: Of the rig file, with the kinds that it names.

    Raises:
        InputError: If the place cannot be found.
    """
    node: Any = compose(text, "rig file")
    for key in ("robots", robot):
        node = next((value for name, value in node.value if name.value == key), None)
        if node is None:
            raise InputError(f"the rig file has no robot {robot}")
    old = next((value for name, value in node.value if name.value == "calibration"), None)
    if old is None:
        start = node.start_mark
        put = (
            f", calibration: {section}"
            if node.flow_style
            else f"calibration: {section}\n{' ' * start.column}"
        )
        at = node.end_mark.index - 1 if node.flow_style else start.index
        made = text[:at] + put + text[at:]
    elif old.flow_style:
        made = text[: old.start_mark.index] + section + text[old.end_mark.index :]
    else:
        end = old.end_mark
        made = text[: old.start_mark.index] + section + "\n" + text[end.index - end.column :]
    strict_yaml.validate(strict_yaml.loads(made, "calibrated rig file"), model)
    return made


def write_calibrated(loaded: LoadedRig, section: str, out: Path | None) -> Path:
    """Write the rig file with a new calibration.

    Args:
        loaded: The rig file.
        section: What :func:`calibration_text` made.
        out: Where; None for the file itself.

    Returns:
        The file that was written.

    Raises:
        DeviceError: If it cannot be written.
    """
    target = out or loaded.path
    made = with_calibration(loaded.given.decode("utf-8-sig"), loaded.robot, section, type(loaded.rig))
    try:
        target.write_text(made, encoding="utf-8")
    except OSError as error:
        raise DeviceError(f"{target}: cannot be written: {error.strerror}") from error
    return target

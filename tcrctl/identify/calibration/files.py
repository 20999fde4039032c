"""The folder of results: robot file and calibration file for the next run, and a report."""

from __future__ import annotations

import datetime
import json
import math
from pathlib import Path
from typing import Final

import numpy as np

from tcrctl import __version__
from tcrctl.config import strict_yaml
from tcrctl.estimator.calibration_settings import CalibrationSettings, CameraFrameSettings, DriveCalibration
from tcrctl.experiment.provenance import versions
from tcrctl.experiment.run_folder import make_run_folder
from tcrctl.identify.calibration.result import CalibrationResult
from tcrctl.identify.calibration.robot_values import robot_of
from tcrctl.identify.calibration.self_calibration import Calibrated
from tcrctl.log.file_names import ROBOT
from tcrctl.robot.module import is_ring_node, node_names
from tcrctl.robot.sections import FrictionSettings
from tcrctl.signals import Array

CALIBRATION: Final = "calibration.yaml"
REPORT: Final = "report.json"
#: Digits of lengths [mm] and angles [deg] in a calibration file.
DIGITS: Final = 6


def write_calibration(found: Calibrated, out: Path) -> tuple[Path, Path]:
    """Write everything into a new folder.

    Args:
        found: What was found.
        out: Where the folder is made.

    Returns:
        Paths of the robot file and of the calibration file.

    Raises:
        DeviceError: If the folder or a file cannot be written.
    """
    folder = make_run_folder(out, f"{found.body.description.name}_calibration")
    robot, calibration = folder.path / ROBOT, folder.path / CALIBRATION
    x, description = found.result.fit.x, found.body.description
    name = f"{description.name}_calibrated"
    new = robot_of(found.body, x, name, friction_of(found))
    head = _head(found)
    folder.write(ROBOT, (head + strict_yaml.dumps(new.model_dump(mode="json", exclude_none=True))).encode())
    settings = calibration_of(found.result, description.modules.count, str(found.log.path))
    folder.write(
        CALIBRATION, (head + strict_yaml.dumps(settings.model_dump(mode="json", exclude_none=True))).encode()
    )
    report = {**found.result.as_json(robot, calibration), "log": str(found.log.path), "versions": versions()}
    folder.write(REPORT, json.dumps(report, indent=2).encode())
    return robot, calibration


def friction_of(found: Calibrated) -> FrictionSettings | None:
    """Return the friction that was found; None if none was looked for."""
    mu = found.result.rubbing.coefficient
    if not mu.size:
        return None
    least = found.spec.rest.least_wrap_deg
    return FrictionSettings(coefficient=tuple(round(c, DIGITS) for c in mu.tolist()), least_wrap_deg=least)


def calibration_of(result: CalibrationResult, n_modules: int, source: str) -> CalibrationSettings:
    """Return what was found of cameras, markers and drives."""
    u, x = result.unknowns, result.fit.x
    rings = [n for n in node_names(n_modules) if is_ring_node(n) and not n.startswith("base.")]
    markers = 1e3 * u.take(x, "markers").reshape(-1, 3)
    backlash = 1e3 * float(u.take(x, "backlash")[0])
    return CalibrationSettings(
        source=source,
        frame=CameraFrameSettings(
            rotation_deg=_rounded(np.degrees(u.take(x, "frame_rotation"))),
            translation_mm=_rounded(1e3 * u.take(x, "frame_translation")),
        ),
        markers_mm={name: _rounded(marker) for name, marker in zip(rings, markers, strict=True)},
        drives=DriveCalibration(
            lag_s=_known(result.drives.lag),
            dead_time_s=_known(result.drives.dead_time),
            backlash_mm=max(round(backlash, DIGITS), 0.0),
            radius_error=tuple(round(r, DIGITS) for r in u.take(x, "radius").tolist()),
        ),
    )


def _rounded(vector: Array) -> tuple[float, float, float]:
    x, y, z = (round(float(v), DIGITS) for v in vector)
    return x, y, z


def _known(value: float) -> float | None:
    return round(value, DIGITS) if math.isfinite(value) else None


def _head(found: Calibrated) -> str:
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    result = found.result
    lines = [
        f"Found by tcrctl {__version__} on {now} from {found.log.path}, {result.rests} rests.",
        f"End of the robot in poses held out: {result.held_out_before.end_mean:.2f} mm on the mean beside its "
        f"place by the file it started from, {result.held_out.end_mean:.2f} mm beside that found.",
    ]
    return "".join(f"# {line}\n" for line in [*lines, *result.undetermined])

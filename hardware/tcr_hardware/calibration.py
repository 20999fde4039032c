"""Where the robot hangs in the camera system, found from markers whose place on the robot is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcr_hardware.errors import HardwareError
from tcr_hardware.rigid_transform import Array, RigidTransform

UP_AXES = {"x": np.array([1.0, 0.0, 0.0]), "y": np.array([0.0, 1.0, 0.0]), "z": np.array([0.0, 0.0, 1.0])}
#: Relative error of the distances between markers that a wrong unit cannot explain.
LARGEST_SCALE_ERROR = 0.02


class CalibrationError(HardwareError):
    """The measured markers do not fit the robot.

    Attributes:
        quantity: What does not fit.
        value: Its value.
        limit: The limit.
        unit: Unit of both.
    """

    def __init__(self, quantity: str, value: float, limit: float, unit: str, *, hint: str = "") -> None:
        super().__init__(
            f"calibration refused: {quantity} is {value:.4g} {unit}, limit {limit:.4g} {unit}", hint=hint
        )
        self.quantity = quantity
        self.value = value
        self.limit = limit
        self.unit = unit


@dataclass(frozen=True, slots=True)
class MarkerMean:
    """Markers of a robot at rest, averaged over frames.

    Attributes:
        mean: Positions (n, 3); NaN for a marker that was never seen.
        deviation: Standard deviation of one frame, root of the sum over the three axes (n,).
        seen: In how many frames each was seen (n,).
    """

    mean: Array
    deviation: Array
    seen: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """A transform and how well it fits.

    Attributes:
        transform: From the camera system to the rig frame.
        residual_rms_m: Root mean square distance between measured and known markers [m].
        residual_max_m: Largest of them [m].
        tilt_deg: Angle between the vertical of the camera system and that of the robot [deg].
        scale_error: Distances between markers, measured against known, minus 1.
    """

    transform: RigidTransform
    residual_rms_m: float
    residual_max_m: float
    tilt_deg: float
    scale_error: float


def average(positions: Array, valid: NDArray[np.bool_]) -> MarkerMean:
    """Average positions (f, n, 3) over the frames in which they are ``valid`` (f, n)."""
    weight = np.asarray(valid, bool)[..., None]
    seen = weight.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(weight, positions, 0.0).sum(axis=0) / seen
        squares = np.where(weight, positions - mean, 0.0) ** 2
        deviation = np.sqrt(squares.sum(axis=(0, 2)) / np.maximum(seen[:, 0] - 1, 1))
    return MarkerMean(mean, np.where(seen[:, 0] > 0, deviation, np.nan), seen[:, 0])


def calibrate(
    measured: Array,
    known: Array,
    *,
    up_axis: str,
    scale_m: float = 1.0,
    level: bool = False,
    max_residual_m: float = 0.002,
    max_tilt_deg: float = 10.0,
) -> CalibrationResult:
    """Fit the rigid transform that takes ``measured`` to ``known``, in the least-squares sense.

    Three markers of the base ring, 60 mm apart, fix the direction of the robot's axis only to about 1 mm per 0.1 mm
    of marker error at 700 mm; take more markers of the robot at rest, or trust the vertical of a levelled camera
    system with ``level``.

    Args:
        measured: Markers in the camera system (k, 3), k >= 3, not on a line.
        known: The same markers in the rig frame, z up (k, 3) [m].
        up_axis: Which axis of the camera system points up; the stream does not say.
        scale_m: Metres per unit of the camera system.
        level: Take the camera system's vertical for the robot's; only heading and origin are fitted.
        max_residual_m: Largest distance between a marker and its place [m].
        max_tilt_deg: Largest angle between the two verticals [deg].

    Raises:
        CalibrationError: Too few markers, a wrong unit, wrong labels, or a wrong up axis.
        ValueError: ``up_axis`` is not x, y or z, or the shapes differ.
    """
    if up_axis not in UP_AXES:
        raise ValueError(f"up_axis is {up_axis!r}, allowed {', '.join(UP_AXES)}")
    measured, known = np.asarray(measured, float), np.asarray(known, float)
    if measured.shape != known.shape or measured.ndim != 2 or measured.shape[1] != 3:
        raise ValueError(f"measured {measured.shape} and known {known.shape} must both be (k, 3)")
    finite = np.isfinite(measured).all(axis=1)
    points, places = scale_m * measured[finite], known[finite]
    _check_spread(places)
    scale_error = _check_scale(points, places)
    up = UP_AXES[up_axis]
    rotation = _heading(points, places, up) if level else _rotation(points, places)
    tilt = _check_tilt(rotation, up, up_axis, max_tilt_deg)
    translation = places.mean(axis=0) - rotation @ points.mean(axis=0)
    distances = np.linalg.norm(points @ rotation.T + translation - places, axis=1)
    if not distances.max() <= max_residual_m:
        hint = "Check the labels of the markers, and that the robot is at rest."
        raise CalibrationError(
            "largest marker residual", 1e3 * distances.max(), 1e3 * max_residual_m, "mm", hint=hint
        )
    transform = RigidTransform(rotation, translation, scale_m)
    rms = float(np.sqrt((distances**2).mean()))
    return CalibrationResult(transform, rms, float(distances.max()), tilt, scale_error)


def _check_spread(places: Array) -> None:
    if len(places) < 3:
        raise CalibrationError("number of markers seen", len(places), 3, "", hint="Uncover the markers.")
    spread = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    if not spread[1] > 0.01:
        hint = "Markers on a line do not fix a rotation."
        raise CalibrationError(
            "extent of the markers across their line", 1e3 * spread[1], 10.0, "mm", hint=hint
        )


def _check_scale(points: Array, places: Array) -> float:
    """Return the relative error of distances; a wrong unit shows as a power of ten."""
    sizes = [np.linalg.norm(each - each.mean(axis=0)) for each in (points, places)]
    error = float(sizes[0] / sizes[1] - 1.0)
    if not abs(error) <= LARGEST_SCALE_ERROR:
        hint = f"The measured distances are {1.0 + error:.4g} times those of the robot: check scale_m."
        raise CalibrationError("relative error of distances", abs(error), LARGEST_SCALE_ERROR, "", hint=hint)
    return error


def _rotation(points: Array, places: Array) -> Array:
    """Return the best proper rotation of centred ``points`` to ``places`` [K76]."""
    u, _, vt = np.linalg.svd((points - points.mean(axis=0)).T @ (places - places.mean(axis=0)))
    handed = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation: Array = vt.T @ handed @ u.T
    return rotation


def _heading(points: Array, places: Array, up: Array) -> Array:
    """Return the best rotation that takes ``up`` to z."""
    side = np.roll(up, 1)
    upright = np.array([side, np.cross(up, side), up])
    flat = (points - points.mean(axis=0)) @ upright.T
    onto = places - places.mean(axis=0)
    angle = np.arctan2(
        (flat[:, 0] * onto[:, 1] - flat[:, 1] * onto[:, 0]).sum(), (flat[:, :2] * onto[:, :2]).sum()
    )
    c, s = np.cos(angle), np.sin(angle)
    rotation: Array = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ upright
    return rotation


def _check_tilt(rotation: Array, up: Array, up_axis: str, limit: float) -> float:
    tilt = float(np.degrees(np.arccos(np.clip((rotation @ up)[2], -1.0, 1.0))))
    if tilt <= limit:
        return tilt
    fitting = [
        f"{sign}{name}"
        for name, axis in UP_AXES.items()
        for sign, way in (("", 1.0), ("-", -1.0))
        if way * (rotation @ axis)[2] >= np.cos(np.radians(limit))
    ]
    hint = f"The robot's vertical is close to {fitting[0]} of the camera system. " if fitting else ""
    hint += "Check up_axis, and that the labels run counter-clockwise seen from above."
    raise CalibrationError(f"angle between {up_axis} and the robot's vertical", tilt, limit, "deg", hint=hint)

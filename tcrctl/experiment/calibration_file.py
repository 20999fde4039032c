"""``estimator.calibration``: a file is read when the experiment is, so that logs and replays have its values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from tcrctl.config import strict_yaml
from tcrctl.config.keys import Finding, Keys
from tcrctl.config.strict_yaml import Document
from tcrctl.errors import InputError
from tcrctl.estimator.calibration_settings import CalibrationSettings
from tcrctl.estimator.settings import EstimatorSettings, PassiveObserverSettings
from tcrctl.robot.description import RobotDescription
from tcrctl.robot.module import is_ring_node, node_names

#: Where it stands in an experiment.
KEYS: Keys = ("estimator", "calibration")
OFF = "off"


def with_calibration(
    document: Document, estimator: EstimatorSettings, robot: RobotDescription
) -> EstimatorSettings:
    """Return an ``estimator:`` section with the values of its calibration file in the place of the path.

    Args:
        document: The experiment's file, for messages.
        estimator: The section.
        robot: The robot that the controller knows.

    Raises:
        SpecError: If there is no such file, it has problems, or it is of another robot.
    """
    if not isinstance(estimator, PassiveObserverSettings) or estimator.calibration == OFF:
        return estimator
    given = estimator.calibration
    found = _read(document, given) if isinstance(given, str) else given
    document.refuse(_misfits(found, node_names(robot.modules.count), len(robot.cables.routes)))
    return estimator.model_copy(update={"calibration": found})


def _read(document: Document, name: str) -> CalibrationSettings:
    at_hand = document.where(KEYS).startswith("--set")  # relative to where the user is
    path = (Path() if at_hand else Path(document.name).parent) / name
    try:
        loaded = strict_yaml.load(path)
    except InputError as error:
        document.refuse([(KEYS, str(error))])
        raise
    return strict_yaml.validate(loaded, CalibrationSettings)


def _misfits(found: CalibrationSettings, names: Sequence[str], cables: int) -> Iterator[Finding]:
    for name in found.markers_mm:
        if name not in names or not is_ring_node(name) or name.startswith("base."):
            yield (*KEYS, "markers_mm", name), "is no node of a moving ring of this robot"
    radii = len(found.drives.radius_error)
    if radii not in (0, cables):
        yield (*KEYS, "drives", "radius_error"), f"the robot has {cables} cables; there are {radii} values"

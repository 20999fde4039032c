"""An excitation with chosen poses: read, draw candidates, choose, write."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from tcrctl.config import strict_yaml
from tcrctl.errors import InputError
from tcrctl.experiment.run_folder import make_run_folder
from tcrctl.experiment.spec import load_spec
from tcrctl.identify.calibration.body import Body
from tcrctl.identify.calibration.design import choose, sensitivities
from tcrctl.identify.calibration.settings import SelfCalibrationSpec
from tcrctl.identify.calibration.unknowns import make_unknowns
from tcrctl.robot.robot import build_robot
from tcrctl.trajectory.excitation import draw_poses
from tcrctl.trajectory.excitation_settings import ExcitationSettings

#: Candidates per pose that is chosen.
CANDIDATES: Final = 5
#: Digits of drive lengths [mm].
DIGITS: Final = 2


@dataclass(frozen=True, slots=True)
class Designed:
    """What was chosen.

    Attributes:
        path: The excitation that was written.
        poses: How many were chosen.
        candidates: Out of how many.
        information: log det of their information over that of the prior.
        drawn: The same of as many that are drawn.
    """

    path: Path
    poses: int
    candidates: int
    information: float
    drawn: float

    def as_json(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {
            "status": "success",
            "excitation_file": str(self.path),
            "poses": self.poses,
            "candidates": self.candidates,
            "information": self.information,
            "information_drawn": self.drawn,
        }


def design_excitation(
    name: str,
    spec: SelfCalibrationSpec,
    out: Path,
    notify: Callable[[str], None],
    progress: Callable[[int, int | None], None] = lambda done, total: None,
) -> Designed:
    """Choose the poses of an excitation, as many as it draws, and write it into a new folder.

    Args:
        name: Shipped experiment or path, with ``trajectory.kind: excitation``.
        spec: What is assumed.
        out: Where the folder is made.
        notify: Takes messages for the user.
        progress: Takes how many candidates were looked at, and how many there are.

    Raises:
        InputError: If it is no excitation, or no taut poses can be drawn.
        DeviceError: If the file cannot be written.
    """
    loaded = load_spec(name)
    section = loaded.spec.trajectory
    if not isinstance(section, ExcitationSettings):
        raise InputError(f"{loaded.path}: trajectory.kind must be excitation, not {section.kind}")
    robot, count = build_robot(loaded.robot), section.poses
    candidates = draw_poses(section.draw, robot, CANDIDATES * count, np.random.default_rng(section.seed))
    notify(f"{len(candidates)} candidates for {count} poses")
    body = Body(loaded.robot, robot, make_unknowns(loaded.robot, spec))
    design = choose(sensitivities(body, 1e-3 * candidates, spec, progress), count)
    poses = np.round(candidates[design.chosen], DIGITS)
    folder = make_run_folder(out, f"{loaded.spec.name}_design")
    folder.write(f"{loaded.spec.name}.yaml", _text(loaded.given_text, poses.tolist()))
    path = folder.path / f"{loaded.spec.name}.yaml"
    return Designed(path, count, len(candidates), design.information, design.drawn)


def _text(given: bytes, poses: list[list[float]]) -> bytes:
    """Return the experiment as given, with the poses in its trajectory."""
    data = strict_yaml.loads(given).data
    data["trajectory"] = {**data["trajectory"], "poses_mm": poses}
    return strict_yaml.dumps(data).encode()

"""The experiment that a log came from, rebuilt from the files attached to it; nothing else on disk is read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tcrctl.config import strict_yaml
from tcrctl.errors import InputError
from tcrctl.experiment.provenance import ROBOT
from tcrctl.experiment.run_folder import RESOLVED, SPEC
from tcrctl.experiment.spec import ExperimentSpec, LoadedSpec, misfits
from tcrctl.log.reader import Log
from tcrctl.robot.description import RobotDescription

#: Sections that a replay can change: the others made what was recorded.
CHANGEABLE: Final = ("controller", "estimator", "safety")


@dataclass(frozen=True, slots=True)
class Origin:
    """What a log was recorded with.

    Attributes:
        recorded: The experiment as it ran.
        wanted: The same with ``--set`` applied, to be replayed.
    """

    recorded: LoadedSpec
    wanted: LoadedSpec


def rebuild(log: Log, overrides: Sequence[str]) -> Origin:
    """Read experiment and robot from the attachments of a log.

    Args:
        log: The log.
        overrides: Assignments ``a.b=c`` that replace recorded settings.

    Raises:
        InputError: If the log has no such attachments, or an override changes what cannot be changed.
        SpecError: If they are not valid for this version of the program, or an override is not.
    """
    for assignment in overrides:
        _check_changeable(assignment)
    name = f"{log.path}:{ROBOT}"
    robot = strict_yaml.validate(strict_yaml.loads(_attached(log, ROBOT), name), RobotDescription)
    document = strict_yaml.loads(_attached(log, RESOLVED), f"{log.path}:{RESOLVED}")
    recorded = _loaded(log, document, robot, ())
    for assignment in overrides:
        document = strict_yaml.override(document, assignment)
    wanted = _loaded(log, document, robot, tuple(overrides)) if overrides else recorded
    if wanted.spec.controller.period_s != recorded.spec.controller.period_s:
        raise InputError("--set controller.period_s: a replay has the period with which was recorded")
    return Origin(recorded, wanted)


def _check_changeable(assignment: str) -> None:
    key = assignment.partition("=")[0].strip()
    if key.partition(".")[0] not in CHANGEABLE:
        raise InputError(
            f"--set {key}: a replay feeds what was recorded, so only {', '.join(CHANGEABLE)} can be changed",
            hint="To change anything else, run the experiment again: tcrctl run SPEC --set ...",
        )


def _attached(log: Log, name: str) -> bytes:
    if name not in log.attachments:
        has = ", ".join(log.attachments) or "none"
        raise InputError(f"{log.path}: cannot be replayed: it has no attachment {name}; attachments: {has}")
    return log.attachments[name][1]


def _loaded(
    log: Log, document: strict_yaml.Document, robot: RobotDescription, overrides: tuple[str, ...]
) -> LoadedSpec:
    spec = strict_yaml.validate(document, ExperimentSpec)
    document.refuse(misfits(spec, robot))
    given = log.attachments.get(SPEC, ("", b""))[1]
    place = Path(f"{log.path}:")
    return LoadedSpec(spec, robot, given, place / SPEC, place / ROBOT, overrides)

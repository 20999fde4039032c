"""The experiment that a log came from, rebuilt from the files attached to it; nothing else on disk is read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tcrctl.config import strict_yaml
from tcrctl.errors import InputError, SpecError
from tcrctl.experiment.plugged import validated, with_plugins
from tcrctl.experiment.spec import ExperimentSpec, LoadedSpec, misfits
from tcrctl.log.file_names import RESOLVED, ROBOT, SPEC
from tcrctl.log.reader import Log
from tcrctl.log.run_files import RunFiles
from tcrctl.plugins.trust import Trust
from tcrctl.robot.description import RobotDescription
from tcrctl.trajectory.sampled_section import SampledSection

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


def rebuild(log: Log, overrides: Sequence[str], plugins: Path | None = None) -> Origin:
    """Read experiment and robot from the attachments of a log.

    Args:
        log: The log.
        overrides: Assignments ``a.b=c`` that replace recorded settings.
        plugins: Folder that holds the files of kinds from elsewhere; without it files and modules that a log names
            are not run. What a log carries itself is never run.

    Raises:
        InputError: If the log has no such attachments, or an override changes what cannot be changed.
        SpecError: If they are not valid for this version of the program, or an override is not.
    """
    for assignment in overrides:
        _check_changeable(assignment)
    files = RunFiles(log)
    for name in (ROBOT, RESOLVED):
        if name not in files:
            has = ", ".join(files.names) or "none"
            raise InputError(
                f"{log.path}: cannot be replayed: it has no attachment {name}; attachments: {has}"
            )
    trust = Trust(plugins or Path(), files=plugins is not None, by_name=True)
    robot, document = files.robot(), files.document(RESOLVED)
    recorded = _loaded(files, document, robot, (), trust)
    for assignment in overrides:
        document = strict_yaml.override(document, assignment)
    wanted = _loaded(files, document, robot, tuple(overrides), trust) if overrides else recorded
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


def _loaded(
    files: RunFiles,
    document: strict_yaml.Document,
    robot: RobotDescription,
    overrides: tuple[str, ...],
    trust: Trust,
) -> LoadedSpec:
    model, problems = with_plugins(document, ExperimentSpec, trust)
    if problems:
        raise SpecError(problems)
    spec = validated(document, model)
    if isinstance(spec.trajectory, SampledSection):  # asked only if the controller looks at other instants
        content = files.content(spec.trajectory.kept_name)
        spec = spec.model_copy(update={"trajectory": spec.trajectory.with_content(content)})
    document.refuse(misfits(spec, robot))
    place = Path(files.place(""))
    return LoadedSpec(spec, robot, files.content(SPEC), place / SPEC, place / ROBOT, overrides)

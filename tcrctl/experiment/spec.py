"""The experiment file: which robot, which trajectory, which controller, which plant.

SPEC (name or path) -> strict YAML -> --set -> ExperimentSpec + RobotDescription -> LoadedSpec
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import Field, model_validator

from tcrctl.config import shipped, strict_yaml
from tcrctl.config.keys import Finding
from tcrctl.config.kind_switch import without_former_keys
from tcrctl.config.settings import Settings, quantity, refuse
from tcrctl.controller.settings import ControllerSettings
from tcrctl.errors import InputError, Problem, SpecError
from tcrctl.estimator.settings import EstimatorSettings, PassiveObserverSettings
from tcrctl.experiment.calibration_file import with_calibration
from tcrctl.experiment.criterion import CriterionText
from tcrctl.experiment.log_settings import LogSettings
from tcrctl.experiment.plant_robot import plant_robot
from tcrctl.experiment.plugged import trust_of, validated, with_plugins
from tcrctl.experiment.summary import TASK, UNITS
from tcrctl.experiment.table_file import with_samples
from tcrctl.picture.settings import PictureSettings
from tcrctl.plant.realistic import as_drawn
from tcrctl.plant.rig.file import LoadedRig, load_rig, period_misfits
from tcrctl.plant.settings import PlantSettings, SimulatedSettings
from tcrctl.robot.description import RobotDescription, cable_routes
from tcrctl.robot.doubts import doubts
from tcrctl.robot.sections import Name
from tcrctl.task.settings import TaskSettings
from tcrctl.trajectory.settings import TrajectorySettings


class SafetySettings(Settings):
    """When a run is stopped, beside the robot's tension limit and two unsolved steps in a row."""

    position_error_mm: float = quantity("mm", "largest distance between estimated and wanted end", 60.0, gt=0)
    picture: PictureSettings = PictureSettings()


class StartSettings(Settings):
    """How the wanted pose gets from where the robot really is to the trajectory."""

    blend_s: float = quantity(
        "s", "time in which the offset of the start pose fades out; 0: begin with a step", 2.0, ge=0
    )
    approach_mm_s: float = quantity(
        "mm/s", "if fading would be faster, the robot first goes to the start at this speed", 5.0, gt=0
    )

    @property
    def approach(self) -> float:
        """``approach_mm_s`` in m/s."""
        return 1e-3 * self.approach_mm_s


class ExperimentSpec(Settings):
    """One experiment, every default filled in."""

    name: Name
    description: str = Field(default="", description="one line for listings")
    source: str = Field(default="", description="where the experiment comes from, for instance a figure")
    robot: str = Field(
        description="shipped robot, or path of a robot file relative to this one", min_length=1
    )
    seed: int = Field(default=0, ge=0, lt=2**63, description="seed of everything random")
    trajectory: TrajectorySettings
    controller: ControllerSettings
    estimator: EstimatorSettings = PassiveObserverSettings(kind="passive_observer")
    plant: PlantSettings
    task: TaskSettings | None = Field(default=None, description="what the run is for, if it has a task")
    criteria: tuple[CriterionText, ...] = Field(
        default=(), description="what the run must achieve, else exit code 3"
    )
    safety: SafetySettings = SafetySettings()
    start: StartSettings = StartSettings()
    log: LogSettings = LogSettings()

    @property
    def full_state_s(self) -> float:
        """Time between two steps that are logged in full [s]; an exact state is input, so every step has to be."""
        if self.estimator.needs_every_step:
            return 0.0
        return self.log.full_state(self.controller.period_s)

    @model_validator(mode="after")
    def _sections_agree(self) -> ExperimentSpec:
        refuse(_disagreements(self))
        return self


def _disagreements(spec: ExperimentSpec) -> Iterator[Finding]:
    results = [*UNITS, *(TASK + name for name in (spec.task.result_names if spec.task else ()))]
    for i, criterion in enumerate(spec.criteria):
        if criterion.name not in results:
            known = ", ".join(difflib.get_close_matches(criterion.name, results, n=3, cutoff=0.3) or results)
            yield ("criteria", i), f"a run has no result {criterion.name}; known: {known}"
    yield from _target_disagreements(spec)
    if spec.controller.follows_drives and not spec.trajectory.gives_drives:
        need = f"must be drives with controller.kind: {spec.controller.kind}"
        yield ("trajectory", "kind"), f"{need}, not {spec.trajectory.kind}"
    for name, section in (("plant", spec.plant), ("trajectory", spec.trajectory)):
        for keys, message in section.misfits(spec.controller.period_s):
            yield (name, *keys), message


def _target_disagreements(spec: ExperimentSpec) -> Iterator[Finding]:
    targets = spec.task.target_names if spec.task else ()
    for keys, name in spec.trajectory.named_targets():
        if spec.task is None:
            yield ("trajectory", *keys), f"there is no task with a target {name}; the experiment has none"
        elif name not in targets:
            yield ("trajectory", *keys), f"the task has no target {name}; it has {', '.join(targets)}"


def misfits(spec: ExperimentSpec, robot: RobotDescription) -> Iterator[Finding]:
    """Yield path and message of what the experiment asks and the robot does not have.

    Args:
        spec: The experiment.
        robot: Its robot.
    """
    count = robot.modules.count
    for keys, ring in spec.plant.rings_named():
        if ring > count:
            yield ("plant", *keys), f"there is no ring {ring}; {robot.name} has rings 1 to {count}"
    yield from _drive_misfits(spec, robot)
    ceiling = spec.controller.ceiling_n
    if ceiling is not None and ceiling > robot.tension_limit_n:
        limit = f"tension_limit_n of {robot.name}, {robot.tension_limit_n:g}"
        yield ("controller", "tension", "ceiling_n"), f"must be at most {limit}, not {ceiling:g}"


def _drive_misfits(spec: ExperimentSpec, robot: RobotDescription) -> Iterator[Finding]:
    on_the_way = [(("trajectory", *keys), lengths) for keys, lengths in spec.trajectory.drives_named()]
    at_start = [(("plant", *keys), lengths) for keys, lengths in spec.plant.drives_named()]
    names = [route.name for route in cable_routes(robot)]
    for path, message in spec.plant.list_misfits(tuple(names), robot.name):
        yield ("plant", *path), message
    for keys, lengths in (*on_the_way, *at_start):
        if len(lengths) != len(names):
            has = f"{robot.name} has {len(names)} cables, {', '.join(names)}"
            yield keys, f"{has}; there are {len(lengths)} lengths"
    low, high = robot.stroke_mm
    for keys, lengths in at_start:
        for c, length in enumerate(lengths):
            if not low <= length <= high:
                yield (*keys, c), f"must be within stroke_mm, {low:g} to {high:g}, not {length:g}"


@dataclass(frozen=True, slots=True)
class LoadedSpec:
    """An experiment ready to run, and where it came from.

    Attributes:
        spec: The experiment.
        robot: Its robot.
        given_text: The file as it is on disk.
        path: The file.
        robot_path: File of the robot.
        overrides: ``--set`` arguments, already applied.
        rig: The bench, for ``plant.kind: rig``.
        plant_robot: The robot of a simulated plant as designed, if it is another one.
        notes: What the user should know about how the file was read.
    """

    spec: ExperimentSpec
    robot: RobotDescription
    given_text: bytes
    path: Path
    robot_path: Path
    overrides: tuple[str, ...]
    rig: LoadedRig | None = None
    plant_robot: RobotDescription | None = None
    notes: tuple[str, ...] = ()


def load_spec(name_or_path: str, overrides: Sequence[str] = ()) -> LoadedSpec:
    """Read an experiment and its robot.

    Args:
        name_or_path: Shipped name, or path of a YAML file.
        overrides: Assignments ``a.b=c`` as given to ``--set``, applied in order.

    Raises:
        UnknownNameError: If there is no shipped experiment of that name.
        SpecError: If the experiment or its robot has problems; all of both are listed.
        InputError: If a file is missing.
    """
    path = shipped.find_experiment(name_or_path)
    return read_spec(strict_yaml.read(path), path, overrides, shipped.notes(name_or_path))


def read_spec(
    given: bytes, path: Path, overrides: Sequence[str] = (), known: Iterable[str] = ()
) -> LoadedSpec:
    """Read an experiment from its text, and its robot.

    Args:
        given: The text.
        path: Where it is from, for messages and relative paths.
        overrides: As for :func:`load_spec`, which raises the same.
        known: What the user should know already.
    """
    document = strict_yaml.loads(given, str(path))
    written = document.data
    document, problems = _overridden(document, overrides)
    model, unknown = with_plugins(document, ExperimentSpec, trust_of(path))
    problems += unknown
    document, notes = without_former_keys(document, written, model)
    spec, robot, robot_path = _validated(document, path.parent, problems, model)
    document.refuse(misfits(spec, robot))
    estimator = with_calibration(document, spec.estimator, robot)
    trajectory = with_samples(document, spec.trajectory)
    spec = spec.model_copy(update={"estimator": estimator, "trajectory": trajectory})
    named = spec.plant.rig_file
    rig = None if named is None else load_rig(named, robot, path.parent)
    if rig is not None:
        wrong = period_misfits(rig, spec.controller.period_s)
        document.refuse((("controller", "period_s"), text) for text in wrong)
    own = plant_robot(document, spec.plant, robot, robot_path)
    notes = (*notes, *known, *(f"robot {robot.name}: {text}" for text in doubts(robot)))
    return LoadedSpec(spec, robot, given, path, robot_path, tuple(overrides), rig, own, notes)


def with_draws(spec: ExperimentSpec, cables: int, seed: int | None = None) -> ExperimentSpec:
    """Return an experiment as it runs: with a seed, and with what ``plant.realistic`` draws.

    Args:
        spec: The experiment.
        cables: Number of cables of its robot.
        seed: Seed of everything random; its own if None.
    """
    changes: dict[str, Any] = {} if seed is None else {"seed": seed}
    if isinstance(spec.plant, SimulatedSettings):
        changes["plant"] = as_drawn(spec.plant, cables, spec.seed if seed is None else seed)
    return spec.model_copy(update=changes)


def _overridden(
    document: strict_yaml.Document, overrides: Sequence[str]
) -> tuple[strict_yaml.Document, list[Problem]]:
    """Return the document with all overrides that can be applied, and why the others cannot."""
    problems: list[Problem] = []
    for assignment in overrides:
        try:
            document = strict_yaml.override(document, assignment)
        except SpecError as error:
            problems += error.problems
    return document, problems


def _validated(
    document: strict_yaml.Document, folder: Path, problems: list[Problem], model: type[ExperimentSpec]
) -> tuple[ExperimentSpec, RobotDescription, Path]:
    """Return experiment and robot, or raise the problems of both after those already known."""
    robot, robot_path = None, Path()
    try:
        spec = validated(document, model)
    except SpecError as error:
        known = {problem.key for problem in problems}
        problems += [problem for problem in error.problems if problem.key not in known]
    name = document.data.get("robot") if isinstance(document.data, dict) else None
    if isinstance(name, str) and name:
        try:
            at_hand = document.where(("robot",)).startswith("--set")  # relative to where the user is
            robot_path = shipped.find_robot(name, Path() if at_hand else folder)
            robot = strict_yaml.validate(strict_yaml.load(robot_path), RobotDescription)
        except SpecError as error:
            problems += error.problems
        except InputError as error:
            problems.append(document.problem(("robot",), str(error)))
    if problems or robot is None:
        raise SpecError(problems)
    return spec, robot, robot_path

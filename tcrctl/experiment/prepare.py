"""An experiment file becomes a robot, a trajectory, a plant, an estimator and a controller."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing import parent_process
from typing import Any, Final

import numpy as np

from tcrctl.controller.controller import build_controller
from tcrctl.controller.settings import speed_limit
from tcrctl.errors import InputError, StoppedError
from tcrctl.estimator.calibration import MarkerCalibration
from tcrctl.estimator.drives import BelievedDrives
from tcrctl.estimator.estimator import build_estimator
from tcrctl.estimator.exact import TrueState
from tcrctl.experiment.compilation import Watch, announced_compilation, unwatched
from tcrctl.experiment.feasibility import DriveLimits, StaticPath, check_drives, check_feasibility
from tcrctl.experiment.first_look import Report, build_picture, first_frames, measured_pose
from tcrctl.experiment.kernel_words import kernel_words
from tcrctl.experiment.metrics import Metrics
from tcrctl.experiment.plant_robot import description_of_plant
from tcrctl.experiment.spec import ExperimentSpec, LoadedSpec, with_draws
from tcrctl.loop.loop import Parts, run_loop, step_count
from tcrctl.loop.safety import SafetyGuard, SafetyLimits
from tcrctl.plant.own import OwnPlant
from tcrctl.plant.plant import Plant, RunnablePlant
from tcrctl.plant.rehearsal import LOST, RehearsalPlant
from tcrctl.plant.rig.operation import Operation, unheard
from tcrctl.plant.settings import PlantSection, RigSettings, SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.plugins.plugin import plugin_of
from tcrctl.robot.robot import Robot, build_robot
from tcrctl.signals import Measurement, StepRecord
from tcrctl.task.task import Task, build_task, task_targets
from tcrctl.trajectory.start_blend import StartBlend
from tcrctl.trajectory.trajectory import Trajectory, build_trajectory

#: Steps of a rehearsal.
WARM_UP_STEPS: Final = len(LOST)

Notify = Callable[[str], None]
PlantBuilder = Callable[[Any, "Experiment", Operation], tuple[RunnablePlant, TrueState | None]]


def silent(text: str) -> None:
    """Discard a message for the user."""


@dataclass(frozen=True, slots=True)
class Experiment:
    """An experiment, built as far as it can be without a plant.

    Attributes:
        loaded: The files it came from.
        spec: What they say, with the seed in use.
        robot: The robot that the controller knows.
        trajectory: What is wanted.
    """

    loaded: LoadedSpec
    spec: ExperimentSpec
    robot: Robot
    trajectory: Trajectory

    @property
    def period(self) -> float:
        """Control period [s]."""
        return float(self.spec.controller.period_s)

    @property
    def steps(self) -> int:
        """Control steps of a whole run."""
        return step_count(self.trajectory.duration, self.period)

    @property
    def paced(self) -> bool:
        """Whether the clock paces every run: a rig cannot be told to wait."""
        return self.loaded.rig is not None

    @property
    def safety(self) -> SafetyLimits:
        """When a run is stopped."""
        return SafetyLimits(1e-3 * self.spec.safety.position_error_mm, self.robot.tension_limit)


def _simulated(
    settings: SimulatedSettings, experiment: Experiment, operation: Operation
) -> tuple[RunnablePlant, TrueState]:
    del operation
    loaded = experiment.loaded
    spec = experiment.spec
    robot = experiment.robot
    own = description_of_plant(settings, loaded.robot, loaded.plant_robot, spec.seed, robot)
    robot = robot if own is None else build_robot(own)
    plant = SimulatedPlant(settings, robot, experiment.period, spec.seed)
    return plant, plant.state


def _rig(settings: RigSettings, experiment: Experiment, operation: Operation) -> tuple[RunnablePlant, None]:
    del settings  # the file that it names is loaded
    from tcrctl.plant.rig.assembly import build_rig  # heavy

    if experiment.loaded.rig is None:
        raise InputError("the experiment was loaded without a rig file")
    return build_rig(experiment.loaded.rig, experiment.robot, experiment.period, operation), None


#: Section and builder of every ``plant.kind``; it returns the plant, and its true state if it knows it.
PLANTS: Final[Mapping[str, tuple[type[PlantSection], PlantBuilder]]] = {
    "simulated": (SimulatedSettings, _simulated),
    "rig": (RigSettings, _rig),
}


def prepare(
    loaded: LoadedSpec,
    *,
    seed: int | None = None,
    notify: Notify = silent,
    watch: Watch = unwatched,
    ahead: bool | None = None,
) -> Experiment:
    """Build robot and trajectory, and rehearse a few steps so that no kernel is compiled or loaded in a run.

    Args:
        loaded: The experiment.
        seed: Seed of everything random; that of the experiment if None.
        notify: Takes messages for the user.
        watch: Is told how far it is with kernels that are compiled ahead.
        ahead: Whether they are, on all cores, if some are not in the cache; if None, unless this process is one of
            several that work side by side.

    Raises:
        InputError: If robot, trajectory and controller do not go together.
        NoEquilibriumError: If the robot has no stable shape.
    """
    spec = with_draws(loaded.spec, len(loaded.robot.cables.routes), seed)
    ahead = parent_process() is None if ahead is None else ahead
    words = kernel_words(spec, loaded.robot) if ahead else None
    with announced_compilation(notify, words, watch):
        robot = build_robot(loaded.robot)
        trajectory = make_trajectory(spec, robot)
        if spec.controller.tracks == "pose" and trajectory.normal(np.zeros(1)) is None:
            raise InputError(
                f"{loaded.path}: controller.output: pose needs a trajectory with an orientation; "
                f"trajectory.kind: {spec.trajectory.kind} leaves it free"
            )
        experiment = Experiment(loaded, spec, robot, trajectory)
        _rehearse(experiment)
    return experiment


def believed_drives(spec: ExperimentSpec) -> BelievedDrives:
    """Return the drives as the controller knows them, before the first step."""
    known = spec.controller.known_drives
    return BelievedDrives(known.lag, known.dead_time_s, known.reports, spec.controller.period_s)


def make_trajectory(spec: ExperimentSpec, robot: Robot) -> Trajectory:
    """Build the trajectory of an experiment, to the targets of its task if it has one.

    Raises:
        NoEquilibriumError: If drive lengths are given with which the robot has no stable shape.
    """
    targets = task_targets(spec.task, spec.seed) if spec.task else {}
    return build_trajectory(spec.trajectory, robot, targets)


def plan(experiment: Experiment) -> StaticPath:
    """Find the drives along the trajectory, or take those that it gives, held against all limits.

    Raises:
        InfeasibleError: If the robot cannot follow.
    """
    robot, controller = experiment.robot, experiment.spec.controller
    floor, ceiling = controller.floor_n, controller.ceiling_n
    limits = DriveLimits(
        speed=speed_limit(controller),
        floor=0.0 if floor is None else floor,
        ceiling=robot.tension_limit if ceiling is None else ceiling,
    )
    if controller.follows_drives:
        return check_drives(experiment.trajectory, robot, limits)
    return check_feasibility(experiment.trajectory, robot, limits)


def make_task(experiment: Experiment) -> Task | None:
    """Build what judges a run by its task, if the experiment has one; every run needs a new one."""
    spec, modules = experiment.spec, experiment.loaded.robot.modules
    return build_task(spec.task, spec.seed, 1e-3 * modules.rod_diameter_mm) if spec.task else None


def build_plant(
    experiment: Experiment, operation: Operation | None = None
) -> tuple[RunnablePlant, TrueState | None]:
    """Build the plant; returns its true state too if it knows it.

    Args:
        experiment: What it is for.
        operation: What the plant may know of the run.

    Raises:
        DeviceError: If it cannot be reached.
        InputError: If a rig does not do what its file says, or one from elsewhere cannot be built.
    """
    settings = experiment.spec.plant
    plugin = plugin_of(settings)
    if plugin is not None:
        spec = experiment.spec
        own = OwnPlant(settings, plugin, experiment.robot, experiment.period, spec.seed)
        return own, None
    _, build = PLANTS[settings.kind]
    return build(settings, experiment, operation or Operation())


def build_parts(
    experiment: Experiment,
    plant: Plant,
    state: TrueState | None,
    report: Report = unheard,
    frames: Sequence[Measurement] | None = None,
) -> tuple[Parts, float]:
    """Build estimator and controller for a plant at rest, and let the trajectory begin where the plant is.

    Args:
        experiment: The experiment.
        plant: Is measured, not driven.
        state: Its true positions and velocities if it knows them.
        report: Takes what the loop has to say of the cameras' picture.
        frames: Measurements of it, if they were taken already.

    Returns:
        The parts of a loop within the experiment's safety limits, for one run; and the distance of the measured
        start from that of the trajectory [m], NaN if the cameras do not see the tip ring.

    Raises:
        InputError: If the estimator needs a state that is not known.
        DeviceError: If the plant cannot be measured.
    """
    spec = experiment.spec
    robot = experiment.robot
    period = experiment.period
    trajectory, offset = experiment.trajectory, np.nan
    calibration = MarkerCalibration.of(spec.estimator.calibrated, robot.n_modules)
    frames = first_frames(plant) if frames is None else frames
    found = measured_pose(frames, robot, calibration)
    if found is not None:
        offset = float(np.linalg.norm(found[0] - trajectory.position(np.zeros(1))[0]))
        rest = spec.controller.settling
        start, drive = spec.start, frames[-1].drive
        trajectory = StartBlend(trajectory, *found, start.blend_s, start.approach, rest, drive)
    parts = Parts(
        trajectory=trajectory,
        plant=plant,
        estimator=build_estimator(spec.estimator, robot, period, state, believed_drives(spec)),
        controller=build_controller(spec.controller, robot),
        period=period,
        steps=step_count(trajectory.duration, period),
        guard=SafetyGuard(experiment.safety),
        picture=build_picture(spec.safety.picture, robot, period, frames, report),
    )
    return parts, offset


def _rehearse(experiment: Experiment) -> None:
    """Run a few steps with parts of its own, in simulation, so that nothing of the run itself is touched."""
    controller = experiment.spec.controller
    for settings in (controller, controller.at_once()) if controller.settling else (controller,):
        spec = experiment.spec.model_copy(update={"controller": settings})
        _rehearse_at(replace(experiment, spec=spec))


def _rehearse_at(experiment: Experiment) -> None:
    """Run a few steps from where it begins, settling or at once."""
    plant = RehearsalPlant(experiment.spec.plant, experiment.robot, experiment.period, experiment.spec.seed)
    parts, _ = build_parts(experiment, plant, plant.state)
    metrics, task = Metrics(WARM_UP_STEPS, paced=False), make_task(experiment)

    def record(step: StepRecord) -> None:
        metrics.add(step)
        if task is not None:
            task.observe(step)

    with suppress(StoppedError):  # a run that ends so shall do it with a log
        run_loop(replace(parts, steps=WARM_UP_STEPS, guard=SafetyGuard(), record=record))

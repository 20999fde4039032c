"""Experiments run from Python, recorded or step by step; see :mod:`tcrctl`."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from tcrctl.api.recorded import Run, as_settings
from tcrctl.config import strict_yaml
from tcrctl.errors import DeviceError, InputError
from tcrctl.experiment.again import load_experiment
from tcrctl.experiment.prepare import Experiment, build_plant, prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import LoadedSpec, read_spec
from tcrctl.plant.plant import RunnablePlant
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array, Command, Measurement, Truth

Spec: TypeAlias = str | os.PathLike[str] | Mapping[str, Any]
Set: TypeAlias = Mapping[str, Any] | Sequence[str]


def run(
    spec: Spec,
    *,
    set: Set = (),
    out: str | os.PathLike[str] = "logs",
    seed: int | None = None,
    confirmed: bool = False,
) -> Run:
    """Run an experiment and record it, as ``tcrctl run`` does.

    Args:
        spec: Shipped name, path of a YAML file or of a run's folder, or a map with the keys of such a file; paths
            in a map are relative to the working directory.
        set: Settings that are replaced: ``{"controller.period_s": 0.1}`` or ``["controller.period_s=0.1"]``.
        out: Where the run's folder is made.
        seed: Seed of everything random; that of the experiment if None.
        confirmed: You agree that a rig moves; without it a rig is not armed.

    Returns:
        The run, also one that was stopped or failed a criterion, as ``summary["status"]`` says.

    Raises:
        InputError: If the experiment has problems.
        DeviceError: If it cannot be recorded, or the plant not be reached.
    """
    summary = run_experiment(prepare(_loaded(spec, set), seed=seed), out=Path(out), confirmed=confirmed)
    if summary.log is None:
        raise DeviceError(summary.reason)
    return Run(summary.log)


def simulate(spec: Spec, *, set: Set = (), seed: int | None = None) -> Simulation:
    """Return the plant of an experiment, to be driven step by step by a loop of your own.

    Args:
        spec: As for :func:`run`; its plant is simulated, or comes from elsewhere.
        set: As there.
        seed: As there.

    Raises:
        InputError: If the experiment has problems, or its plant is a rig.
    """
    experiment = prepare(_loaded(spec, set), seed=seed)
    if experiment.loaded.rig is not None:
        raise InputError("simulate: the plant is a rig; tcrctl.run moves one, within its safety limits")
    return Simulation(experiment)


class Simulation:
    """One plant, from reset to reset; nothing is recorded and no guard stops it.

    Attributes:
        robot: The robot that a controller knows.
        period: Control period [s].
        trajectory: What the experiment wants: ``position(t)``, ``normal(t)``, ``duration``.
        time: Time of the last measurement's step [s].
    """

    def __init__(self, experiment: Experiment) -> None:
        self.robot: Robot = experiment.robot
        self.period, self.trajectory, self.time = experiment.period, experiment.trajectory, 0.0
        self._experiment, self._drive = experiment, np.zeros(0)
        self._plant: RunnablePlant | None = None

    def reset(self) -> Measurement:
        """Let the robot hang as at the beginning of a run; the same seed gives the same noise."""
        self.close()
        self._plant, _ = build_plant(self._experiment)
        self._plant.start()
        self.time = 0.0
        return self._read(self._plant)

    def step(self, speed: Array) -> Measurement:
        """Drive for one period, and return what is measured then.

        Args:
            speed: Drive speeds (m,) [m/s]; the stroke is kept, the speed limit is yours.

        Raises:
            InputError: If it has another shape or is no number, or there was no reset.
            DivergenceError: If the plant diverged.
        """
        speed = np.asarray(speed, dtype=float)
        if self._plant is None:
            raise InputError("simulate: reset comes before the first step")
        if speed.shape != (self.robot.n_cables,) or not np.isfinite(speed).all():
            raise InputError(f"simulate: speeds must be {self.robot.n_cables} finite numbers")
        self._plant.write(Command(speed, self._drive + self.period * speed))
        self.time += self.period
        return self._read(self._plant)

    @property
    def truth(self) -> Truth | None:
        """What the plant knows about itself at the last measurement; None if it does not tell."""
        return None if self._plant is None else self._plant.truth()

    def close(self) -> None:
        """Leave the plant; a further reset makes another one."""
        if self._plant is not None:
            self._plant.close()
            self._plant = None

    def _read(self, plant: RunnablePlant) -> Measurement:
        measured = plant.read()
        self._drive = measured.drive
        return measured


def _loaded(spec: Spec, given: Set) -> LoadedSpec:
    settings = as_settings(dict(given) if isinstance(given, Mapping) else given)
    if isinstance(spec, Mapping):
        text = strict_yaml.dumps(dict(spec)).encode()
        return read_spec(text, Path.cwd() / "(a map)", settings)
    return load_experiment(os.fspath(spec), settings)

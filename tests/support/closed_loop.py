"""Controllers of every kind, targets for them, and a loop that closes one round a simulated plant."""

from __future__ import annotations

import numpy as np

from tcrctl.controller.controller import build_controller
from tcrctl.controller.cost import outputs
from tcrctl.controller.dither import Dithered
from tcrctl.controller.plan import Situation
from tcrctl.controller.settings import CostWeights, IocSettings, KinematicSettings
from tcrctl.estimator.estimator import build_estimator
from tcrctl.estimator.settings import PassiveObserverSettings
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.signals import Command, Estimate, Reference

#: Keys of ``controller:`` for every way to predict.
PREDICTIONS = {
    "multi_step": {"prediction": {"kind": "multi_step"}},
    "one_step": {"prediction": {"kind": "one_step", "horizon_s": 0.4}},
    "literal": {"prediction": "literal"},
    "static": {"prediction": {"kind": "multi_step"}, "model": "static"},
    "static literal": {"prediction": "literal", "model": "static"},
}


KINDS = [*PREDICTIONS, "kinematic"]


def settings_of(kind, **changes):
    return KinematicSettings(kind="kinematic", **changes) if kind == "kinematic" else ioc(kind, **changes)


def ioc(prediction="multi_step", **changes) -> IocSettings:
    """Settings of a way to predict; keys of a multi-step prediction are changed where they belong."""
    chosen = dict(PREDICTIONS[prediction])
    below = {
        key: changes.pop(key)
        for key in ("offset", "feedforward", "tension_gap", "hole_drag")
        if key in changes
    }
    if below:
        chosen["prediction"] = {**chosen["prediction"], **below}
    return IocSettings(kind="ioc", **{"dither": None, "settle_s": 0.0, **chosen, **changes})


def pose_settings(**changes) -> IocSettings:
    return ioc(output="pose", weights=CostWeights(position=7.2e4, normal=44.0, twist=1e-3), **changes)


def resting(robot, drive=None) -> Estimate:
    """The state at rest."""
    q = robot.rest.q
    return Estimate(
        t=0.0,
        q=q.copy(),
        v=np.zeros_like(q),
        drive=np.zeros(robot.n_cables) if drive is None else drive,
        set_point=np.zeros(robot.n_cables) if drive is None else drive,
        arrived=np.zeros(robot.n_cables) if drive is None else drive,
        lag=0.0,
        tension=robot.rest.tension.copy(),
        position=robot.rest_position,
        normal=robot.rest_normal,
        disturbance=np.zeros_like(q),
        converged=True,
    )


def situation(robot, estimate, speed=None, amplitude=0.0) -> Situation:
    """What a predictor is told by an estimate that is not old, under a dither of an amplitude [m] at its middle."""
    m = robot.n_cables
    still, limit = np.zeros(m), np.zeros(0)
    return Situation(
        estimate=estimate,
        reference=None,
        age=0.0,
        outputs=outputs(estimate, 0.0, robot),
        error=np.zeros(6),
        shift=np.zeros(6),
        previous=still if speed is None else speed,
        low=limit,
        high=limit,
        doubt="",
        dither=Dithered(amplitude, still),
    )


def constant(robot, controller, offset=(0.0, 0.0, 0.0), t=0.0) -> Reference:
    """A target that stands still beside the rest pose."""
    n = controller.ahead.shape[0]
    target = robot.rest_position + np.array(offset)
    return Reference(
        t, target, robot.rest_normal, np.tile(target, (n, 1)), np.tile(robot.rest_normal, (n, 1))
    )


def closed_loop(robot, settings, offset, seconds, mismatch=None, noise=0.0, latency=0.0, **plant):
    """Errors (n,) [m], commands (n, m) and infos of a controller that is asked to go to one target.

    Further keys of the plant's section are given by name.
    """
    plant = SimulatedPlant(
        SimulatedSettings(
            kind="simulated", step_ms=2.5, mismatch=mismatch, noise_um=noise, latency_ms=latency, **plant
        ),
        robot,
        settings.period_s,
        seed=3,
    )
    observer = build_estimator(
        PassiveObserverSettings(kind="passive_observer"), robot, settings.period_s, None
    )
    controller = build_controller(settings, robot)
    applied = Command(np.zeros(robot.n_cables), np.zeros(robot.n_cables))
    errors, speeds, infos = [], [], []
    for k in range(round(seconds / settings.period_s)):
        estimate = observer.update(plant.read(), applied)
        reference = constant(robot, controller, offset, k * settings.period_s)
        errors.append(np.linalg.norm(plant.truth().position - reference.position))
        wanted, info = controller.control(estimate, reference)
        applied = plant.write(wanted)
        speeds.append(wanted.speed)
        infos.append(info)
    return np.array(errors), np.array(speeds), infos

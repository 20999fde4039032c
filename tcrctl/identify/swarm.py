"""Particle swarm over the unit cube, the paper's method for (10); the swarm is pymoo's."""

from __future__ import annotations

import numpy as np

from tcrctl.identify.best import Best
from tcrctl.identify.evaluation import Evaluator
from tcrctl.identify.frame import Frame
from tcrctl.identify.problem import mean_distance
from tcrctl.identify.settings import SwarmSettings
from tcrctl.signals import Array

#: Cost of a particle for which the robot has no stable shape [mm].
NO_SHAPE = 1e4
#: Relative improvement that counts as one.
IMPROVEMENT = 1e-3


def search(
    evaluator: Evaluator, frame: Frame, start: Array, settings: SwarmSettings, seed: int, best: Best
) -> None:
    """Let a swarm look for the minimum of (10); the robot as given is one of the first particles.

    Args:
        evaluator: Evaluates particles, many at a time.
        frame: Measurement frame; its unknowns are eliminated for every particle.
        start: The robot as given (n,), in the unit cube.
        settings: Size and patience of the swarm.
        seed: Seed of its random numbers.
        best: Takes every improvement, so that an interrupted search loses nothing.
    """
    from pymoo.algorithms.soo.nonconvex.pso import PSO
    from pymoo.core.evaluator import Evaluator as Bookkeeper
    from pymoo.core.population import Population
    from pymoo.core.problem import Problem
    from pymoo.problems.static import StaticProblem

    n = len(start)
    problem = Problem(n_var=n, n_obj=1, xl=np.zeros(n), xu=np.ones(n))
    cube = np.random.default_rng(seed).random((settings.particles, n))
    cube[0] = start
    swarm = PSO(pop_size=settings.particles, sampling=Population.new("X", cube))
    swarm.setup(problem, termination=("n_gen", settings.iterations), seed=seed, verbose=False)
    stale, level = 0, np.inf
    while swarm.has_next() and stale < settings.patience:
        particles = swarm.ask()
        costs = _costs(evaluator, frame, particles.get("X"), best)
        Bookkeeper().eval(StaticProblem(problem, F=costs[:, None]), particles)
        swarm.tell(infills=particles)
        stale = 0 if best.cost < level * (1.0 - IMPROVEMENT) else stale + 1
        level = min(level, best.cost) if stale else best.cost


def _costs(evaluator: Evaluator, frame: Frame, particles: Array, best: Best) -> Array:
    measured = evaluator.problem.measured
    costs = np.full(len(particles), NO_SHAPE)
    for i, predicted in enumerate(evaluator.predict_many(list(particles))):
        if predicted is not None:
            costs[i] = mean_distance(frame, predicted, measured)
            best.offer(float(costs[i]), particles[i], frame.aligned(predicted, measured))
    return costs

"""Particle swarm over the unit cube, the paper's method for (10)."""

from __future__ import annotations

from typing import Final

import numpy as np

from tcrctl.identify.best import Best
from tcrctl.identify.coordinate_frame import CoordinateFrame
from tcrctl.identify.evaluation import Evaluator
from tcrctl.identify.regression import mean_distance
from tcrctl.identify.settings import SwarmSettings
from tcrctl.signals import Array

#: Cost of a particle for which the robot has no stable shape [mm].
NO_SHAPE: Final = 1e4
#: Relative improvement that counts as one.
IMPROVEMENT: Final = 1e-3
#: Share of its velocity that a particle keeps, and how strongly its own best place and the swarm's draw it.
#: With the 0.73 of textbooks a swarm of 20 has not come to rest after 40 iterations.
INERTIA: Final = 0.5
PULL: Final = 1.5
#: Greatest velocity in each coordinate, per iteration.
FASTEST: Final = 0.2
#: Share of its velocity with which a particle comes back from a bound.
REBOUND: Final = 0.5


def search(
    evaluator: Evaluator, frame: CoordinateFrame, start: Array, settings: SwarmSettings, seed: int, best: Best
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
    random = np.random.default_rng(seed)
    shape = settings.particles, len(start)
    place = random.random(shape)
    place[0] = start
    velocity = random.uniform(-FASTEST, FASTEST, shape)
    own, own_cost = place.copy(), np.full(settings.particles, np.inf)
    stale = 0
    level = np.inf
    for _ in range(settings.iterations):
        cost = _costs(evaluator, frame, place, best)
        better = cost < own_cost
        own[better], own_cost[better] = place[better], cost[better]
        stale = 0 if best.cost < level * (1.0 - IMPROVEMENT) else stale + 1
        if stale == settings.patience:
            return
        level = min(level, best.cost) if stale else best.cost
        velocity = INERTIA * velocity
        for goal in (own, own[np.argmin(own_cost)]):
            velocity += PULL * random.random(shape) * (goal - place)
        place, velocity = _moved(place, np.clip(velocity, -FASTEST, FASTEST))


def _moved(place: Array, velocity: Array) -> tuple[Array, Array]:
    """Move for one iteration; who would leave the cube stops at its face and turns round."""
    ahead = place + velocity
    outside = (ahead < 0.0) | (ahead > 1.0)
    return np.clip(ahead, 0.0, 1.0), np.where(outside, -REBOUND * velocity, velocity)


def _costs(evaluator: Evaluator, frame: CoordinateFrame, particles: Array, best: Best) -> Array:
    measured = evaluator.regression.measured
    costs = np.full(len(particles), NO_SHAPE)
    for i, predicted in enumerate(evaluator.predict_many(list(particles))):
        if predicted is not None:
            costs[i] = mean_distance(frame, predicted, measured)
            best.offer(float(costs[i]), particles[i], frame.aligned(predicted, measured))
    return costs

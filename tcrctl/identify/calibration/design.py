"""Which poses tell most: D-optimal choice by exchange, from the sensitivities of the static model.

    max  log det (I + Λ^1/2 Σ_k J_k' C_k^-1 J_k Λ^1/2)    over n of the candidates k

with the slopes J_k of what the cameras see at candidate k by all unknowns, the spread C_k of rests and the prior
Λ. One after the other the pose is taken that adds most; then every pose is exchanged for a better candidate while
there is one. Source: [FED72].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.identify.calibration.body import Body
from tcrctl.identify.calibration.fit import spread
from tcrctl.identify.calibration.rests import Rests
from tcrctl.identify.calibration.settings import SelfCalibrationSpec
from tcrctl.identify.calibration.shapes import Shapes
from tcrctl.identify.calibration.sight import Sight
from tcrctl.signals import Array

#: Directions in which a pose tells less than this part of its best one are left out.
LITTLE: Final = 1e-3
#: Most directions that are kept of a pose.
MOST: Final = 40
#: Rounds in which every chosen pose may be exchanged.
ROUNDS: Final = 3
#: An exchange has to add this much to the logarithm.
GAIN: Final = 1e-3


@dataclass(frozen=True, slots=True)
class Design:
    """Chosen poses.

    Attributes:
        chosen: Which candidates, in the order in which they were chosen (n,).
        information: log det of the information over that of the prior.
        drawn: The same of as many candidates as they were drawn.
        left: Standard deviations after over before, of all unknowns (n_unknowns,).
    """

    chosen: NDArray[np.intp]
    information: float
    drawn: float
    left: Array


def sensitivities(
    body: Body,
    drives: Array,
    spec: SelfCalibrationSpec,
    progress: Callable[[int, int | None], None] = lambda done, total: None,
) -> Array:
    """Return what every pose tells, as rows of a square root of its information (k, MOST, n_unknowns).

    Args:
        body: The robot as described.
        drives: Drive lengths of all candidates (k, m) [m].
        spec: What is assumed.
        progress: Takes how many candidates were looked at, and how many there are.

    Raises:
        NoEquilibriumError: If the robot has no stable shape in one of them.
    """
    none = np.zeros_like(drives)
    rests = Rests(np.arange(len(drives), dtype=float), drives, np.zeros((len(drives), 0, 3)), none, none)
    sight, x = Sight(body.unknowns, body.robot.n_modules), np.zeros(len(body.unknowns))
    told = np.zeros((len(drives), MOST, x.size))
    for k, shape in enumerate(Shapes(body, rests, spec.rest).at(x)):
        _, slopes = sight.of(x, shape)
        root = np.linalg.cholesky(spread(sight.turned(np.eye(3), shape.loose), 1e-6 * spec.rest.noise_um))
        white = np.linalg.solve(root, slopes * body.unknowns.prior)
        _, size, ways = np.linalg.svd(white, full_matrices=False)
        kept = min(MOST, int(np.sum(size > LITTLE * size[0])))
        told[k, :kept] = size[:kept, None] * ways[:kept]
        progress(k + 1, len(drives))
    return told


def choose(told: Array, count: int) -> Design:
    """Choose the poses that tell most.

    Args:
        told: As from :func:`sensitivities` (k, r, n_unknowns).
        count: How many are chosen.
    """
    covariance = np.eye(told.shape[2])
    chosen: list[int] = []
    for _ in range(count):
        gains = _gains(told, covariance)
        gains[chosen] = -np.inf
        chosen.append(int(np.argmax(gains)))
        covariance = _with(covariance, told[chosen[-1]])
    for _ in range(ROUNDS):
        if not _exchanged(told, chosen):
            break
    information, covariance = _information(told, chosen)
    drawn, _ = _information(told, list(range(count)))
    return Design(np.array(chosen), information, drawn, np.sqrt(np.diag(covariance)))


def _exchanged(told: Array, chosen: list[int]) -> bool:
    """Exchange every chosen pose for the best candidate, if that is better; return whether one was."""
    better = False
    for place in range(len(chosen)):
        others = chosen[:place] + chosen[place + 1 :]
        _, covariance = _information(told, others)
        gains = _gains(told, covariance)
        gains[others] = -np.inf
        best = int(np.argmax(gains))
        if gains[best] > gains[chosen[place]] + GAIN:
            chosen[place], better = best, True
    return better


def _gains(told: Array, covariance: Array) -> Array:
    """Return what every candidate adds to the logarithm (k,)."""
    r = told.shape[1]
    return np.array([np.linalg.slogdet(np.eye(r) + rows @ covariance @ rows.T)[1] for rows in told])


def _with(covariance: Array, rows: Array) -> Array:
    """Covariance after one more pose."""
    seen = rows @ covariance
    return np.asarray(covariance - seen.T @ np.linalg.solve(np.eye(len(rows)) + seen @ rows.T, seen))


def _information(told: Array, chosen: list[int]) -> tuple[float, Array]:
    """log det of the information of chosen poses, and its inverse."""
    rows = told[chosen].reshape(-1, told.shape[2])
    information = np.eye(told.shape[2]) + rows.T @ rows
    return float(np.linalg.slogdet(information)[1]), np.asarray(np.linalg.inv(information))

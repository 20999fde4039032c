"""What the data say of the unknowns, and what they do not.

A direction in the space of unknowns, scaled by what was assumed of them, keeps the standard deviation √λ after the
fit, with λ an eigenvalue of the scaled posterior covariance. Near 1 nothing was learnt along it: what is there
rests on what was assumed. Directions are looked for within the unknowns that a user sets or reads: not among single
holes and nodes, of which there are more than anything could tell apart.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from tcrctl.identify.calibration.unknowns import Unknowns
from tcrctl.signals import Array

#: Groups in which what cannot be told apart is looked for.
NAMED: Final = (
    "springs", "density", "tension", "zeros", "radius", "tilt", "backlash",
    "frame_rotation", "frame_translation",
)  # fmt: skip
#: What is left of the standard deviation from which on a direction counts as not found.
LEFT: Final = 0.7
#: Members below this fraction of the largest are not named.
SMALL: Final = 0.3
#: Two unknowns with a correlation beyond this move together.
TOGETHER: Final = 0.9


def undetermined(unknowns: Unknowns, covariance: Array) -> list[str]:
    """Return a sentence per direction that the data leave as uncertain as it was.

    Args:
        unknowns: Their names, and how certain they were beforehand.
        covariance: Of the unknowns, after the fit (n, n).
    """
    places = np.concatenate([np.arange(len(unknowns))[unknowns.of(name)] for name in NAMED])
    prior = unknowns.prior[places]
    scaled = covariance[np.ix_(places, places)] / np.outer(prior, prior)
    values, vectors = np.linalg.eigh(scaled)
    found = []
    for left, vector in sorted(zip(np.sqrt(values), vectors.T, strict=True), key=lambda pair: -pair[0]):
        if left < LEFT:
            break
        vector = vector / vector[np.argmax(np.abs(vector))]
        named = [i for i in np.argsort(-np.abs(vector)) if abs(vector[i]) >= SMALL]
        parts = ", ".join(f"{unknowns.names[places[i]]} ({vector[i]:+.2f})" for i in named)
        what = parts if len(named) == 1 else f"the common change of {parts}"
        found.append(f"{what}: {100.0 * left:.0f} % of what was uncertain beforehand still is")
    return found


def moving_together(unknowns: Unknowns, covariance: Array) -> list[str]:
    """Return a sentence per pair of unknowns that the data tell from each other hardly."""
    places = np.concatenate([np.arange(len(unknowns))[unknowns.of(name)] for name in NAMED])
    deviation = np.sqrt(np.diag(covariance))[places]
    correlation = covariance[np.ix_(places, places)] / np.outer(deviation, deviation)
    pairs = [(i, j) for i, j in np.argwhere(np.triu(np.abs(correlation), 1) > TOGETHER)]
    return [
        f"{unknowns.names[places[i]]} and {unknowns.names[places[j]]}: correlation {correlation[i, j]:+.2f}"
        for i, j in pairs
    ]

"""A controller whose model was learnt from a log; ``python learnt.py LOG`` learns it and writes learnt.yaml.

Ridge regression from monomials of the drive lengths to the end position: no mechanics. The weights stand in the
experiment, so log and replay have them.
"""

from __future__ import annotations

import sys
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np

from tcrctl.extend import Array, Estimate, OwnControllerSection, Reference, Robot, quantity

DEGREE, UNIT = 3, 0.05  # of the monomials; drive length that counts as 1 [m]


class LearntSettings(OwnControllerSection):
    """Drive speeds from the error of the end position, by a map that was learnt."""

    weights_mm: tuple[tuple[float, float, float], ...] = quantity("mm", "end position per monomial")
    proportional_1_s: float = quantity("1/s", "part of the error that is removed per second", 1.0, ge=0)
    integral_1_s2: float = quantity("1/s2", "gain on the integrated error", 0.3, ge=0)


class Learnt:
    """Removes the error of the end position by the slope of the learnt map where the drives are."""

    def __init__(self, settings: LearntSettings, robot: Robot) -> None:
        self.settings, self.sum = settings, np.zeros(3)
        self.powers, self.weights = powers(robot.n_cables), 1e-3 * np.array(settings.weights_mm)
        if len(self.weights) != len(self.powers):
            raise ValueError(f"{len(self.powers)} weights are needed for {robot.n_cables} cables")

    def control(self, estimate: Estimate, reference: Reference) -> Array:
        """Return drive speeds (m,) [m/s]; limits are kept by whoever calls."""
        s = self.settings
        error = reference.position - estimate.position
        self.sum += s.period_s * error
        motion = (reference.ahead_position[0] - reference.position) / s.period_s
        slope = self.weights.T @ slopes(estimate.drive / UNIT, self.powers) / UNIT
        wanted = motion + s.proportional_1_s * error + s.integral_1_s2 * self.sum
        speeds: Array = np.linalg.pinv(slope, rcond=1e-2) @ wanted
        return speeds


LEARNT = (LearntSettings, Learnt)


def powers(cables: int) -> Array:
    """Return the powers of every drive in every monomial up to the degree (k, m)."""
    chosen = [c for d in range(DEGREE + 1) for c in combinations_with_replacement(range(cables), d)]
    return np.array([[c.count(i) for i in range(cables)] for c in chosen], float)


def slopes(drive: Array, powers: Array) -> Array:
    """Return the derivatives of the monomials by the drives (k, m)."""
    lower = powers[:, None, :] - np.eye(len(drive))  # less one power of the drive by which is derived
    found: Array = powers * np.prod(drive ** np.maximum(lower, 0.0), axis=2)
    return found


def learn(drive: Array, position: Array, ridge: float = 1e-4) -> tuple[Array, float]:
    """Return weights (k, 3) [m] and the rms distance on every fifth second, which is held out [m].

    Args:
        drive: Drive lengths (n, m) [m].
        position: End positions (n, 3) [m].
        ridge: Weight of the squared weights.
    """
    monomials = np.prod((drive / UNIT)[:, None, :] ** powers(drive.shape[1]), axis=2)
    held_out = np.arange(len(drive)) // 20 % 5 == 4
    known = monomials[~held_out]
    weights = np.linalg.solve(known.T @ known + ridge * np.eye(known.shape[1]), known.T @ position[~held_out])
    missed = monomials[held_out] @ weights - position[held_out]
    return weights, float(np.sqrt((missed**2).sum(axis=1).mean()))


def main(log: str) -> None:
    """Learn from a log, and write the experiment that uses what was learnt."""
    import yaml

    from tcrctl import load

    columns = load(log).columns("estimate_drive", "estimate_position")
    weights, missed = learn(columns["estimate_drive"], columns["estimate_position"])
    here = Path(__file__).parent
    experiment = yaml.safe_load((here / "eight.yaml").read_text())
    experiment["name"], experiment["description"] = (
        "learnt",
        "A figure of eight, held by a model that was learnt",
    )
    rounded = [[round(1e3 * value, 3) for value in row] for row in weights.tolist()]
    experiment["controller"] = {"kind": "./learnt.py:LEARNT", "weights_mm": rounded}
    text = yaml.safe_dump(experiment, sort_keys=False, default_flow_style=None, width=110)
    (here / "learnt.yaml").write_text(text)
    print(f"learnt.yaml: {len(weights)} weights, held out rms {1e3 * missed:.2f} mm")


if __name__ == "__main__":
    main(sys.argv[1])

"""How far a dither reaches: the part of its wave that gets along the robot.

The wave of the drives makes the modules longer and shorter. Where cables rub it is used up in the first holes, and
what hangs below stands still. With the lengthening λ that the drives' wave p gives a robot without friction,

    ℓ = Σ λ_i l_i / Σ λ_i²,    g = Σ p'ℓ' / Σ p'²,   l_i from ring to ring

over the last waves. A prime takes out what is constant or changes steadily, x' = x(t) - 2 x(t - T/2) + x(t - T).
g is near 1 if all of the wave arrives, however wrong cameras, masses and springs are, and whatever the lag of
drives that tell where they are. Of cables of one length that move against each other nothing can be seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from tcrctl.memory import POSITION, Kept
from tcrctl.robot.module import APEX, NODES
from tcrctl.robot.robot import Robot
from tcrctl.signals import Array

#: Waves over which g is found.
WAVES: Final = 2.0
#: Of a wave by which the modules move less than this in all, as a part of what the drives do, nothing can be seen.
UNSEEN: Final = 0.1
#: Amplitude of a wave of the drives that is too small to tell [m].
FAINT: Final = 3e-5


class WaveReach:
    """Finds g of one dither.

    Attributes:
        sees: The wave moves modules, so that something can be found.
        tells: The wave of the last seconds was large enough to tell.
    """

    def __init__(self, robot: Robot, signs: Array, half_wave: int) -> None:
        """Take the robot, the directions of its drives (m,), and half a wave in control periods."""
        self.tells = False
        self._found = np.ones(1)
        self._signs = signs / signs.size
        lengthening = _lengthening(robot, signs)
        self.sees = bool(np.abs(lengthening).sum() > UNSEEN)
        self._lengthening = lengthening / max(float(lengthening @ lengthening), 1e-30)
        self._past = np.zeros((2 * half_wave + 1, 2))  # p and ℓ, the oldest first
        self._half, self._seen = half_wave, 0
        self._sums = np.zeros(2)
        self._fade = 1.0 - 1.0 / (WAVES * 2 * half_wave)

    @property
    def share(self) -> float:
        """g, between 0 and 1; 1 as long as nothing is known."""
        return float(self._found[0])

    def memory(self) -> Mapping[str, Kept]:
        """Return the last wave, the sums, and what was found."""
        return {
            "wave": Kept(self._past.ravel(), POSITION),  # a view
            "wave_sums": Kept(self._sums, POSITION),
            "reach": Kept(self._found, POSITION),
        }

    def observe(self, q: Array, drive: Array) -> None:
        """Take node positions (3 n_nodes,) [m] and the drives at the same time (m,) [m]."""
        lengths, _ = _module_lengths(q)
        self._past[:-1] = self._past[1:]
        self._past[-1] = self._signs @ drive, self._lengthening @ lengths
        self._seen += 1
        if self._seen < self._past.shape[0] or not self.sees:
            return
        sent, came = self._past[-1] - 2.0 * self._past[-1 - self._half] + self._past[0]
        self._sums *= self._fade
        self._sums += sent * sent, sent * came
        self.tells = bool(self._sums[0] * (1.0 - self._fade) > (2.0 * FAINT) ** 2)
        if self.tells:
            self._found[0] = min(max(self._sums[1] / self._sums[0], 0.0), 1.0)


def _module_lengths(q: Array) -> tuple[Array, Array]:
    """Return the distances of neighbouring ring centres (n_modules,) [m], and their directions (n_modules, 3)."""
    centres = q.reshape(-1, NODES, 3)[:, :APEX].mean(axis=1)
    steps = np.diff(centres, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    return lengths, steps / lengths[:, None]


def _lengthening(robot: Robot, signs: Array) -> Array:
    """Return λ (n_modules,): what a motion of the drives by ``signs`` makes of the lengths at rest."""
    moved = np.zeros_like(robot.rest.q)
    moved[moved.size - robot.rest.gain.shape[0] :] = robot.rest.gain @ signs
    _, along = _module_lengths(robot.rest.q)
    steps = np.diff(moved.reshape(-1, NODES, 3)[:, :APEX].mean(axis=1), axis=0)
    return np.asarray(np.einsum("ij,ij->i", steps, along))

"""What drives with ends of their stroke make of a command."""

from __future__ import annotations

import numpy as np

from tcrctl.signals import Array, Command


def within_stroke(command: Command, drive: Array, period: float, stroke: tuple[float, float]) -> Command:
    """Return the command that drives carry out; a speed is changed only where an end of the stroke is met.

    Args:
        command: What is asked for; its speeds count.
        drive: Drive lengths at the beginning of the period (m,) [m].
        period: Control period [s].
        stroke: Least and greatest drive length [m].
    """
    asked = drive + period * command.speed
    reached = np.clip(asked, *stroke)
    return Command(np.where(reached == asked, command.speed, (reached - drive) / period), reached)

"""What happens to a simulated plant while it runs: pushes on its rings, markers that are not seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tcrctl.plant.settings import DropoutSettings, PushSettings
from tcrctl.robot.module import ring_nodes
from tcrctl.signals import Array


def pushed(weight: Array, pushes: Sequence[PushSettings], t: float) -> Array:
    """Return the weight plus the pushes that act at time ``t``.

    Args:
        weight: Weight of the node coordinates (3 n_nodes,) [N].
        pushes: All pushes of the run.
        t: Time [s].

    Returns:
        External force (3 n_nodes,) [N]; ``weight`` itself if nothing pushes.
    """
    acting = [push for push in pushes if push.start_s <= t < push.start_s + push.duration_s]
    if not acting:
        return weight
    force = weight.reshape(-1, 3).copy()
    for push in acting:
        force[list(ring_nodes(push.ring))] += np.array(push.force_n) / 3.0
    return force.ravel()


def seen(
    valid: NDArray[np.bool_], rings: NDArray[np.int64], dropouts: Sequence[DropoutSettings], t: float
) -> NDArray[np.bool_]:
    """Return which markers the cameras see at time ``t``.

    Args:
        valid: Which they see when all is well (n_markers,).
        rings: Ring of every marker (n_markers,).
        dropouts: All dropouts of the run.
        t: Time [s].
    """
    seen = valid.copy()
    for dropout in dropouts:
        if dropout.start_s <= t < dropout.start_s + dropout.duration_s:
            seen &= ~np.isin(rings, dropout.rings)
    return seen

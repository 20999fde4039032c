"""Whether several runs wanted the same, also if one of them ended earlier."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tcrctl.analysis.history import History
from tcrctl.signals import Array

#: References that differ by less are the same [m], [1].
_ALIKE = 1e-9


def shared(histories: Sequence[History], wanted: Sequence[Array]) -> int | None:
    """Find one reference that holds for all runs.

    Args:
        histories: The runs.
        wanted: What each of them wanted (n, components).

    Returns:
        The run that has it all, the longest one; None if two runs wanted different things at the same time.
    """
    longest = max(range(len(wanted)), key=lambda i: len(wanted[i]))
    whole, t = wanted[longest], histories[longest].t
    for history, own in zip(histories, wanted, strict=True):
        n = len(own)
        if own.shape[1:] != whole.shape[1:] or not np.allclose(history.t, t[:n], atol=_ALIKE):
            return None
        if not np.allclose(own, whole[:n], atol=_ALIKE, equal_nan=True):
            return None
    return longest

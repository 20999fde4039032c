"""Figure of a what-if: what the controller asked for, what it would have asked for, and the difference."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from tcrctl.errors import DeviceError, InputError
from tcrctl.signals import StepRecord

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Colours of Okabe and Ito, told apart by colour-blind readers too.
_COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
FORMATS: Final = (".png", ".pdf", ".svg")


class WhatIf:
    """Gathers the commands of a replay step by step."""

    def __init__(self) -> None:
        self._t: list[float] = []
        self._recorded: list[tuple[float, ...]] = []
        self._replayed: list[tuple[float, ...]] = []

    def add(self, recorded: StepRecord, replayed: StepRecord) -> None:
        """Take a step."""
        self._t.append(recorded.t)
        self._recorded.append(tuple(1e3 * recorded.wanted.speed))
        self._replayed.append(tuple(1e3 * replayed.wanted.speed))

    def figure(self) -> Figure:
        """Drive speeds wanted, recorded and replayed, and below it their difference."""
        from matplotlib.figure import Figure  # heavy

        t = np.array(self._t)
        was = np.array(self._recorded)
        now = np.array(self._replayed)
        figure = Figure(figsize=(8.0, 5.5), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True)
        for cable in range(was.shape[1] if was.ndim == 2 else 0):
            colour = _COLOURS[cable % len(_COLOURS)]
            above.plot(t, was[:, cable], color=colour, linewidth=1.0, label=f"c{cable + 1}")
            above.plot(t, now[:, cable], color=colour, linewidth=1.0, linestyle="--")
            below.plot(t, now[:, cable] - was[:, cable], color=colour, linewidth=1.0)
        above.set_ylabel("wanted drive speed [mm/s]\nrecorded solid, replayed dashed")
        below.set_ylabel("replayed - recorded [mm/s]")
        below.set_xlabel("t [s]")
        if above.lines:
            above.legend(ncols=3, fontsize="small")
        for axes in (above, below):
            axes.grid(visible=True, alpha=0.3)
        return figure


def check_format(path: Path) -> None:
    """Find out before the replay whether a figure can be written to ``path``.

    Raises:
        InputError: If its suffix is no known format, or the file exists.
    """
    if path.suffix.lower() not in FORMATS:
        raise InputError(
            f"{path}: a figure is written as {', '.join(FORMATS)}, not {path.suffix or 'no suffix'}"
        )
    if path.exists():
        raise InputError(f"{path}: exists already")


def save(figure: Figure, path: Path) -> None:
    """Write a figure.

    Raises:
        DeviceError: If it cannot be written.
    """
    try:
        figure.savefig(path, dpi=150)
    except OSError as error:
        raise DeviceError(f"{path}: cannot be written: {error.strerror or error}") from error

"""Figures of a run, one kind one file: each takes histories and returns a figure.

=============  ===================================================================  =====================
name           shows                                                                like [TCR]
=============  ===================================================================  =====================
overview       robot, path of its end, projection of the path, error                Fig. 10
path           path of the end in space, with arrows along the end axis             Fig. 11 (b), 19 (a)
position       x, y, z over time, wanted and actual                                 Fig. 9 (b), 16
orientation    theta_x, theta_y over time, wanted and actual                        Fig. 12, 16
normal         components of the end normal over time, wanted and actual            Fig. 25 (b)
error          position and orientation error over time                             Fig. 9 (d), 10 (b)
drives         drive lengths over time                                              Fig. 9 (c), 11 (c)
speeds         drive speeds over time, limits, saturation                           -
tensions       cable tensions over time, limits                                     -
timing         time that a control step takes                                       -
task           walls, holes, objects, pipes, and the path of the end among them     Fig. 20, 24
innovation     distance of the markers from the estimator's model                   -
latency        age of the camera picture, time from it to the drives                -
comparison     errors, tension and control time of several runs beside each other   -
=============  ===================================================================  =====================

The modules here import matplotlib; this one does so only when a figure is drawn.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tcrctl.analysis.history import History
from tcrctl.errors import DeviceError, InputError, UnknownNameError
from tcrctl.experiment.run_folder import make_folder_for
from tcrctl.plots.look import USUAL, Look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES: Final = (
    "overview",
    "path",
    "position",
    "orientation",
    "normal",
    "error",
    "drives",
    "speeds",
    "tensions",
    "timing",
    "task",
    "innovation",
    "latency",
    "comparison",
)
"""Every kind of figure: the name of its module."""

FORMATS: Final = ("png", "pdf", "svg")
#: The same figure is the same file.
_METADATA: Final = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}


def draw(name: str, histories: Sequence[History], look: Look = USUAL) -> Figure:
    """Draw a figure.

    Args:
        name: One of ``FIGURES``.
        histories: One run, or several to compare.
        look: Width, font and style.

    Raises:
        UnknownNameError: If there is no such kind of figure.
    """
    check_names([name], FORMATS[0])
    from tcrctl.plots.style import printed

    module = importlib.import_module(f"tcrctl.plots.{name}")
    with printed(look):
        figure: Figure = module.draw(histories)
    return figure


def save(figure: Figure, path: Path, look: Look = USUAL) -> None:
    """Write a figure in the format of the file's suffix; an existing file is replaced.

    Raises:
        DeviceError: If the file cannot be written.
    """
    from tcrctl.plots.legends import at_peace
    from tcrctl.plots.style import printed

    make_folder_for(path)
    try:
        with printed(look), at_peace(figure):
            figure.savefig(path, metadata=_METADATA.get(path.suffix))
    except OSError as error:
        raise DeviceError(f"{path}: cannot be written: {error.strerror or error}") from error


def check_names(names: Sequence[str], file_format: str) -> None:
    """Find out before anything is read whether all figures and the format exist.

    Raises:
        UnknownNameError: If one does not.
    """
    for name in names:
        if name not in FIGURES:
            raise UnknownNameError("figure", name, FIGURES)
    if file_format not in FORMATS:
        raise UnknownNameError("file format", file_format, FORMATS)


def worth_drawing(histories: Sequence[History]) -> list[str]:
    """Return the figures that show something of these runs."""
    from tcrctl.analysis.task_drawing import read_drawing

    missing = set() if len(histories) > 1 else {"comparison"}
    if not any(len(read_drawing(history.log).corners) for history in histories):
        missing.add("task")
    return [name for name in FIGURES if name not in missing]


def save_figures(
    histories: Sequence[History],
    names: Sequence[str],
    out: Path,
    file_format: str,
    *,
    force: bool = False,
    look: Look = USUAL,
) -> Iterator[Path]:
    """Draw figures and write each to ``out/NAME.FORMAT``; yield every file when it is there.

    Args:
        histories: One run, or several to compare.
        names: Which figures.
        out: Folder that they go to.
        file_format: One of ``FORMATS``.
        force: Replace files that exist.
        look: Width, font and style.

    Raises:
        UnknownNameError: If there is no such figure or format; nothing is written then.
        InputError: If one of the files exists and ``force`` is False; nothing is written then.
        DeviceError: If a file cannot be written.
    """
    check_names(names, file_format)
    paths = {name: out / f"{name}.{file_format}" for name in names}
    existing = [] if force else [str(path) for path in paths.values() if path.exists()]
    if existing:
        hint = "Give another folder with --out, or --force."
        raise InputError(f"{', '.join(existing)}: exists already", hint=hint)
    for name, path in paths.items():
        save(draw(name, histories, look), path, look)
        yield path

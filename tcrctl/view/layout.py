"""The layout of panels in the Foxglove app that comes with the package: robot, messages, and plots of a run.

It is written in the form that the app exports and imports: settings of every panel by its id, and how they are
arranged. Paths name fields of :mod:`tcrctl.log.schema`; those of cables are for six of them.
"""

from __future__ import annotations

from importlib.resources import files
from typing import Final

FILE: Final = "foxglove_layout.json"


def layout() -> str:
    """Return the layout, a JSON text."""
    return files("tcrctl.view").joinpath(FILE).read_text(encoding="utf-8")

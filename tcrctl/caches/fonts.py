"""Where matplotlib keeps what it knows of this computer's fonts: looking at all of them takes seconds."""

from __future__ import annotations

from collections.abc import MutableMapping
from pathlib import Path
from typing import Final

from tcrctl.caches.places import is_writable, places, user_folder

FONTS: Final = "MPLCONFIGDIR"
_PACKAGE: Final = Path(__file__).parents[1]


def place_fonts(environment: MutableMapping[str, str], package: Path = _PACKAGE) -> None:
    """Set matplotlib's variable to a folder that can be written, unless those that it would take can be.

    Args:
        environment: The process's; matplotlib must not be loaded yet.
        package: Folder of the program.
    """
    given = environment.get(FONTS)
    if given:
        usual = [Path(given)]
    else:
        bases = (("XDG_CACHE_HOME", ".cache"), ("XDG_CONFIG_HOME", ".config"))
        usual = [base / "matplotlib" for names in bases if (base := user_folder(environment, *names))]
    if len(usual) == (1 if given else 2) and all(is_writable(folder) for folder in usual):
        return
    found = (place.inside("matplotlib") for place in places(environment, package))
    chosen = next((folder for folder in found if folder is not None), None)
    if chosen is not None:
        environment[FONTS] = str(chosen)

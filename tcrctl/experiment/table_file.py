"""Samples of a trajectory are read with the experiment, so that what is wrong is told at its line.

``kind: table`` reads its file. ``kind: function`` calls its function once, and keeps what it said: the folder of a
run holds the samples, and neither doing it again nor a replay needs, or runs, the function.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from tcrctl.config.strict_yaml import Document
from tcrctl.errors import InputError, SpecError, with_hint
from tcrctl.log.file_names import RESOLVED
from tcrctl.plugins.source import function_in
from tcrctl.trajectory.function_settings import FunctionSettings
from tcrctl.trajectory.sampled_section import SampledSection

FILE: Final = ("trajectory", "file")
FUNCTION: Final = ("trajectory", "function")
#: What the samples of a function depend on.
SAMPLED_BY: Final = ("function", "duration_s", "rate_hz")


def with_samples(document: Document, trajectory: Any) -> Any:
    """Return a ``trajectory:`` section with its samples, if it has some.

    Args:
        document: The experiment's file, for messages.
        trajectory: The section.

    Raises:
        SpecError: If there is no such file or function, or something is wrong with it.
    """
    if not isinstance(trajectory, SampledSection):
        return trajectory
    from tcrctl.trajectory.table import table_samples  # heavy

    read, keys = (_sampled, FUNCTION) if isinstance(trajectory, FunctionSettings) else (_read, FILE)
    try:
        found = trajectory.with_content(read(document, trajectory))
        table_samples(found)
    except SpecError:
        raise
    except InputError as error:
        document.refuse([(keys, with_hint(error))])
    return found


def _read(document: Document, trajectory: Any) -> bytes:
    """Return the file of a table."""
    from tcrctl.trajectory.table_files import read_bytes  # heavy

    folder = Path() if document.is_override(FILE) else Path(document.name).parent
    return read_bytes(folder / Path(trajectory.file).expanduser())


def _sampled(document: Document, trajectory: Any) -> bytes:
    """Return what a function says, or has said when the run was made in whose folder the experiment lies."""
    from tcrctl.trajectory.function_samples import sampled  # heavy
    from tcrctl.trajectory.table_files import read_bytes

    folder = Path(document.name).parent
    kept: Path = folder / trajectory.kept_name
    changed = any(document.is_override(("trajectory", key)) for key in SAMPLED_BY)
    if Path(document.name).name == RESOLVED and kept.is_file() and not changed:
        return read_bytes(kept)
    place, _, name = trajectory.function.rpartition(":")
    start = Path() if document.is_override(FUNCTION) else folder
    function, file = function_in(
        trajectory.function, place, name, lambda path: start / Path(path).expanduser()
    )
    return sampled(trajectory, function, file)


def table_file(trajectory: Any) -> dict[str, bytes]:
    """Return the file that a section needs, by the name under which a run keeps it; empty if it needs none."""
    if not isinstance(trajectory, SampledSection):
        return {}
    return {trajectory.kept_name: trajectory.content}

"""``trajectory.kind: table``: its file is read with the experiment, so that what is wrong is told at its line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tcrctl.config.strict_yaml import Document
from tcrctl.errors import InputError, SpecError
from tcrctl.trajectory.table_settings import TableSettings

#: Where it stands in an experiment.
KEYS = ("trajectory", "file")


def with_table(document: Document, trajectory: Any) -> Any:
    """Return a ``trajectory:`` section with the content of its table, if it is one.

    Args:
        document: The experiment's file, for messages.
        trajectory: The section.

    Raises:
        SpecError: If there is no such file, or something is wrong with it.
    """
    if not isinstance(trajectory, TableSettings):
        return trajectory
    from tcrctl.trajectory.table import table_samples  # heavy
    from tcrctl.trajectory.table_files import read_bytes

    folder = Path() if document.is_override(KEYS) else Path(document.name).parent
    path = folder / Path(trajectory.file).expanduser()
    try:
        found = trajectory.with_content(read_bytes(path))
        table_samples(found)
    except SpecError:
        raise
    except InputError as error:
        document.refuse([(KEYS, f"{error} {error.hint}".strip())])
    return found


def table_file(trajectory: Any) -> dict[str, bytes]:
    """Return the file that a section needs, by the name under which a run keeps it; empty if it needs none."""
    if not isinstance(trajectory, TableSettings):
        return {}
    return {kept_name(trajectory.file): trajectory.content}


def kept_name(file: str) -> str:
    """Return the name under which a run keeps a table."""
    return f"trajectory{Path(file).suffix.lower()}"

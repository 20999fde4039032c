"""What pictures show of the task of a logged run."""

from __future__ import annotations

import json
from typing import Final

from tcrctl.errors import TcrctlError
from tcrctl.log.drawing import Drawing
from tcrctl.log.file_names import RESOLVED
from tcrctl.log.reader import Log
from tcrctl.log.run_files import RunFiles

_NOTHING: Final = Drawing()


def read_drawing(log: Log) -> Drawing:
    """Return what is drawn of a task; nothing if there is none that this version understands."""
    # pydantic is slow to import, and most runs have no task
    files = RunFiles(log)
    data = files.data(RESOLVED)
    section = data.get("task") if isinstance(data, dict) else None
    if not isinstance(section, dict):
        return _NOTHING
    from pydantic import TypeAdapter, ValidationError

    from tcrctl.task.settings import TaskSettings
    from tcrctl.task.task import task_drawing

    try:
        return task_drawing(TypeAdapter(TaskSettings).validate_json(json.dumps(section)))
    except (ValidationError, TcrctlError, ValueError):
        return _NOTHING

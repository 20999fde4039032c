"""The folder of results: robot file, report, figure and the identification as given."""

from __future__ import annotations

import json
from pathlib import Path

from tcrctl.config import strict_yaml
from tcrctl.experiment.provenance import versions
from tcrctl.experiment.run_folder import make_run_folder
from tcrctl.identify.figure import save_figure
from tcrctl.identify.loading import LoadedIdentification
from tcrctl.identify.result import Result
from tcrctl.identify.robot_file import robot_text
from tcrctl.log.file_names import RESOLVED, ROBOT, SPEC

REPORT = "report.json"
FIGURE = "figure.png"


def write_results(loaded: LoadedIdentification, result: Result, out: Path) -> tuple[Path, Path]:
    """Write everything into a new folder.

    Args:
        loaded: What was asked.
        result: What was found.
        out: Where the folder is made.

    Returns:
        Paths of the new robot file and of the figure.

    Raises:
        DeviceError: If the folder or a file cannot be written.
    """
    folder = make_run_folder(out, loaded.spec.name)
    robot, figure = folder.path / ROBOT, folder.path / FIGURE
    given = strict_yaml.read(loaded.robot_path).decode("utf-8-sig")
    folder.write(ROBOT, robot_text(given, result).encode())
    folder.write(SPEC, loaded.text)
    folder.write(RESOLVED, strict_yaml.dumps(loaded.spec.model_dump(mode="json")).encode())
    report = {**result.as_json(robot, figure), "versions": versions()}
    folder.write(REPORT, json.dumps(report, indent=2).encode())
    save_figure(result, figure)
    return robot, figure

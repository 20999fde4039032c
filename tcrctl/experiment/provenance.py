"""What a log says about where it comes from: files, versions, machine."""

from __future__ import annotations

import datetime
import importlib.metadata
import json
import os
import platform
import socket
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np

from tcrctl import __version__
from tcrctl.config import strict_yaml
from tcrctl.errors import InputError
from tcrctl.experiment.plant_robot import description_of_plant
from tcrctl.experiment.plugged import origins
from tcrctl.experiment.spec import ExperimentSpec, LoadedSpec
from tcrctl.experiment.table_file import table_file
from tcrctl.log.file_names import (
    CAMERAS,
    DESIGNED,
    PLANT_ROBOT,
    PLUGINS,
    RESOLVED,
    RIG,
    ROBOT,
    SPEC,
    VERSIONS,
)
from tcrctl.plant.cameras import draw_cameras
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.plugins.origin import Origin
from tcrctl.plugins.source import package_digest
from tcrctl.robot.module import ring_rows

#: Before the name of an attached file of code.
PLUGIN_FILE: Final = "plugin."
_PACKAGES: Final = (
    "foxglove-schemas-protobuf",
    "llvmlite",
    "mcap",
    "numba",
    "numpy",
    "protobuf",
    "pydantic",
    "pyyaml",
    "scipy",
)


def resolved_text(spec: ExperimentSpec) -> bytes:
    """Write an experiment as a file with every default filled in and ``--set`` applied."""
    return strict_yaml.dumps(spec.model_dump(mode="json")).encode()


def own_files(loaded: LoadedSpec, spec: ExperimentSpec) -> dict[str, bytes]:
    """Files that a run's folder holds, so that it can be done again from there: :mod:`tcrctl.experiment.again`.

    Args:
        loaded: The experiment as it was given.
        spec: As it runs.

    Raises:
        InputError: If the robot's file has gone.
    """
    files = {
        SPEC: loaded.given_text,
        RESOLVED: resolved_text(spec),
        ROBOT: strict_yaml.read(loaded.robot_path),
    }
    if loaded.rig is not None:
        files[RIG] = loaded.rig.given
    for name, (_, content) in plugin_files(_all_origins(loaded, spec)).items():
        files[name.removeprefix(PLUGIN_FILE)] = content
    files |= table_file(spec.trajectory)
    named = isinstance(spec.plant, SimulatedSettings) and isinstance(spec.plant.robot, str)
    if named and loaded.plant_robot is not None:
        files[DESIGNED] = strict_yaml.dumps(loaded.plant_robot.model_dump(mode="json")).encode()
    return files


def attachments(loaded: LoadedSpec, spec: ExperimentSpec) -> dict[str, tuple[str, bytes]]:
    """Return the media type and content of the files that a log carries, by name.

    Args:
        loaded: The experiment as it was given.
        spec: As it runs.

    Raises:
        InputError: If the robot's file has gone.
    """
    rig = {} if loaded.rig is None else {RIG: ("application/yaml", loaded.rig.given)}
    return {
        SPEC: ("application/yaml", loaded.given_text),
        RESOLVED: ("application/yaml", resolved_text(spec)),
        ROBOT: ("application/yaml", strict_yaml.read(loaded.robot_path)),
        **rig,
        **_drawn(loaded, spec),
        **plugin_files(_all_origins(loaded, spec)),
        **{name: ("application/octet-stream", data) for name, data in table_file(spec.trajectory).items()},
        VERSIONS: ("application/json", json.dumps(versions(), indent=2).encode()),
    }


def _all_origins(loaded: LoadedSpec, spec: ExperimentSpec) -> tuple[Origin, ...]:
    return (*origins(spec), *(() if loaded.rig is None else loaded.rig.origins))


def plugin_files(found: Sequence[Origin]) -> dict[str, tuple[str, bytes]]:
    """Return a table of where kinds come from that are not built in, and the text of those that are files.

    Raises:
        InputError: If two different files have the same name.
    """
    if not found:
        return {}
    texts: dict[str, tuple[str, bytes]] = {}
    for origin in found:
        name = PLUGIN_FILE + Path(origin.file).name
        if origin.text and texts.setdefault(name, ("text/x-python", origin.text))[1] != origin.text:
            raise InputError(f"{origin.what}: another kind comes from another file of the same name")
    table = json.dumps([origin.as_json() for origin in found], indent=2).encode()
    return {PLUGINS: ("application/json", table), **texts}


def _drawn(loaded: LoadedSpec, spec: ExperimentSpec) -> dict[str, tuple[str, bytes]]:
    """Return what a simulated plant is, as far as the experiment only says how it is drawn."""
    files: dict[str, tuple[str, bytes]] = {}
    if not isinstance(spec.plant, SimulatedSettings):
        return files
    own = description_of_plant(spec.plant, loaded.robot, loaded.plant_robot, spec.seed)
    if own is not None:
        files[PLANT_ROBOT] = ("application/yaml", strict_yaml.dumps(own.model_dump(mode="json")).encode())
    if spec.plant.cameras is not None:
        rows = ring_rows(loaded.robot.modules.count)
        draw = draw_cameras(spec.plant.cameras, len(rows), spec.seed)
        values = {
            "marker_bias_mm": (1e3 * draw.bias).tolist(),
            "frame_rotation_deg": np.degrees(draw.rotation).tolist(),
            "frame_translation_mm": (1e3 * draw.translation).tolist(),
        }
        files[CAMERAS] = ("application/json", json.dumps(values, indent=2).encode())
    return files


def versions() -> dict[str, str]:
    """Return versions of everything that the numbers of a run depend on, and a digest of this program's source."""
    import llvmlite.binding as llvm  # heavy

    cpu = llvm.get_host_cpu_name()  # type: ignore[no-untyped-call]  # decides what kernels are compiled to
    found = {
        "tcrctl": __version__,
        "source_sha256": source_digest(),
        "python": sys.version.split()[0],
        "platform": platform.platform(),
        "processor": processor(),
        "cpu": cpu,
        "numba_opt": os.environ.get("NUMBA_OPT", "default"),
    }
    for package in _PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "unknown"
    return found


def processor() -> str:
    """Return the model name of the processor, or of its kind if the system does not say."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    named = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    return named or platform.processor() or platform.machine()


@cache
def source_digest() -> str:
    """Return the digest of this program's Python files."""
    return package_digest(Path(__file__).parents[1])


def start_metadata(
    run_id: str, loaded: LoadedSpec, spec: ExperimentSpec, *, realtime: bool
) -> Mapping[str, str]:
    """Say who, when and what, for the start record of a log."""
    return {
        "run_id": run_id,
        "spec": spec.name,
        "robot": loaded.robot.name,
        "plant": spec.plant.kind,
        "controller": spec.controller.kind,
        "estimator": spec.estimator.kind,
        "seed": str(spec.seed),
        "overrides": json.dumps(loaded.overrides),
        "realtime": json.dumps(realtime),
        "started": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "host": socket.gethostname(),
        "version": __version__,
    }

"""Names of the files that a run leaves in its log; see :mod:`tcrctl.log.run_files`."""

from __future__ import annotations

from typing import Final

SPEC: Final = "spec.yaml"
RESOLVED: Final = "spec.resolved.yaml"
ROBOT: Final = "robot.yaml"
PLANT_ROBOT: Final = "plant_robot.yaml"
DESIGNED: Final = "plant_robot.designed.yaml"
CAMERAS: Final = "plant_cameras.json"
RIG: Final = "rig.yaml"
VERSIONS: Final = "versions.json"
PLUGINS: Final = "plugins.json"

"""``tcrctl accuracy LOG...``: how well were poses and paths attained, in the measures of ISO 9283?"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

from tcrctl.cli.log_file import LogFiles
from tcrctl.cli.options import AsJson

if TYPE_CHECKING:
    from tcrctl.analysis.accuracy import Accuracy

_POSE = ("pose", "visits", "from", "AP [mm]", "RP [mm]", "vAP [mm]", "dAP [mm]")
_ANGLE = ("AP [deg]", "RP [deg]", "vAP [deg]", "dAP [deg]")
_PATH = ("path", "passes", "AT [mm]", "RT [mm]")


def accuracy(logs: LogFiles, as_json: AsJson = False) -> None:
    """Measure how well the end attained its poses, in the measures of ISO 9283.

    A pose is where the reference stands for 0.8 s; what is attained there is the mean of the last 0.5 s. Several
    logs count as repetitions. AP: pose accuracy. RP: repeatability. vAP: between directions of approach. dAP:
    drift, from the first third of the visits to the last. AT, RT: the same of the paths between poses.

    Examples:
      tcrctl run pose_accuracy && tcrctl accuracy logs/latest
      tcrctl accuracy logs/*_pose_accuracy_*/
      tcrctl accuracy logs/latest --json | jq '.poses[].repeatability_mm'
    """
    from tcrctl.analysis.accuracy import accuracy_of
    from tcrctl.analysis.history import read_histories

    found = accuracy_of(read_histories(logs))
    if as_json:
        print(json.dumps(found.as_json()))
    else:
        _print(found)


def _print(found: Accuracy) -> None:
    from tcrctl.cli.table import print_table

    oriented = any(math.isfinite(pose.accuracy_deg) for pose in found.poses)
    titles = (*_POSE, *(_ANGLE if oriented else ()))
    rows = []
    for pose in found.poses:
        lengths = (pose.accuracy_mm, pose.repeatability_mm, pose.variation_mm, pose.drift_mm)
        angles = (pose.accuracy_deg, pose.repeatability_deg, pose.variation_deg, pose.drift_deg)
        numbers = [_number(value) for value in (*lengths, *(angles if oriented else ()))]
        rows.append((str(pose.pose), str(pose.visits), str(pose.directions), *numbers))
    print_table(titles, rows, right=range(len(titles)))
    paths = [
        (
            f"{path.origin} to {path.pose}",
            str(path.passes),
            _number(path.accuracy_mm),
            _number(path.repeatability_mm),
        )
        for path in found.paths
    ]
    print_table(_PATH, paths, right=range(1, len(_PATH)))
    print("of the end as it truly was" if found.true else "of the end as it was estimated")


def _number(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "-"

"""``tcrctl identify --calibrate LOG`` and ``--design SPEC``: self-calibration and the choice of its poses."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tcrctl.cli.progress import progress_bar

if TYPE_CHECKING:
    from tcrctl.identify.calibration.result import CalibrationResult, Errors
    from tcrctl.identify.calibration.settings import SelfCalibrationSpec

Say = Callable[[str], None]


def calibrate_log(
    log: str, changes: Sequence[str], out: Path, say: Say, as_json: bool, *, quiet: bool
) -> int:
    """Find robot, cameras and drives of a log; return the exit code."""
    from tcrctl.experiment.run_folder import log_in
    from tcrctl.identify.calibration.files import write_calibration
    from tcrctl.identify.calibration.self_calibration import calibrate

    with progress_bar("steps", shown=not quiet) as progress:
        found = calibrate(log_in(Path(log)), _assumed(changes), say, progress)
    robot, calibration = write_calibration(found, out)
    if as_json:
        print(json.dumps(found.result.as_json(robot, calibration)))
    else:
        _print(found.result)
        setting = shlex.quote(f"estimator.calibration={calibration}")
        print(f"next run: tcrctl run SPEC --set {setting}")
        print(f"the robot as it was found, to look at or to try as robot: {robot}")
    return 0 if found.result.fit.converged else 1


def design_poses(
    name: str, changes: Sequence[str], out: Path, say: Say, as_json: bool, *, quiet: bool
) -> int:
    """Choose the poses of an excitation and write it; return the exit code."""
    from tcrctl.identify.calibration.designed import design_excitation

    with progress_bar("candidates", shown=not quiet) as progress:
        designed = design_excitation(name, _assumed(changes), out, say, progress)
    if as_json:
        print(json.dumps(designed.as_json()))
    else:
        print(
            f"{designed.poses} of {designed.candidates} poses: information {designed.information:.1f}, "
            f"{designed.drawn:.1f} if drawn (log det over that of the prior)"
        )
        print(f"next: tcrctl run {shlex.quote(str(designed.path))}")
    return 0


def _assumed(changes: Sequence[str]) -> SelfCalibrationSpec:
    from tcrctl.config import strict_yaml
    from tcrctl.identify.calibration.settings import SelfCalibrationSpec

    document = strict_yaml.placed("command line", {"kind": "self_calibration"}, {})
    for assignment in changes:
        document = strict_yaml.override(document, assignment)
    return strict_yaml.validate(document, SelfCalibrationSpec)


def _print(result: CalibrationResult) -> None:
    from tcrctl.cli.table import print_facts
    from tcrctl.experiment.headline import count

    said = ((result.rests, "rest"), (len(result.unknowns), "unknown"), (result.fit.iterations, "step"))
    print(", ".join(count(*each) for each in said))
    rows = [
        ("as described", _distances(result.before)),
        ("found", _distances(result.after)),
        ("held out, as described", _distances(result.held_out_before)),
        ("held out, found from the others", _distances(result.held_out)),
    ]
    for name, entry in result.values().items():
        if name.split(".")[0] in SHOWN:
            rows.append((name, f"{entry['value']:.4f} +- {entry['std']:.4f} {_unit(entry)}".rstrip()))
    if result.rubbing.coefficient.size:
        rows.append(("friction", ", ".join(f"{mu:.3f}" for mu in result.rubbing.coefficient)))
    drives = result.drives
    rows.append(("drives", f"lag {1e3 * drives.lag:.1f} ms, dead time {1e3 * drives.dead_time:.1f} ms"))
    rows += [("not told", sentence) for sentence in (*result.undetermined, *result.moving_together)]
    print_facts((name, text, "") for name, text in rows)


#: Groups that are printed one by one; all are in the report.
SHOWN = (
    "springs",
    "density",
    "tension",
    "zeros",
    "radius",
    "tilt",
    "backlash",
    "frame_rotation",
    "frame_translation",
)


def _distances(errors: Errors) -> str:
    return (
        f"markers {errors.markers:.2f} mm rms, end {errors.end_mean:.2f} mm on the mean, "
        f"{errors.end_max:.2f} mm at most"
    )


def _unit(entry: dict[str, Any]) -> str:
    return "" if entry["unit"] == "1" else str(entry["unit"])

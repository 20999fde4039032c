"""Studies of runs that take a quarter of a second: a short letter with a coarse plant."""

from __future__ import annotations

from support.short_runs import SHORT
from tcrctl.config import strict_yaml
from tcrctl.study.loading import load_study

QUICK = {key: strict_yaml.loads(text).data for key, _, text in (item.partition("=") for item in SHORT)}
QUICK["plant.step_ms"] = 10.0
SOFT = "plant.mismatch.springs_youngs_modulus"


def study_file(folder, **changes):
    """Write a study; its name."""
    data = {"kind": "study", "name": "quick", "experiments": ["letter_t"], "set": QUICK, **changes}
    path = folder / "quick.yaml"
    path.write_text(strict_yaml.dumps({key: value for key, value in data.items() if value is not None}))
    return path


def quick_study(folder, **changes):
    return load_study(str(study_file(folder, **changes)))

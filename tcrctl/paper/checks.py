"""Measurements that are no experiments: Table II by statics, the time of steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from tcrctl.paper.step_times import step_times
from tcrctl.paper.table2 import measured_displacements, model_displacements
from tcrctl.robot.description import load_robot
from tcrctl.robot.robot import build_robot


def table2() -> dict[str, Any]:
    """Return the distance of the end displacements of tcr700 from those measured, Table II of [TCR]."""
    measured = measured_displacements()
    found = model_displacements(build_robot(load_robot("tcr700")))
    errors = {name: 1e3 * float(np.linalg.norm(found[name] - measured[name])) for name in measured}
    return {"error_mm": errors, "mean_error_mm": float(np.mean(list(errors.values())))}


CHECKS: Final[Mapping[str, Callable[[], dict[str, Any]]]] = {"table2": table2, "step_times": step_times}

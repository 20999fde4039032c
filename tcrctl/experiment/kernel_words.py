"""Which settings decide what kernels a run needs: kinds of parts, and sections that are there or not.

The list of kernels (:mod:`tcrctl.kernels.needed`) has the same words.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from tcrctl.experiment.spec import ExperimentSpec
from tcrctl.robot.description import RobotDescription

#: Sections of an experiment that hold settings of its parts.
_PARTS: Final = ("controller", "estimator", "plant", "task", "trajectory")
#: Keys whose value says which code runs, wherever they stand.
_CHOICES: Final = ("kind", "model", "output", "reports", "corner")


def kernel_words(spec: ExperimentSpec, robot: RobotDescription) -> frozenset[str]:
    """Return words such as ``controller.kind: ioc`` and ``plant.friction``.

    Args:
        spec: The experiment, with what was drawn.
        robot: The robot that the controller knows.
    """
    told = {name: getattr(spec, name) for name in _PARTS}
    parts = {name: part.model_dump() for name, part in told.items() if part is not None}
    return frozenset(_words({**parts, "robot": robot.model_dump()}, ""))


def _words(section: Mapping[str, Any], prefix: str) -> Iterator[str]:
    for key, value in section.items():
        path = f"{prefix}{key}"
        if key in _CHOICES and isinstance(value, str):
            yield f"{path}: {value}"
        elif isinstance(value, Mapping):
            yield path
            yield from _words(value, f"{path}.")

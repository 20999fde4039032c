"""The result of a run in words: terminal, report and ``info`` all say it with these lines.

Which numbers come first depends on what was wanted: the orientation only where one was, the angles of (45) only
where they are defined, and never one component of the position alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from tcrctl.experiment.summary import UNITS

#: Name in words, and whether it stands in the first row; in the order in which they are said.
_NAMES: Final[Mapping[str, tuple[str, bool]]] = {
    "position_error_mm": ("position error", True),
    "orientation_error_deg": ("orientation error", True),
    "tension_n": ("cable tension", True),
    "control_ms": ("control time", True),
    "latency_ms": ("camera to drive", True),
    "saturated_fraction": ("drives at their speed limit", True),
    "x_error_mm": ("position error along x", False),
    "theta_x_error_rad": ("theta_x error", False),
    "theta_y_error_rad": ("theta_y error", False),
    "inner_iterations": ("inner iterations", False),
    "overruns": ("overruns", False),
    "unconverged_steps": ("unconverged steps", False),
}
#: This share of overruns is no accident.
_MANY: Final = 0.05
#: Counts that matter first if they are not 0.
_TROUBLE: Final = ("overruns", "unconverged_steps")


@dataclass(frozen=True, slots=True)
class Line:
    """One quantity.

    Attributes:
        name: What it is.
        parts: Texts with units by name: ``max``, ``rms``; the name is empty if there is one number only.
        first: Whether it is one of the few to look at first.
        trouble: Whether it should not be so.
    """

    name: str
    parts: Mapping[str, str]
    first: bool
    trouble: bool = False

    @property
    def text(self) -> str:
        """All numbers in one line."""
        return ", ".join(f"{part} {said}".strip() for part, said in self.parts.items())


def number(value: Any, unit: str = "") -> str:
    """Write a value as it is written everywhere: four significant digits, and the unit.

    Args:
        value: A number, a flag, None, or something else, which is written as it is.
        unit: Unit; may be empty.
    """
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "unknown"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{f'{value:.4g}' if isinstance(value, float) else value} {unit}".rstrip()


def count(how_many: int, noun: str) -> str:
    """Write how many there are: ``1 figure``, ``2 figures``.

    Args:
        how_many: The number.
        noun: What is counted, one of them; its plural ends in s or es.
    """
    ending = "es" if noun.endswith("s") else "s"
    return f"{how_many} {noun}{'' if how_many == 1 else ending}"


def numbers(found: Mapping[str, float] | None, unit: str) -> str:
    """Write several numbers of one quantity: ``max 0.2177 mm, rms 0.1 mm``.

    Args:
        found: What :func:`tcrctl.experiment.spread.spread` found.
        unit: Unit of all of them.
    """
    if found is None:
        return "unknown"
    return ", ".join(f"{name} {number(value, unit)}" for name, value in found.items())


def headline(result: Mapping[str, Any]) -> Iterator[Line]:
    """Yield the measures of a run, what matters most first; what no step gave is left out.

    Args:
        result: Object of ``run --json``, or part of it.
    """
    for key, (name, first) in _NAMES.items():
        value = result.get(key)
        if value is None:
            continue
        trouble = key in _TROUBLE and value != 0
        yield Line(name, _parts(key, value, result), first or trouble, trouble)


def _parts(key: str, value: Any, result: Mapping[str, Any]) -> Mapping[str, str]:
    if key.startswith("theta_x") and result.get("theta_singular_fraction"):
        share = 100.0 * float(result["theta_singular_fraction"])
        return {"": f"not defined in {number(share, '%')} of the steps, where the end looks along x"}
    if key == "saturated_fraction":
        return {"": number(100.0 * float(value), "% of the steps")}
    if key == "overruns" and value and result.get("steps"):
        return {"": _overruns(value, value / result["steps"])}
    if not isinstance(value, Mapping):
        return {"": number(value, UNITS.get(key, ""))}
    return {part: number(found, UNITS.get(f"{key}.{part}", "")) for part, found in value.items()}


def _overruns(late: int, share: float) -> str:
    text = f"{count(late, 'step')}, {100.0 * share:.3g} %, began or took longer than a period too late"
    return f"{text}: this computer does not keep up" if share >= _MANY else text

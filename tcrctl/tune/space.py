"""The settings that are tuned, as a unit cube."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcrctl.config.strict_yaml import Document
from tcrctl.study.axes import RangeSettings
from tcrctl.study.settings import StudySpec


@dataclass(frozen=True, slots=True)
class Space:
    """Ranges of the settings.

    Attributes:
        axes: Range of every key.
    """

    axes: Mapping[str, RangeSettings]

    def settings(self, x: Sequence[float]) -> dict[str, Any]:
        """Return the settings at a point; what is outside the cube is put onto its side.

        Args:
            x: Coordinates (n,); further ones mean nothing.
        """
        return {
            key: _value(axis, min(max(float(u), 0.0), 1.0))
            for (key, axis), u in zip(self.axes.items(), x, strict=False)
        }

    def point(self, settings: Mapping[str, float]) -> list[float]:
        """Return where some settings stand, put into the cube (n,)."""
        return [min(max(_place(axis, settings[key]), 0.0), 1.0) for key, axis in self.axes.items()]


def space_of(spec: StudySpec, document: Document) -> Space:
    """Return the ranges that a study varies.

    Args:
        spec: The study.
        document: Its file, for messages.

    Raises:
        SpecError: If it varies anything else, or nothing.
    """
    document.refuse(
        (("vary", key), "must be a range of numbers, low and high, to be tuned")
        for key, axis in spec.vary.items()
        if not isinstance(axis, RangeSettings)
    )
    if not spec.vary:
        document.refuse([(("vary",), "says what is tuned; there is nothing")])
    if spec.cases:
        document.refuse([(("cases",), "have no meaning for tuning: candidates are its cases")])
    if spec.seeds is None:
        document.refuse([(("seeds",), "required: the plants that are tuned on")])
    return Space({key: axis for key, axis in spec.vary.items() if isinstance(axis, RangeSettings)})


def _value(axis: RangeSettings, u: float) -> float:
    ratio = axis.high / axis.low if axis.scale == "log" else 1.0
    gap = axis.high - axis.low
    value = axis.low * ratio**u if axis.scale == "log" else axis.low + u * gap
    return round(value) if axis.whole else float(f"{value:.4g}")


def _place(axis: RangeSettings, value: float) -> float:
    if axis.scale == "log":
        return math.log(max(value, np.finfo(float).tiny) / axis.low) / math.log(axis.high / axis.low)
    return (value - axis.low) / (axis.high - axis.low)

"""Marks of runs on lanes, one lane per group, with a box from quartile to quartile: an SVG that needs no script."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Final

import numpy as np

#: Sizes in the picture's own units.
WIDTH: Final = 1100
LABEL: Final = 330
STOPPED: Final = 90
LANE: Final = 34
TOP: Final = 26
#: Marks of one lane are shifted up and down in turn by this.
JITTER: Final = 3.0

Mark = tuple[str, str, float]
"""Name of the place that a mark leads to, what is said of it, and its value; infinite: the run was stopped."""


def strip(lanes: Mapping[str, Sequence[Mark]]) -> str:
    """Return the picture.

    Args:
        lanes: Marks by label; at least one value is finite.
    """
    finite = [value for marks in lanes.values() for _, _, value in marks if math.isfinite(value)]
    low, high = min(0.0, *finite), max(finite)
    span = (high - low) or 1.0
    right = WIDTH - STOPPED

    def place(value: float) -> float:
        return LABEL + (right - LABEL) * (value - low) / span if math.isfinite(value) else WIDTH - STOPPED / 2

    height = TOP + LANE * len(lanes)
    parts = [f'<svg class="strip" viewBox="0 0 {WIDTH} {height}" role="img">']
    for tick in _ticks(low, high):
        x = f"{place(tick):.1f}"
        parts.append(f'<line x1="{x}" x2="{x}" y1="{TOP - 6}" y2="{height}"/>')
        parts.append(f'<text class="quiet" x="{x}" y="14" text-anchor="middle">{tick:g}</text>')
    parts.append(f'<text class="quiet" x="{WIDTH - STOPPED / 2}" y="14" text-anchor="middle">stopped</text>')
    for i, (label, marks) in enumerate(lanes.items()):
        y = TOP + LANE * (i + 0.5)
        parts.append(
            f'<text x="{LABEL - 12}" y="{y + 4:.1f}" text-anchor="end">{escape(_short(label))}</text>'
        )
        values = [value for *_, value in marks]
        left, right_side = np.quantile(values, (0.25, 0.75), method="inverted_cdf")
        parts += _box(place(left), place(float(np.median(values))), place(right_side), y)
        parts += _marks(marks, [place(value) for value in values], y)
    return "".join([*parts, "</svg>"])


def _short(label: str) -> str:
    return label if len(label) <= 50 else f"{label[:49]}…"


def _box(left: float, middle: float, right: float, y: float) -> list[str]:
    top, tall = y - 0.3 * LANE, 0.6 * LANE
    return [
        f'<rect x="{left:.1f}" y="{top:.1f}" width="{right - left:.1f}" height="{tall:.1f}"/>',
        f'<line class="median" x1="{middle:.1f}" x2="{middle:.1f}" y1="{top:.1f}" y2="{top + tall:.1f}"/>',
    ]


def _marks(marks: Sequence[Mark], places: Sequence[float], y: float) -> list[str]:
    drawn = []
    for i, ((anchor, said, value), x) in enumerate(zip(marks, places, strict=True)):
        kind = "" if math.isfinite(value) else ' class="stopped"'
        at = f'cx="{x:.1f}" cy="{y + JITTER * (i % 3 - 1):.1f}"'
        title = f"<title>{escape(said)}</title>"
        drawn.append(f'<a href="#{escape(anchor)}"{kind}><circle {at} r="4">{title}</circle></a>')
    return drawn


def _ticks(low: float, high: float) -> list[float]:
    """Return a few round values within a range."""
    rough = ((high - low) or 1.0) / 6.0
    size = 10.0 ** math.floor(math.log10(rough))
    spacing = next(m * size for m in (1.0, 2.0, 5.0, 10.0) if m * size >= rough)
    return [round(k * spacing, 12) for k in range(math.ceil(low / spacing), math.floor(high / spacing) + 1)]

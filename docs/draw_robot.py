"""Draw the picture of docs/robot.md: python docs/draw_robot.py.

What the lengths and angles of a robot file mean, on the first modules of tcr5x4.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from tcrctl.robot.description import RobotDescription, load_robot

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROBOT = "tcr5x4"
SHOWN = 2
PICTURE = Path(__file__).with_name("robot_lengths.png")
_MODULE, _SPRING, _CABLE, _SIZE = "#333333", "#2a9d8f", "#c1121f", "#1d5fa8"


def main() -> None:
    """Make the picture."""
    robot = load_robot(ROBOT)
    figure = Figure(figsize=(9, 5), layout="constrained")
    side, above = figure.subplots(1, 2, width_ratios=(1.25, 1))
    draw_side(side, robot)
    draw_ring(above, robot)
    figure.savefig(PICTURE, dpi=110)


def draw_side(axes: Axes, robot: RobotDescription) -> None:
    """Draw base, modules, springs and a cable from the side."""
    modules, radius = robot.modules, robot.modules.ring_diameter_mm / 2
    pitch, height = modules.pitch_mm, modules.cone_height_mm
    for i in range(SHOWN + 1):
        z = -i * pitch
        axes.plot([-radius, radius], [z, z], color=_MODULE, lw=3)
        for x in (-radius, radius):
            axes.plot([x, 0], [z, z - height], color=_MODULE, lw=2)
            if i < SHOWN:
                axes.plot([0, x], [z - height, z - pitch], color=_SPRING, lw=1.5, ls=(0, (2, 1)))
    lead = 0.35 * robot.cables.lead_mm
    axes.plot([radius, radius], [lead, -SHOWN * pitch], color=_CABLE, lw=1.2)
    axes.annotate(
        "a cable of cables.routes:\nthrough the holes at hole_deg",
        (radius, -12),
        (radius + 34, -18),
        **_words(_CABLE),
    )
    axes.annotate("base ring, z = 0", (-radius, 0), (-radius - 8, 14), **_words(_MODULE), ha="right")
    axes.annotate("apex", (0, -height), (-radius - 14, -height - 16), **_words(_MODULE), ha="right")
    axes.annotate(
        "springs.joint", (radius * 0.6, -height + 3), (radius + 10, -height - 12), **_words(_SPRING)
    )
    _size(axes, (-radius - 18, 0), (-radius - 18, -pitch), "pitch_mm", ha="right", dx=-3)
    _size(
        axes, (radius + 12, -2 * pitch), (radius + 12, -2 * pitch - height), "cone_height_mm", ha="left", dx=3
    )
    _size(axes, (radius + 12, lead), (radius + 12, 0), "", ha="left", dx=3)
    axes.text(radius + 15, lead / 2, "lead_mm (shorter here)", color=_SIZE, fontsize=9, va="center")
    bottom = -SHOWN * pitch - height
    _size(axes, (-radius, bottom - 10), (radius, bottom - 10), "ring_diameter_mm", ha="center", dx=0, dy=-7)
    axes.set_title("from the side")
    axes.set(aspect="equal", xlim=(-radius - 62, radius + 100), ylim=(bottom - 24, lead + 8))
    axes.axis("off")


def draw_ring(axes: Axes, robot: RobotDescription) -> None:
    """Draw a ring from above, with its nodes and the holes of the cables."""
    radius = robot.modules.ring_diameter_mm / 2
    turn = np.linspace(0, 2 * np.pi, 200)
    axes.plot(radius * np.cos(turn), radius * np.sin(turn), color=_MODULE, lw=3)
    for name, degrees in (("n1", 0), ("n2", 120), ("n3", 240)):
        x, y = radius * np.cos(np.radians(degrees)), radius * np.sin(np.radians(degrees))
        axes.plot([0, x], [0, y], color=_MODULE, lw=1.5)
        axes.plot(x, y, "o", color=_MODULE, ms=9)
        axes.text(0.72 * x + 2, 0.72 * y + (3 if y >= 0 else -4), name, color=_MODULE)
    for route in robot.cables.routes:
        degrees = getattr(route, "hole_deg", 0)
        x, y = radius * np.cos(np.radians(degrees)), radius * np.sin(np.radians(degrees))
        axes.plot(x, y, "o", color=_CABLE, mfc="white", ms=6)
        axes.text(
            1.14 * x,
            1.14 * y,
            f"{route.name}\n{degrees:g} deg",
            color=_CABLE,
            fontsize=9,
            ha="center",
            va="center",
        )
    axes.annotate(
        "",
        (0.5 * radius * np.cos(1.2), 0.5 * radius * np.sin(1.2)),
        (0.5 * radius, 0),
        arrowprops={"arrowstyle": "->", "color": _SIZE, "connectionstyle": "arc3,rad=0.35"},
    )
    axes.text(0.45 * radius, 0.3 * radius, "hole_deg", color=_SIZE, fontsize=9)
    axes.set_title("a ring from above: x to the right, y up")
    axes.set(aspect="equal", xlim=(-1.6 * radius, 1.6 * radius), ylim=(-1.4 * radius, 1.4 * radius))
    axes.axis("off")


def _words(color: str) -> dict[str, Any]:
    return {
        "color": color,
        "fontsize": 9,
        "va": "center",
        "arrowprops": {"arrowstyle": "-", "color": color, "lw": 0.6},
    }


def _size(
    axes: Axes,
    a: tuple[float, float],
    b: tuple[float, float],
    name: str,
    *,
    ha: str,
    dx: float,
    dy: float = 0.0,
) -> None:
    axes.annotate("", a, b, arrowprops={"arrowstyle": "<->", "color": _SIZE, "lw": 0.8})
    axes.text(
        (a[0] + b[0]) / 2 + dx, (a[1] + b[1]) / 2 + dy, name, color=_SIZE, fontsize=9, ha=ha, va="center"
    )


if __name__ == "__main__":
    main()

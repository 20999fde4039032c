"""Draw the picture of the README: python docs/draw_letter.py LOG docs/letter_t.png (needs matplotlib)."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from tcrctl.log.reader import read_log

BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "#999999"  # colour-blind safe


def main(log_path: str, picture: str) -> None:
    """Left: the robot and the path of its end; right: the drawing from above, and the error over time."""
    columns = read_log(Path(log_path)).columns()
    t, wanted = columns["t"], 1e3 * columns["reference_position"]
    path, q = 1e3 * columns["truth_position"], 1e3 * columns["truth_q"].reshape(len(t), -1, 3)
    error = np.linalg.norm(path - wanted, axis=1)
    figure = plt.figure(figsize=(8.0, 3.8), layout="constrained")
    grid = figure.add_gridspec(2, 3, height_ratios=[2.2, 1.0])
    body = figure.add_subplot(grid[:, 0], projection="3d")
    nodes = q[len(t) // 3].reshape(-1, 4, 3)
    for module in nodes:
        ring = module[[0, 1, 2, 0]]
        body.plot(*ring.T, color=GREY, lw=1.0)
        for node in module[:3]:
            body.plot(*np.array([node, module[3]]).T, color=GREY, lw=0.8)
    for hole in range(3):
        body.plot(*nodes[:, hole].T, color=BLUE, lw=0.8)
    body.plot(*path.T, color=ORANGE, lw=1.2)
    body.set_box_aspect((1, 1, 3.2))
    body.set(xlim=(-90, 90), ylim=(-90, 90), zticks=[-600, -300, 0], xticks=[], yticks=[])
    above = figure.add_subplot(grid[0, 1:])
    above.plot(wanted[:, 0], wanted[:, 1], color=GREY, lw=4.0, label="wanted")
    above.plot(path[:, 0], path[:, 1], color=ORANGE, lw=1.2, label="end of the robot")
    above.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    above.legend(frameon=False, loc="center left", bbox_to_anchor=(1.05, 0.5))
    below = figure.add_subplot(grid[1, 1:])
    below.plot(t, error, color=BLUE, lw=1.0)
    below.set(xlabel="t [s]", ylabel="error [mm]", xlim=(0, t[-1]), ylim=(0, None))
    figure.savefig(picture, dpi=130)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])

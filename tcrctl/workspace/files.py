"""A workspace as a table, and as a point cloud for viewers."""

from __future__ import annotations

import csv
import io
from typing import Final

import numpy as np

from tcrctl.visible import cell
from tcrctl.workspace.workspace import Workspace

#: Colours of a tilt of zero and of the largest one.
UPRIGHT, TILTED = np.array([0, 114, 178]), np.array([213, 94, 0])
_HEAD: Final = """ply
format ascii 1.0
comment end positions [m] of {robot} beside rest; colour: tilt, 0 to {most:.1f} deg
element vertex {count}
property float x
property float y
property float z
property float tilt_deg
property uchar red
property uchar green
property uchar blue
end_header
"""


def table(found: Workspace) -> str:
    """Return every point as comma-separated values, lengths in mm, tilt in deg, tensions in N."""
    drives = [cell(f"drive_{name}_mm") for name in found.cables]
    tensions = [cell(f"tension_{name}_n") for name in found.cables]
    columns = np.column_stack(
        (found.ray, 1e3 * found.offset, np.degrees(found.tilt), 1e3 * found.drive, found.tension)
    )
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(("ray", "x_mm", "y_mm", "z_mm", "tilt_deg", *drives, *tensions))
    writer.writerows((int(row[0]), *(f"{v:.6g}" for v in row[1:])) for row in columns)
    return stream.getvalue()


def point_cloud(found: Workspace) -> str:
    """Return the end positions as a coloured point cloud in PLY, which 3-D viewers open."""
    tilt = np.degrees(found.tilt)
    most = float(tilt.max()) or 1.0
    colour = np.rint(UPRIGHT + (tilt / most)[:, None] * (TILTED - UPRIGHT)).astype(int)
    head = _HEAD.format(robot=found.robot, most=most, count=tilt.size)
    lines = (
        f"{x:.6f} {y:.6f} {z:.6f} {t:.3f} {r} {g} {b}"
        for (x, y, z), t, (r, g, b) in zip(found.offset, tilt, colour, strict=True)
    )
    return head + "\n".join(lines) + "\n"

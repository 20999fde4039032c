"""Where the angles of (45) say nothing: theta_x is the direction of the end axis seen along x.

An end that looks along x has none. Near it a small error of the orientation is a large one of theta_x, by
1 / sqrt(n_y^2 + n_z^2), and means nothing for the task: the orientation error is the number to look at.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.signals import Array

#: An error of theta_x may be ten times that of the orientation and no more; within 5.7 deg of x it is.
LEAST: Final = 0.1


def is_singular(normal: Array) -> NDArray[np.bool_]:
    """Tell where theta_x exaggerates errors more than tenfold.

    Args:
        normal: Unit normals (..., 3); rows of NaN are not singular.

    Returns:
        (...,).
    """
    near: NDArray[np.bool_] = np.hypot(normal[..., 1], normal[..., 2]) < LEAST
    return near

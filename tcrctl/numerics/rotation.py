"""Rotations and directions: unit quaternions (w, x, y, z), unit vectors, the angles of (45).

Kernels: arrays in, arrays out, no checks. A quaternion q and -q are the same rotation. Directions are unit
vectors; between opposite directions every half great circle is shortest and one of them is taken.
"""

from __future__ import annotations

import math

import numpy as np

from tcrctl.numerics.kernel import kernel, part
from tcrctl.signals import Array

SMALL = 1e-5  # below, sin(x)/x and its inverse are 1 -+ x^2/6 to machine precision


@part()
def norm(vector: Array) -> float:
    """Return the Euclidean length of a vector (n,)."""
    total = 0.0
    for value in vector:
        total += value * value
    return math.sqrt(total)


@part()
def cross(a: Array, b: Array) -> Array:
    """Return the vector product of a and b (3,); numpy's own takes seconds to compile."""
    return np.array(
        (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]),
    )


@part()
def quaternion_multiply(a: Array, b: Array) -> Array:
    """Return the rotation b followed by a, both (4,)."""
    return np.array(
        (
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        )
    )


@part()
def quaternion_conjugate(q: Array) -> Array:
    """Return the inverse rotation (4,)."""
    return np.array((q[0], -q[1], -q[2], -q[3]))


@kernel()
def quaternion_exp(rotation: Array) -> Array:
    """Return the quaternion (4,) of a rotation vector: axis times angle (3,) [rad]."""
    angle = norm(rotation)
    half = 0.5 * angle
    scale = math.sin(half) / angle if half > SMALL else 0.5 - half * half / 12.0
    return np.array((math.cos(half), scale * rotation[0], scale * rotation[1], scale * rotation[2]))


@kernel()
def quaternion_log(q: Array) -> Array:
    """Return the shortest rotation vector (3,), angle at most pi [rad], of a unit quaternion (4,)."""
    sine = math.sqrt(q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    side = -1.0 if q[0] < 0.0 else 1.0
    cosine = side * q[0]
    half = math.atan2(sine, cosine)
    scale = side * 2.0 * (half / sine if half > SMALL else 1.0 + half * half / 6.0)
    return np.array((scale * q[1], scale * q[2], scale * q[3]))


@kernel()
def matrix_from_quaternion(q: Array) -> Array:
    """Return the rotation matrix (3, 3) of a unit quaternion (4,)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return np.array(
        (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
    )


@part()
def quaternion_from_matrix(R: Array) -> Array:
    """Return the unit quaternion (4,) of a rotation matrix (3, 3), from its largest component."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    # the components are sqrt(1 + trace) / 2 and sqrt(1 + 2 R[i, i] - trace) / 2
    if trace >= max(R[0, 0], R[1, 1], R[2, 2]):
        full = np.array((1.0 + trace, x, y, z))
    elif R[0, 0] >= max(R[1, 1], R[2, 2]):
        full = np.array((x, 1.0 + 2.0 * R[0, 0] - trace, R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]))
    elif R[1, 1] >= R[2, 2]:
        full = np.array((y, R[0, 1] + R[1, 0], 1.0 + 2.0 * R[1, 1] - trace, R[1, 2] + R[2, 1]))
    else:
        full = np.array((z, R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], 1.0 + 2.0 * R[2, 2] - trace))
    return full / norm(full)


@part()
def perpendicular(n: Array) -> Array:
    """Return some unit vector (3,) perpendicular to a unit vector (3,)."""
    x, y, z = abs(n[0]), abs(n[1]), abs(n[2])
    axis = np.zeros(3)
    axis[0 if x <= y and x <= z else (1 if y <= z else 2)] = 1.0
    across = cross(n, axis)
    return across / norm(across)


@kernel()
def angle_between(a: Array, b: Array) -> float:
    """Return the angle between unit vectors of any dimension [rad]; as exact near 0 and pi as between."""
    return 2.0 * math.atan2(norm(a - b), norm(a + b))


@kernel()
def towards(start: Array, end: Array) -> Array:
    """Return the unit vector (3,) perpendicular to ``start`` in which the way to ``end`` begins.

    Built by two cross products: exactly perpendicular even where start and end are nearly (anti)parallel.
    """
    across = cross(cross(start, end), start)
    length = norm(across)
    return across / length if length > 0.0 else perpendicular(start)


@kernel()
def rotation_between(n0: Array, n1: Array) -> Array:
    """Return the shortest rotation (4,) that takes the unit vector n0 to n1, both (3,), without twist."""
    return quaternion_exp(angle_between(n0, n1) * cross(n0, towards(n0, n1)))


@kernel()
def slerp(start: Array, end: Array, fraction: Array) -> Array:
    """Go from one unit vector to another along the great circle at constant speed.

    Args:
        start: Unit vector (3,).
        end: Unit vector (3,).
        fraction: 0 at the start, 1 at the end (n,).

    Returns:
        Unit vectors (n, 3).
    """
    angle, across = angle_between(start, end), towards(start, end)
    result = np.empty((fraction.size, 3))
    for i in range(fraction.size):
        cosine, sine = math.cos(fraction[i] * angle), math.sin(fraction[i] * angle)
        for j in range(3):
            result[i, j] = cosine * start[j] + sine * across[j]
    return result


@part()
def quaternion_slerp(start: Array, end: Array, fraction: Array) -> Array:
    """Turn from one orientation to another about a fixed axis at constant speed, the short way.

    Args:
        start: Unit quaternion (4,).
        end: Unit quaternion (4,).
        fraction: 0 at the start, 1 at the end (n,).

    Returns:
        Unit quaternions (n, 4).
    """
    rotation = quaternion_log(quaternion_multiply(end, quaternion_conjugate(start)))
    result = np.empty((fraction.size, 4))
    for i in range(fraction.size):
        turned = quaternion_multiply(quaternion_exp(fraction[i] * rotation), start)
        for j in range(4):
            result[i, j] = turned[j]
    return result


@kernel()
def normal_from_angles(theta_x: float, theta_y: float) -> Array:
    """Return the end normal (3,) of the orientation angles [rad], (45) with the normal +z at rest."""
    return np.array(
        (
            math.sin(theta_y),
            -math.cos(theta_y) * math.sin(theta_x),
            math.cos(theta_y) * math.cos(theta_x),
        )
    )


@kernel()
def angles_from_normal(n: Array) -> tuple[float, float]:
    """Solve (45) for the orientation angles of a unit normal (3,).

    Returns:
        theta_x in ±pi and theta_y in ±pi/2 [rad], both 0 for +z. At n = ±x any theta_x would do.
    """
    return math.atan2(-n[1], n[2]), math.atan2(n[0], math.hypot(n[1], n[2]))

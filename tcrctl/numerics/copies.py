"""Copies between arrays in plain loops, for kernels.

An assignment of one array to a slice of another would compile numba's words for shapes that do not fit, too: a
second and a half of a first run.
"""

from __future__ import annotations

from tcrctl.numerics.kernel import part
from tcrctl.signals import Array


@part(error_model="numpy")
def copy_vector(source: Array, target: Array) -> None:
    """Fill target (n,) with source (n,)."""
    for i in range(source.shape[0]):
        target[i] = source[i]


@part(error_model="numpy")
def copy_rows(source: Array, target: Array) -> None:
    """Fill target (n, r) with source (n, r)."""
    for i in range(source.shape[0]):
        for c in range(source.shape[1]):
            target[i, c] = source[i, c]


@part(error_model="numpy")
def scale_rows(target: Array, factor: float) -> None:
    """Multiply target (n, r) by a number."""
    for i in range(target.shape[0]):
        for c in range(target.shape[1]):
            target[i, c] *= factor

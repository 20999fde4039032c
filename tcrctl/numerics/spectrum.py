"""Largest eigenvalues of the Jacobian of a map that can only be evaluated.

The product of the Jacobian with a vector is a difference of the map, so a system of thousands of unknowns costs
some hundred evaluations. Implicitly restarted Arnoldi iteration [LSY98] through ``scipy.sparse.linalg.eigs``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcrctl.signals import Array

#: Jacobians of up to this many columns are written out.
DENSE = 32
#: Arnoldi vectors before the first restart. Lightly damped modes lie side by side on one circle; with fewer vectors
#: than it takes to tell them apart, the largest Ritz value of such a (non-normal) system lies beyond all of them.
VECTORS = 140
RESTARTS = 3
#: Relative accuracy of the eigenvalues.
TOLERANCE = 1e-5

Map = Callable[[Array], Array]


class Spectrum(NamedTuple):
    """The largest eigenvalues.

    Attributes:
        eigenvalues: Largest magnitude first (count,) complex; fewer if not all were found.
        products: Products with the Jacobian that it took.
        converged: All that were wanted were found to the tolerance.
    """

    eigenvalues: NDArray[np.complex128]
    products: int
    converged: bool

    @property
    def radius(self) -> float:
        """Spectral radius; NaN if no eigenvalue was found."""
        return float(np.abs(self.eigenvalues[0])) if self.eigenvalues.size else np.nan


def derivative(apply: Map, size: int, deviation: float, *, central: bool = False) -> Map:
    """Return the product of the Jacobian of a map at 0 with a vector, by differences.

    Args:
        apply: The map from deviations (size,) to images.
        size: Number of its arguments.
        deviation: Its length, that the difference is taken over.
        central: Two-sided: twice the work, errors of second order in the deviation.
    """
    base = None if central else apply(np.zeros(size))

    def product(w: Array) -> Array:
        length = float(np.linalg.norm(w))
        if length == 0.0:
            return np.zeros(size)
        reach = deviation / length
        if base is None:
            return (apply(reach * w) - apply(-reach * w)) / (2.0 * reach)
        return (apply(reach * w) - base) / reach

    return product


def jacobian(apply: Map, size: int, deviation: float) -> Array:
    """Return a map's Jacobian at 0, column by column, by central differences; arguments as :func:`derivative`."""
    return _columns(derivative(apply, size, deviation, central=True), size)


def largest_eigenvalues(product: Map, start: Array, count: int = 4) -> Spectrum:
    """Find the eigenvalues of largest magnitude of a linear map.

    Args:
        product: The linear map, (n,) to (n,).
        start: Start vector (n,); it should hold a part of every direction that matters.
        count: How many are wanted, at most n - 2 where n > DENSE.
    """
    size = start.size
    if size <= DENSE:
        matrix = _columns(product, size)
        found = (
            _sorted(np.linalg.eigvals(matrix).astype(np.complex128)) if np.isfinite(matrix).all() else _NONE
        )
        return Spectrum(found[:count], size, found.size > 0)
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

    products = 0

    def counted(w: Array) -> Array:
        nonlocal products
        products += 1
        return product(w.ravel())

    operator = LinearOperator((size, size), matvec=counted, dtype=np.float64)  # type: ignore[call-arg,misc,no-untyped-call]
    vectors, converged = min(VECTORS, size - 1), True
    try:
        found = eigs(  # type: ignore[no-untyped-call]
            operator,
            k=count,
            v0=start,
            ncv=vectors,
            maxiter=RESTARTS,
            tol=TOLERANCE,
            return_eigenvectors=False,
        )
    except ArpackNoConvergence as error:
        found, converged = error.eigenvalues, False
    return Spectrum(_sorted(found), products, converged)


def _columns(product: Map, size: int) -> Array:
    return np.stack([product(e) for e in np.eye(size)], axis=1)


_NONE: NDArray[np.complex128] = np.zeros(0, dtype=np.complex128)


def _sorted(values: NDArray[np.complex128]) -> NDArray[np.complex128]:
    return values[np.argsort(-np.abs(values), kind="stable")]

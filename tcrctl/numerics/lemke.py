"""Lemke's complementary pivot method on a problem whose rows are already scaled; `lcp` is the way in.

Notation: ``p`` (n,) is the scaled q; ``C`` (n, n) is the scaled M transposed, so that column j of M lies in
one piece, the row ``C[j]``. ``T`` (n + 1, n) is the tableau, transposed for the same reason: row 0 is B^-1 p,
row 1 + k is column k of B^-1, where the basis matrix B has a column of I for each basic w, of -M for each
basic z and -1 everywhere for the artificial variable. ``basis`` (n,) names the basic variable of each row of
B^-1: w_0 .. w_{n-1} are 0 .. n - 1, z_0 .. z_{n-1} are n .. 2 n - 1, the artificial variable is 2 n.

Kernels are plain loops: they compile several times faster than the same array expressions.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.numerics.kernel import part
from tcrctl.signals import Array

Rows = NDArray[np.int64]

SOLVED: Final = 0
RAY: Final = 1
PIVOT_LIMIT: Final = 2

PIVOTS_PER_ROW: Final = 50  # one per row is usual; contrived problems need 2^n in all
EPS: Final = float(np.finfo(np.float64).eps)
NOISE: Final = 16 * EPS  # times the summands of an entry: what rounding makes of a zero
TIE: Final = 64 * EPS  # ratios this close are equal and left to the lexicographic rule
ZERO: Final = 1e-13  # the artificial variable starts near 1; below this only rounding keeps it in the basis
REFINEMENTS: Final = 2  # each multiplies the error by |I - T B|, small as long as T resembles B^-1


@part()
def pivot_to_solution(C: Array, p: Array) -> tuple[Array, Rows, int, int]:
    """Pivot from the basis of all w until the artificial variable leaves again.

    [CPS92] Sec. 4.4 with covering vector 1, made finite by the lexicographic rule of Sec. 4.9.

    Args:
        C: Scaled M transposed (n, n).
        p: Scaled q (n,).

    Returns:
        T (n + 1, n) and basis (n,) where it stopped, pivots, and SOLVED, RAY or PIVOT_LIMIT.
    """
    n = p.size
    T, basis = np.zeros((n + 1, n)), np.empty(n, np.int64)
    column, noise = np.empty(n), np.empty(n)
    for i in range(n):
        T[0, i], T[1 + i, i], basis[i], column[i] = p[i], 1.0, i, -1.0
    row, entering = _most_violated(p), 2 * n
    if row < 0:
        return T, basis, 0, SOLVED
    for pivots in range(1, PIVOTS_PER_ROW * n + 1):
        leaving, basis[row] = basis[row], entering
        _pivot(T, column, row)
        if leaving == 2 * n or _artificial(T, basis) <= ZERO:
            return T, basis, pivots, SOLVED
        entering = (leaving + n) % (2 * n)  # the complement of what left
        _enter(T, C, basis, entering, column, noise)
        row = _leaving_row(T, column, noise, basis)
        if row < 0:
            return T, basis, pivots, RAY
    return T, basis, PIVOTS_PER_ROW * n, PIVOT_LIMIT


@part()
def _artificial(T: Array, basis: Rows) -> float:
    """Return the value of the artificial variable."""
    for i in range(basis.size):
        if basis[i] == 2 * basis.size:
            return float(T[0, i])
    return 0.0


@part()
def _most_violated(p: Array) -> int:
    """Return the row of the smallest negative entry, the last of equals (lexicographic), or -1."""
    row, least = -1, 0.0
    for i in range(p.size):
        if p[i] < 0.0 and p[i] <= least:
            row, least = i, p[i]
    return row


@part()
def _enter(T: Array, C: Array, basis: Rows, entering: int, column: Array, noise: Array) -> None:
    """Solve B column = entering column of [I, -M]; ``noise`` (n,) bounds the rounding error of each entry.

    A zero entry taken for a pivot wrecks the basis, and with rank-deficient M most entries are zeros. One
    step of refinement therefore removes the errors of T, and what remains is in proportion to
    |B^-1| (|wanted| + |B| |column|).
    """
    n = column.size
    wanted, size = np.zeros(n), np.zeros(n)
    for i in range(n):
        if entering >= n:
            wanted[i] = -C[entering - n, i]
        elif entering == i:
            wanted[i] = 1.0
        size[i] = abs(wanted[i])
        column[i], noise[i] = 0.0, 0.0
    _add_product(T, wanted, column)
    _subtract_basis_product(C, basis, column, wanted, size)
    _add_product(T, wanted, column)
    for k in range(n):
        if size[k] != 0.0:
            for i in range(n):
                noise[i] += NOISE * size[k] * abs(T[1 + k, i])


@part()
def _add_product(T: Array, y: Array, x: Array) -> None:
    """Add B^-1 y to x (n,)."""
    for k in range(y.size):
        if y[k] != 0.0:
            for i in range(x.size):
                x[i] += T[1 + k, i] * y[k]


@part()
def _subtract_basis_product(C: Array, basis: Rows, x: Array, y: Array, size: Array) -> None:
    """Subtract B x from y (n,) and add |B| |x| to size (n,)."""
    n = x.size
    for i in range(n):
        if basis[i] < n:
            y[basis[i]] -= x[i]
            size[basis[i]] += abs(x[i])
        elif basis[i] < 2 * n:
            for k in range(n):
                term = C[basis[i] - n, k] * x[i]
                y[k] += term
                size[k] += abs(term)
        else:
            for k in range(n):
                y[k] += x[i]
                size[k] += abs(x[i])


@part()
def _leaving_row(T: Array, column: Array, noise: Array, basis: Rows) -> int:
    """Do the lexicographic minimum ratio test on rows [B^-1 p, B^-1] / column; -1 if no row limits the step.

    Rows tie if their ratio is below every ratio after all basic values are raised by TIE (Harris), so no
    basic value falls below -TIE of itself. A tied artificial variable leaves first: that ends the method.
    """
    n, limit = column.size, np.inf
    for i in range(n):
        if column[i] > noise[i]:
            value = max(T[0, i], 0.0)
            limit = min(limit, (value + TIE * (1.0 + value)) / column[i])
    tied, count = np.empty(n, np.int64), 0
    for i in range(n):
        if column[i] > noise[i] and max(T[0, i], 0.0) / column[i] <= limit:
            if basis[i] == 2 * n:
                return i
            tied[count] = i
            count += 1
    for k in range(1, n + 1):
        if count <= 1:
            break
        count = _least_of_ties(T, k, column, tied, count)
    return tied[0] if count > 0 else -1


@part()
def _least_of_ties(T: Array, k: int, column: Array, tied: Rows, count: int) -> int:
    """Keep those of the first ``count`` rows ``tied`` whose ratio T[k] / column is least; return how many."""
    least, size = np.inf, 0.0
    for a in range(count):
        ratio = T[k, tied[a]] / column[tied[a]]
        least, size = min(least, ratio), max(size, abs(ratio))
    kept = 0
    for a in range(count):
        if T[k, tied[a]] / column[tied[a]] <= least + TIE * size:
            tied[kept] = tied[a]
            kept += 1
    return kept


@part()
def _pivot(T: Array, column: Array, row: int) -> None:
    """Update ``T`` for the basis in which the variable of ``column`` (n,) has taken ``row``."""
    for k in range(T.shape[0]):
        factor = T[k, row] / column[row]
        if factor != 0.0:  # most columns of B^-1 are still unit columns
            for i in range(column.size):
                T[k, i] -= factor * column[i]
            T[k, row] = factor


@part()
def refined(C: Array, p: Array, T: Array, basis: Rows) -> Array:
    """Solve B x = p for the final basis, by iterative refinement of T[0] with T as B^-1.

    Args:
        C: Scaled M transposed (n, n).
        p: Scaled q (n,).
        T: Tableau (n + 1, n) of the final basis.
        basis: Basic variable of each row (n,).

    Returns:
        Basic values x (n,), free of the errors that the pivots accumulated.
    """
    n = p.size
    x = np.empty(n)
    residual = np.empty(n)
    size = np.empty(n)
    for i in range(n):
        x[i] = T[0, i]
    for _ in range(REFINEMENTS):
        for i in range(n):
            residual[i] = p[i]
        _subtract_basis_product(C, basis, x, residual, size)
        _add_product(T, residual, x)
    return x

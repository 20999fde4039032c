"""Linear complementarity problem: find z >= 0 with w = M z + q >= 0 and w'z = 0.

The controller's speed limits and soft tension rows become this problem, (38)-(40). M is only positive
semidefinite there, because a box row and its mirror image are one row twice. Ties in the ratio test are
therefore the normal case, and the lexicographic rule of [CPS92] Sec. 4.9 keeps the method from cycling.

The pivoting is in `lemke`; here the rows get one scale, and the answer is checked.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from tcrctl.numerics.kernel import part
from tcrctl.numerics.lemke import PIVOT_LIMIT, PIVOTS_PER_ROW, RAY, SOLVED, Rows, pivot_to_solution, refined
from tcrctl.signals import Array

__all__ = [
    "BAD_INPUT",
    "INACCURATE",
    "PIVOT_LIMIT",
    "RAY",
    "SOLVED",
    "lcp_residuals",
    "lcp_sentence",
    "solve_lcp",
]

INACCURATE: Final = 3
BAD_INPUT: Final = 4

ACCEPTED: Final = 1e-6  # complementarity residual of a solution, where the worst violation at z = 0 is 1

_SENTENCES = {
    SOLVED: "solved",
    RAY: "ended on a ray: if M is positive semidefinite, no z satisfies the constraints",
    PIVOT_LIMIT: f"stopped after {PIVOTS_PER_ROW} pivots per row: M may not be positive semidefinite",
    INACCURATE: "rounding errors spoilt the solution: M is too badly conditioned",
    BAD_INPUT: "M is not square, does not fit q, or holds an entry that is not finite",
}


def lcp_sentence(status: int) -> str:
    """Say what a result code of `solve_lcp` means.

    Args:
        status: SOLVED, RAY, PIVOT_LIMIT, INACCURATE or BAD_INPUT.

    Returns:
        A sentence without a full stop, fit for a log or an error message.

    Raises:
        KeyError: There is no such code.
    """
    return _SENTENCES[status]


@part()
def solve_lcp(M: Array, q: Array) -> tuple[Array, Array, int, int]:
    """Solve w = M z + q, w >= 0, z >= 0, w'z = 0 for positive semidefinite M, (39)-(40) in standard form.

    Lemke's method, [CPS92] Sec. 4.4 and 4.9. It ends for every M; for positive semidefinite M, symmetric or
    not, a ray proves that there is no solution. Rows may have any units: rows and columns are scaled alike,
    by powers of two, which adds no rounding error.

    Args:
        M: Matrix (n, n), unit of w_i per unit of z_j.
        q: Vector (n,), unit of w_i.

    Returns:
        z (n,), never negative; w = M z + q (n,), from that z; the number of pivots; the result code, see
        `lcp_sentence`. Unless the code is SOLVED, z is where the method stopped, and NaN for BAD_INPUT.
        Kernels raise nothing.
    """
    n = q.size
    if not _usable(M, q):
        return np.full(n, np.nan), np.full(n, np.nan), 0, BAD_INPUT
    scale, unit = _scaling(M, q)
    C, p = _scaled(M, q, scale, unit)
    T, basis, pivots, status = pivot_to_solution(C, p)
    z = _basic_z(refined(C, p, T, basis), basis)
    w = _affine(C, p, z)
    if _complementarity_residual(w, z) <= ACCEPTED:
        status = SOLVED  # also from a ray: rounding turns a feasible set without interior into an empty one
    elif status == SOLVED:
        status = INACCURATE
    for i in range(n):
        z[i] *= scale[i] * unit
        w[i] *= unit / scale[i]
    return z, w, pivots, status


@part()
def lcp_residuals(M: Array, q: Array, z: Array) -> tuple[float, float, float]:
    """Measure how well z solves the problem, independently of any solver.

    Args:
        M: Matrix (n, n).
        q: Vector (n,).
        z: Proposed solution (n,).

    Returns:
        max_i max(0, -w_i), max_i max(0, -z_i) and max_i |w_i z_i| with w = M z + q; in the units of w, z and
        w z. All are 0 for an exact solution. NaN in the arguments gives NaN.
    """
    w_below, z_below, product = 0.0, 0.0, 0.0
    for i in range(q.size):
        w = q[i]
        for j in range(q.size):
            w += M[i, j] * z[j]
        w_below = np.maximum(w_below, -w)
        z_below = np.maximum(z_below, -z[i])
        product = np.maximum(product, abs(w * z[i]))
    return w_below, z_below, product


@part()
def _usable(M: Array, q: Array) -> bool:
    """Tell whether M (n, n) and q (n,) fit and are finite."""
    n = q.size
    if M.shape[0] != n or M.shape[1] != n:
        return False
    for i in range(n):
        if not np.isfinite(q[i]):
            return False
        for j in range(n):
            if not np.isfinite(M[i, j]):
                return False
    return True


@part()
def _power_of_two(x: float) -> float:
    """Round x > 0 to a power of two, so that scaling by it commits no rounding error."""
    return float(2.0 ** np.rint(np.log2(x)))


@part()
def _scaling(M: Array, q: Array) -> tuple[Array, float]:
    """Return the scale of each row (n,), and the largest violation at z = 0 in scaled rows."""
    scale, unit = np.empty(q.size), 0.0
    for i in range(q.size):
        size = M[i, i]
        if size <= 0.0:  # in a semidefinite matrix: a multiplier row, skew to the others
            for j in range(q.size):
                size = max(size, abs(M[i, j]), abs(M[j, i]))
        scale[i] = _power_of_two(1.0 / np.sqrt(size)) if size > 0.0 else 1.0
        unit = max(unit, -q[i] * scale[i])
    return scale, _power_of_two(unit) if unit > 0.0 else 1.0


@part()
def _scaled(M: Array, q: Array, scale: Array, unit: float) -> tuple[Array, Array]:
    """Return the scaled M transposed (n, n) and the scaled q (n,)."""
    n = q.size
    C, p = np.empty((n, n)), np.empty(n)
    for i in range(n):
        p[i] = scale[i] * q[i] / unit
        for j in range(n):
            C[j, i] = scale[i] * M[i, j] * scale[j]
    return C, p


@part()
def _basic_z(x: Array, basis: Rows) -> Array:
    """Scatter the basic values x (n,) to z (n,), without what rounding put below 0."""
    z = np.zeros(x.size)
    for i in range(x.size):
        if x.size <= basis[i] < 2 * x.size:
            z[basis[i] - x.size] = np.maximum(x[i], 0.0)
    return z


@part()
def _affine(C: Array, p: Array, z: Array) -> Array:
    """Return p + C'z (n,)."""
    w = np.empty(p.size)
    for i in range(p.size):
        w[i] = p[i]
    for j in range(p.size):
        if z[j] != 0.0:
            for i in range(p.size):
                w[i] += C[j, i] * z[j]
    return w


@part()
def _complementarity_residual(w: Array, z: Array) -> float:
    """Return max_i |min(w_i, z_i)|, 0 for solutions only; NaN if w or z holds one."""
    worst = 0.0
    for i in range(w.size):
        worst = np.maximum(worst, abs(np.minimum(w[i], z[i])))
    return worst

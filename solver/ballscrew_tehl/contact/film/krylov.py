"""Right-preconditioned GMRES without restart (Saad 2003, algorithm 9.5); small systems, few iterations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...compiled import kernel
from ..half_space.grid import Array

#: sums may be reordered for vector units; NaN and infinity stay what they are
SUMS = {"reassoc", "contract"}


@kernel
def rotate(hessenberg, cs, sn, e, k):
    """Givens rotations of column k of the Hessenberg matrix; returns the residual left."""
    for i in range(k):
        a, b = hessenberg[i, k], hessenberg[i + 1, k]
        hessenberg[i, k], hessenberg[i + 1, k] = cs[i] * a + sn[i] * b, -sn[i] * a + cs[i] * b
    a, b = hessenberg[k, k], hessenberg[k + 1, k]
    size = np.hypot(a, b)
    cs[k], sn[k] = a / size, b / size
    hessenberg[k, k] = size
    e[k + 1] = -sn[k] * e[k]
    e[k] = cs[k] * e[k]
    return abs(e[k + 1])


@kernel(fastmath=SUMS)
def orthogonalise(basis, k, w, hessenberg):
    """Make w orthogonal to the first k+1 vectors of the basis, twice, and the next vector of it."""
    n = w.size
    for again in range(2):
        for i in range(k + 1):
            total = 0.0
            for m in range(n):
                total += basis[i, m] * w[m]
            hessenberg[i, k] = total if again == 0 else hessenberg[i, k] + total
            for m in range(n):
                w[m] -= total * basis[i, m]
    total = 0.0
    for m in range(n):
        total += w[m] * w[m]
    size = np.sqrt(total)
    hessenberg[k + 1, k] = size
    inv = 1.0 / size if size > 0.0 else 0.0
    for m in range(n):
        basis[k + 1, m] = inv * w[m]


@kernel
def solution(basis, hessenberg, e, used, out):
    """Combination of the first `used` vectors of the basis that the rotated system asks for, before preconditioning."""
    y = np.zeros(used)
    for i in range(used - 1, -1, -1):
        total = e[i]
        for m in range(i + 1, used):
            total -= hessenberg[i, m] * y[m]
        y[i] = total / hessenberg[i, i]
    out[:] = 0.0
    for i in range(used):
        for m in range(out.size):
            out[m] += y[i] * basis[i, m]


def gmres(
    apply: Callable[[Array], Array],
    precondition: Callable[[Array], Array],
    rhs: Array,
    tolerance: float,
    max_iterations: int,
) -> tuple[Array, int, float]:
    """Solve apply(x) = rhs to a relative residual; returns x, the iterations used, the residual left."""
    beta = float(np.linalg.norm(rhs))
    if beta == 0.0:
        return np.zeros_like(rhs), 0, 0.0
    m = max_iterations
    basis, hessenberg = np.empty((m + 1, rhs.size)), np.zeros((m + 1, m))
    cs, sn, e = np.zeros(m), np.zeros(m), np.zeros(m + 1)
    basis[0], e[0] = rhs / beta, beta
    used, left = 0, beta
    for k in range(m):
        orthogonalise(basis, k, apply(precondition(basis[k])), hessenberg)
        left = rotate(hessenberg, cs, sn, e, k)
        used = k + 1
        if not left > tolerance * beta:
            break
    x = np.empty_like(rhs)
    solution(basis, hessenberg, e, used, x)
    return precondition(x), used, float(left) / beta

"""Steps of GMRES without restart in compiled loops (Saad 2003, algorithm 9.5): see linear.gmres."""

from __future__ import annotations

import numpy as np

from ...compiled import kernel

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

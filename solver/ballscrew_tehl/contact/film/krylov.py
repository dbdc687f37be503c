"""Right-preconditioned GMRES without restart (Saad 2003, algorithm 9.5); small systems, few iterations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..half_space.grid import Array


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
    basis = np.empty((m + 1, rhs.size))
    hessenberg = np.zeros((m + 1, m))
    basis[0] = rhs / beta
    cs, sn, e = np.zeros(m), np.zeros(m), np.zeros(m + 1)
    e[0] = beta
    used = 0
    for k in range(m):
        used = k + 1
        w = apply(precondition(basis[k]))
        h = basis[: k + 1] @ w
        w -= h @ basis[: k + 1]
        h2 = basis[: k + 1] @ w
        w -= h2 @ basis[: k + 1]
        hessenberg[: k + 1, k] = h + h2
        hessenberg[k + 1, k] = np.linalg.norm(w)
        if hessenberg[k + 1, k] > 0.0:
            basis[k + 1] = w / hessenberg[k + 1, k]
        for i in range(k):
            a, b = hessenberg[i, k], hessenberg[i + 1, k]
            hessenberg[i, k], hessenberg[i + 1, k] = cs[i] * a + sn[i] * b, -sn[i] * a + cs[i] * b
        a, b = hessenberg[k, k], hessenberg[k + 1, k]
        d = np.hypot(a, b)
        cs[k], sn[k] = a / d, b / d
        hessenberg[k, k] = d
        e[k + 1] = -sn[k] * e[k]
        e[k] = cs[k] * e[k]
        if not abs(e[k + 1]) > tolerance * beta:
            break
    y = np.linalg.solve(np.triu(hessenberg[:used, :used]), e[:used])
    return precondition(y @ basis[:used]), used, abs(float(e[used])) / beta

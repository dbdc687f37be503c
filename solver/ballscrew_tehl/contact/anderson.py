"""Anderson mixing of a fixed-point iteration (Walker & Ni, SIAM J. Numer. Anal. 49 (2011) 1715)."""

from __future__ import annotations

import numpy as np

from .grid import Array


class AndersonMixing:
    """Next iterate from the history of iterates x and their images g(x); depth steps are remembered."""

    def __init__(self, depth: int = 5) -> None:
        self._depth = depth
        self._x: list[Array] = []
        self._f: list[Array] = []

    def next(self, x: Array, image: Array, share: float) -> Array:
        """Mixed iterate; share is the part of the residual image - x that is taken."""
        residual = image - x
        self._x.append(x.ravel())
        self._f.append(residual.ravel())
        if len(self._x) > self._depth + 1:
            del self._x[0], self._f[0]
        if len(self._x) < 3:
            return x + share * residual
        d_x = np.diff(np.stack(self._x), axis=0)
        d_f = np.diff(np.stack(self._f), axis=0)
        weights = np.linalg.lstsq(d_f @ d_f.T, d_f @ residual.ravel(), rcond=1e-8)[0]
        mixed = x.ravel() + share * residual.ravel() - weights @ (d_x + share * d_f)
        return mixed.reshape(x.shape)

"""Dry (Hertz) contact on the grid itself: the starting pressure of every lubricated solve."""

from __future__ import annotations

import numpy as np

from .deflection import LineConvolution
from .grid import Array, Grid

#: nodes under pressure below which the dry contact is not resolved
LEAST_NODES = 40
#: growth of the width until that many nodes are under pressure
WIDENING = 1.5
#: change of pressure [p_max] that ends the iteration, and its most steps
TOLERANCE, MOST_STEPS = 1e-10, 400


def dry_contact(
    grid: Grid,
    undeformed: Array,
    deflection: LineConvolution,
    load: float,
) -> tuple[Array, float]:
    """Pressure >= 0 and approach with gap = 0 under pressure and >= 0 elsewhere, for a given load.

    Constrained conjugate gradients of Polonsky & Keer, Wear 231 (1999) 206, in the area-weighted inner product.
    Returns pressure (n_y, n_x) and the approach that closes the gap.
    """
    weights = grid.weights.copy()
    inside = np.zeros_like(weights, dtype=bool)
    inside[grid.inner] = True
    width = 1.0
    while True:
        shape = 1.0 - (grid.x[None, :] ** 2 + grid.y[:, None] ** 2) / width**2
        p = np.sqrt(np.maximum(0.0, shape)) * inside
        if np.count_nonzero(p) >= LEAST_NODES:
            break
        width *= WIDENING
    p *= load / np.sum(weights * p)
    if width > 1.0:
        # a grid for films far thicker than the flattening: the dry contact is a point on it
        gap = undeformed + deflection(p)
        return p, -float(np.sum(weights * p * gap) / load)
    direction = np.zeros_like(p)
    g_old, fresh = 1.0, 0.0
    h_0 = 0.0
    for _ in range(MOST_STEPS):
        contact = p > 0.0
        gap = undeformed + deflection(p)
        h_0 = -float(np.sum((weights * gap)[contact]) / np.sum(weights[contact]))
        gap += h_0
        g_new = float(np.sum((weights * gap * gap)[contact]))
        direction = np.where(contact, gap + fresh * (g_new / g_old) * direction, 0.0)
        g_old = g_new
        image = deflection(direction)
        image -= np.sum((weights * image)[contact]) / np.sum(weights[contact])
        curvature = float(np.sum((weights * image * direction)[contact]))
        step = float(np.sum((weights * gap * direction)[contact])) / curvature
        p_new = np.maximum(p - step * direction, 0.0) * inside
        overlap = inside & (p_new == 0.0) & (gap < 0.0)
        fresh = 0.0 if overlap.any() else 1.0
        p_new[overlap] = -step * gap[overlap]
        p_new *= load / np.sum(weights * p_new)
        change = float(np.max(np.abs(p_new - p)))
        p = p_new
        if not change > TOLERANCE:
            break
    gap = undeformed + deflection(p)
    return p, -float(gap[p > 0.0].mean())

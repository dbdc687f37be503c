"""The interpolation of the atlas: lengths and noise by maximum likelihood, weights, the file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import cho_solve, cholesky, eigh, solve_triangular
from scipy.optimize import minimize

from ballscrew_tehl import __version__
from ballscrew_tehl.atlas.contact_atlas import (
    ATLAS_FORMAT,
    Interpolant,
    content_hash,
    correlation,
    trend_terms,
)
from ballscrew_tehl.atlas.groups import (
    QUANTITIES,
    Array,
    Groups,
    RollingContacts,
    closed_forms,
    modelled,
    wall_group,
)
from ballscrew_tehl.whole_file import whole_file

from .screws import Contact

#: contacts by which lengths are found, spread over all; all together take the weights
LENGTHS_FROM = 700
#: first lengths of groups.COORDINATES, bounds of lengths as multiples of the first; noise over the deviation
FIRST = np.array([3.2, 4.3, 8.0, 3.2, 8.0, 6.0, 11.0, 12.0, 20.0])
BOUNDS, NOISE = (0.1, 10.0), np.geomspace(1e-5, 1.0, 26)
#: bounds; that of the Peclet number ends at its first length, since the rolling loss alone needs it: at 244, the best
#: for all quantities together, losses that are left out miss by 0.53 in the mean, at 20 by 0.45 %, films alike
BOUNDS_OF_ATLAS = [BOUNDS] * (len(FIRST) - 1) + [(0.5, 1.0)]
#: search: evaluations and tolerance of the logarithms
MOST_EVALUATIONS, SEARCH_TOLERANCE = 200, 0.03
#: rise [K] below which it counts as noise that grows as it falls: nobody feels it
SMALL_RISE = 0.05


class Table(NamedTuple):
    """Contacts of the atlas: groups (n,), what is interpolated of each quantity (n, q).

    noise: over the usual (n, q); rows: their places in the sequence
    """

    groups: Groups
    values: Array
    noise: Array
    rows: Array


def table_of(contacts: Sequence[Contact], results: Sequence[Mapping[str, Any]]) -> Table:
    """The contacts that were solved on a grid that resolves them."""
    groups, values, noise, rows = [], [], [], []
    for row, (contact, result) in enumerate(zip(contacts, results, strict=True)):
        if "reason" in result or result["asymptotic"] or not result["rolling_loss"] > 0.0:
            continue
        c = contact.conditions
        at = RollingContacts(
            c.load, c.R_x, c.R_y, c.u_e, c.temperature, c.E_prime, contact.oil, wall_group(contact.solids)
        )
        forms = closed_forms(at)
        groups.append([float(own) for own in forms.groups])
        values.append([float(of) for of in modelled(result, forms.values).values()])
        small = math.hypot(1.0, SMALL_RISE / max(result["temperature_rise"], 1e-9))
        noise.append([small if name == "temperature_rise" else 1.0 for name in QUANTITIES])
        rows.append(row)
    # as they are stored
    single = np.array(groups, dtype=np.float32).astype(float)
    return Table(Groups(*single.T), np.array(values), np.array(noise), np.array(rows))


def _likelihood(points: Array, values: Array, noise: Array, lengths: Array) -> tuple[float, Array]:
    """Negative log likelihood of all quantities at their best noise, and that noise (q,)."""
    at = points / lengths
    total, result = 0.0, []
    terms = trend_terms(at)
    own = correlation(at, at)
    for column, scale in zip(values.T, noise.T, strict=True):
        # K + n^2 D = D^(1/2) (D^(-1/2) K D^(-1/2) + n^2) D^(1/2)
        weights, vectors = eigh(own / np.outer(scale, scale))
        y, t = vectors.T @ (column / scale), vectors.T @ (terms / scale[:, None])
        best, n = math.inf, 1.0
        for noise_n in NOISE:
            d = np.maximum(weights, 0.0) + noise_n**2
            slopes = np.linalg.lstsq(t / np.sqrt(d)[:, None], y / np.sqrt(d), rcond=None)[0]
            remainder = y - t @ slopes
            variance = float(np.sum(remainder**2 / d)) / len(y)
            likelihood = 0.5 * (len(y) * math.log(variance) + float(np.sum(np.log(d))))
            if likelihood < best:
                best, n = likelihood, float(noise_n)
        total += best
        result.append(n)
    return total, np.array(result)


def lengths_and_noise(
    points: Array,
    values: Array,
    noise: Array,
    first: Array,
    bounds: Sequence[tuple[float, float]] | None = None,
) -> tuple[Array, Array]:
    """Lengths of coordinates (d,), the same for all quantities, and noise of each (q,), by maximum likelihood.

    points (n, d); values (n, q); noise (n, q): over the usual one; first (d,): lengths to begin with; bounds: of every
    length as multiples of the first, None = BOUNDS for all.
    """
    some = np.linspace(0, len(points) - 1, min(LENGTHS_FROM, len(points))).astype(int)
    selection = points[some], values[some], noise[some]
    d = points.shape[1]
    result = minimize(
        lambda x: _likelihood(*selection, first * np.exp(x))[0], np.zeros(d), method="Nelder-Mead",
        bounds=[tuple(np.log(own)) for own in bounds or [BOUNDS] * d],
        options={
            "maxfev": MOST_EVALUATIONS, "xatol": SEARCH_TOLERANCE, "fatol": SEARCH_TOLERANCE,
            "initial_simplex": np.vstack([np.zeros(d), 0.4 * np.eye(d)]),
        },
    )  # fmt: skip
    lengths = first * np.exp(result.x)
    return lengths, _likelihood(*selection, lengths)[1]


def interpolant_of(
    points: Array, values: Array, noise: Array, lengths: Array, level: Array
) -> tuple[Interpolant, Array]:
    """Trend and weights of every quantity, and the errors of contacts when they are left out (n, q).

    lengths, level: of lengths_and_noise, others as there. Errors left out: Rasmussen & Williams 2006, Eq. 5.12, for
    the system of weights and trend.
    """
    at = points / lengths
    own, terms = correlation(at, at), trend_terms(at)
    trend, weights, left_out = [], [], []
    for column, scale, n in zip(values.T, noise.T, level, strict=True):
        matrix = own.copy()
        matrix[np.diag_indices(len(own))] += (n * scale) ** 2
        factor = cholesky(matrix, lower=True, overwrite_a=True)
        solved = cho_solve((factor, True), terms)
        slopes = np.linalg.solve(terms.T @ solved, solved.T @ column)
        w = cho_solve((factor, True), column - terms @ slopes)
        inverse = solve_triangular(factor, np.eye(len(own)), lower=True)
        trend.append(slopes)
        weights.append(w)
        own_part = np.sum(inverse**2, axis=0) - np.sum(
            solved * np.linalg.solve(terms.T @ solved, solved.T).T, axis=1
        )
        left_out.append(w / own_part)
    return Interpolant(at, np.array(trend).T, np.array(weights).T), np.array(left_out).T


def save_atlas(
    path: Path, table: Table, lengths: Array, interpolant: Interpolant, header: Mapping[str, Any]
) -> dict[str, Any]:
    """Write an atlas to a temporary file next to `path` and rename it; returns its header."""
    arrays: dict[str, Any] = {
        "groups": np.stack(table.groups, axis=1).astype(np.float32), "lengths": lengths,
        "trend": interpolant.trend, "weights": interpolant.weights,
    }  # fmt: skip
    complete = {**header, "format": ATLAS_FORMAT, "version": __version__, "contacts": len(table.rows)}
    complete["hash"] = content_hash(arrays)
    _write(path, complete, arrays)
    return complete


def certify_atlas(path: Path, certificate: Mapping[str, Any]) -> None:
    """Give the atlas of a file another certificate."""
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    header = json.loads(str(arrays.pop("header")))
    _write(path, header | {"certificate": certificate}, arrays)


def _write(path: Path, header: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
    # a name without .npz would be changed
    with whole_file(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, header=np.array(json.dumps(header, sort_keys=True)), **arrays)

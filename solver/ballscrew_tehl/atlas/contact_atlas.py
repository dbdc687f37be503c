"""The atlas file: contacts, weights of their interpolation, certificate; what it holds and what it refuses.

Between contacts at scattered points by universal kriging: linear trend, Matern correlation of order 5/2 with one length
per coordinate, the same for all quantities: one matrix of correlations serves them all. Source: Rasmussen & Williams
2006, Gaussian Processes for Machine Learning, Eqs. 2.25, 2.41 and 4.17. The weights are found when the atlas is made.
"""

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..parameters.file import PACKAGED_DATA, Parameters
from ..parameters.oil import ROELANDS_PRESSURE
from ..physics.hertz import E_prime
from ..runtime.packed import MapError
from .groups import MAX_HEATING_N, QUANTITIES, Array, ClosedForms, Groups, coordinates

ATLAS_FORMAT = 5
#: E' [Pa] of the contacts: steel on steel to silicon nitride on steel, and beyond by as much as changes the rolling
#: loss by 0.5 %; p_r over that of the atlas
MODULI, NEAR_PRESSURE = (200e9, 300e9), 0.05
#: groups beyond whose range a screw is refused: of geometry, oil and material. Beyond the range of the others (M, L,
#: pressure, N, slope, peclet) every quantity keeps its ratio to the closed form at the end of the range
OF_THE_SCREW = {
    "radius_ratio": "R_x/R_y, which follows from the groove over the ball",
    "z": "pressure exponent of the oil",
    "wall": "effusivity of the bodies over that of bearing steel",
}
#: laws of the oil in the contacts of the atlas
LAWS = {"pressure_law": "roelands", "density_law": "dowson_higginson"}
ROUNDING = 1e-6  # relative distance beyond the contacts of the atlas that counts as inside
SOLVE = "remedy: ballscrew torque --direct, which solves the contacts"
#: points interpolated at a time: their correlations with thousands of others stay within the cache; of twice as many
#: BLAS starts threads, which on a busy machine took ten times as long
CHUNK = 8


class OutsideAtlasError(ValueError):
    """A screw or oil whose contacts the atlas does not hold; the message names the group, its value and the range."""


class Interpolant(NamedTuple):
    """Points (n, d) over the lengths of their coordinates; trend (terms, q) and weights (n, q) of q quantities."""

    points: Array
    trend: Array
    weights: Array

    def __call__(self, at: Array) -> Array:
        """Interpolated quantities (m, q) at points (m, d) over the lengths."""
        result = trend_terms(at) @ self.trend
        squares = (self.points * self.points).sum(axis=1)
        # once: got anew for each chunk, it takes a quarter longer
        work = np.empty((2, CHUNK, len(self.points)))
        for i in range(0, len(at), CHUNK):
            some = at[i : i + CHUNK]
            own = correlation(some, self.points, squares, work[:, : len(some)])
            result[i : i + CHUNK] += own @ self.weights
        return result


def correlation(one: Array, two: Array, squares: Array | None = None, work: Array | None = None) -> Array:
    """Correlations (m, n) of order 5/2 of points (m, d), (n, d) over the lengths; squares (n,): sums of the second.

    work (2, m, n): memory for it, of which the second is returned.
    """
    s, result = np.empty((2, len(one), len(two))) if work is None else work
    np.matmul(one, two.T, out=s)
    s *= -2.0
    s += (one * one).sum(axis=1)[:, None]
    s += (two * two).sum(axis=1) if squares is None else squares
    s *= 5.0
    np.sqrt(np.maximum(s, 0.0, out=s), out=s)
    np.divide(s, 3.0, out=result)
    result += 1.0
    result *= s
    result += 1.0
    result *= np.exp(np.negative(s, out=s), out=s)
    return result


def trend_terms(at: Array) -> Array:
    """1 and the coordinates (m, d+1)."""
    return np.concatenate([np.ones((len(at), 1)), at], axis=1)


class ContactAtlas(NamedTuple):
    """The atlas, read."""

    interpolant: Interpolant
    lengths: Array
    ends: tuple[Groups, Groups]  # smallest and largest of its contacts
    header: Mapping[str, Any]  # counts, certificate, version, hash of the content

    @property
    def hash(self) -> str:
        """Of its arrays."""
        return str(self.header["hash"])

    def inside(self, groups: Groups) -> NDArray[np.bool_]:
        """Which of some contacts lie within the range of every group."""
        result = (
            (own >= low * (1.0 - ROUNDING)) & (own <= high * (1.0 + ROUNDING))
            for own, low, high in zip(groups, *self.ends, strict=True)
        )
        return np.logical_and.reduce(np.broadcast_arrays(*result))

    def interpolated(self, forms: ClosedForms) -> dict[str, Array]:
        """What is interpolated of contacts, at the end of the range where a group is beyond it, N to MAX_HEATING_N."""
        ends = self.ends[0], self.ends[1]._replace(N=np.array(MAX_HEATING_N))
        near = Groups(*(np.clip(own, *of) for own, *of in zip(forms.groups, *ends, strict=True)))
        at = coordinates(near) / self.lengths
        # of the contacts of a table a third is at an end of the range, many of them alike
        points, place = np.unique(at.reshape(-1, at.shape[-1]), axis=0, return_inverse=True)
        result = self.interpolant(points)[place.ravel()].T
        return dict(zip(QUANTITIES, result.reshape(-1, *at.shape[:-1]), strict=True))


def _outside(what: str, held: str) -> OutsideAtlasError:
    return OutsideAtlasError(f"{what}; the atlas of contacts holds {held}; {SOLVE}")


def refuse_laws(parameters: Parameters) -> None:
    """Refuse oils and bodies of other kinds than those of the atlas: OutsideAtlasError."""
    oil = parameters.lubricant
    for name, allowed in LAWS.items():
        if getattr(oil, name) != allowed:
            raise _outside(f"{oil.name}: {name} = {getattr(oil, name)}", allowed)
    if oil.viscosity_law == "constant":
        raise _outside(f"{oil.name}: viscosity_law = constant", "oils that thin with heat")
    near = ROELANDS_PRESSURE * (1.0 - NEAR_PRESSURE), ROELANDS_PRESSURE * (1.0 + NEAR_PRESSURE)
    for name, value, (low, high), unit, scale in (
        ("roelands_pressure", oil.roelands_pressure, near, "MPa", 1e-6),
        ("E'", E_prime(parameters.screw), MODULI, "GPa", 1e-9),
    ):
        if not low <= value <= high:
            held = f"{scale * low:.4g} to {scale * high:.4g} {unit}"
            raise _outside(f"{name} = {scale * value:.4g} {unit}", held)


def refuse_groups(atlas: ContactAtlas, groups: Groups) -> None:
    """Refuse contacts with a group OF_THE_SCREW beyond the range of the atlas: OutsideAtlasError."""
    for name, meaning in OF_THE_SCREW.items():
        own, low, high = (np.asarray(getattr(of, name)) for of in (groups, *atlas.ends))
        bad = ~((own >= low * (1.0 - ROUNDING)) & (own <= high * (1.0 + ROUNDING)))
        if bad.any():
            held = f"{float(low):.4g} to {float(high):.4g}"
            raise _outside(f"{name} = {float(own[bad].flat[0]):.4g} ({meaning})", held)


def packaged_atlas() -> Path:
    """File of the packaged atlas."""
    return PACKAGED_DATA / "contact_atlas.npz"


def content_hash(arrays: Mapping[str, Array]) -> str:
    """Hash of the arrays of an atlas."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        digest.update(f"{name}{arrays[name].shape}{arrays[name].dtype.str}".encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()


@lru_cache(maxsize=2)
def load_atlas(path: Path | None = None) -> ContactAtlas:
    """Read an atlas file; None = the packaged one."""
    path = path or packaged_atlas()
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(str(arrays.pop("header")))
        result = header["format"]
    except Exception as error:  # a damaged zip fails in many ways
        raise MapError(f"{path}: not a readable atlas ({type(error).__name__}: {error})") from error
    if result != ATLAS_FORMAT:
        raise MapError(f"{path}: atlas format {result}; expected {ATLAS_FORMAT}: install the package again")
    digest = content_hash(arrays)
    if digest != header["hash"]:
        raise MapError(
            f"{path}: content hash {digest[:12]}; expected {header['hash'][:12]}: the file was damaged"
        )
    groups, lengths = Groups(*arrays["groups"].astype(float).T), arrays["lengths"]
    interpolant = Interpolant(coordinates(groups) / lengths, arrays["trend"], arrays["weights"])
    ends = Groups(*(own.min() for own in groups)), Groups(*(own.max() for own in groups))
    return ContactAtlas(interpolant, lengths, ends, header)

"""A nut map in closed form, for fast tests of everything that reads a map.

Every logarithm is a cubic polynomial or less in (ln force, ln speed, temperature), so that the spline holds
it exactly and a test can compare with the formulas below. The magnitudes are those of the 40 mm screw of the
packaged table.
"""

import functools

import numpy as np

from ballscrew_tehl.runtime.bspline import map_arrays
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import AXES, Law, sealed

AXIS = {
    "force": (50.0, 12000.0, 7), "speed": (0.5, 320.0, 8), "temperature": (283.15, 353.15, 5),
    "preload": (50.0, 12000.0, 6), "share": (0.0, 1.0, 5),
    "difference": (-20.0, 20.0, 9),
}  # fmt: skip
DEFAULTS = {
    "apparent_viscosity_ratio": 7.6, "net_sliding_coefficient": 0.0051, "roughness_height": 24e-9,
    "breakaway_factor": 1.0,
}  # fmt: skip
MECHANISTIC_DEFAULTS = {
    "apparent_viscosity_ratio": 1.0, "net_sliding_coefficient": 0.0048, "roughness_height": 200e-9,
    "breakaway_factor": 2.0,
}  # fmt: skip
LAWS = (Law.THREE_PARAMETER, Law.MECHANISTIC)
SCREW = {"lead": 8e-3, "diameter": 0.04, "nut_stiffness": 1.35e9, "stiffness_preload": 2000.0}
PRESLIDING_ANGLE = 6.9e-4  # [rad/N^(1/3)], as of the 40 mm screw


def surfaces(force, speed, temperature, law=Law.THREE_PARAMETER):
    """The ten surfaces of one nut, stacked on the last axis; SI."""
    x, y, z = np.log(force / 1000.0), np.log(speed / 10.0), (temperature - 303.15) / 50.0
    film_screw = 43e-9 * np.exp(-0.067 * x + 0.67 * y - 0.004 * y**2 - 0.9 * z + 0.1 * z**2)
    film_nut = 23e-9 * np.exp(-0.067 * x + 0.66 * y - 0.005 * y**2 - 0.92 * z + 0.1 * z**2)
    torque_screw = 0.009 * np.exp(0.66 * x + 0.34 * y + 0.003 * y**2 - 0.002 * x * y - 1.1 * z)
    torque_nut = 0.017 * np.exp(0.67 * x + 0.33 * y + 0.004 * y**2 - 1.2 * z)
    rise = 8.0 * np.exp(0.2 * x + 0.9 * y - 0.02 * y**2 - 0.5 * z)
    torques = torque_screw, torque_nut, film_screw, film_nut
    if law == Law.MECHANISTIC:
        thinner = y - np.log(AXIS["speed"][1] / 10.0) - 0.2 * z  # 0 in the thickest films
        torques = (
            0.02 * np.exp(0.35 * x + 0.6 * y - 0.01 * y**2 - 0.8 * z),
            0.03 * np.exp(0.36 * x + 0.62 * y - 0.012 * y**2 - 0.85 * z + 0.01 * x * y),
            0.03 * np.exp(0.9 * x + 0.05 * y - 0.3 * z),
            np.exp((0.008 + 0.0005 * x) * thinner**2),
        )
    return np.stack(
        np.broadcast_arrays(
            *torques, 0.6 * film_screw, 0.55 * film_nut,
            0.95 * film_screw, 0.9 * film_nut, rise, 0.7 * rise,
        ),
        axis=-1,
    )  # fmt: skip


def force_curves(force, free=None):
    """The curves of one nut over its force, stacked on the last axis; SI. free: with oversize balls."""
    force = np.asarray(force, dtype=float)
    none = np.ones_like(force)
    return np.stack(
        [
            2.4e-3 * (force / 1000.0) ** (4 / 3), 3.067e-2 * force,
            none if free is None else free * (force / 1000.0) ** -0.05, none if free is None else 0.72 * none,
            0.045 * (force / 1000.0), 1.1 * (force / 1000.0) ** 0.01, 2.5e-3 * force,
            0.857e9 * (force / 1000.0) ** (1 / 3), 0.0197 * force,
        ],
        axis=-1,
    )  # fmt: skip


def gap_drag(speed, temperature):
    """Drag of the oil between balls [N.m]."""
    return 0.004 * speed / 10.0 * np.exp(-1.1 * (temperature - 303.15) / 50.0)


def separation_ratio(preload):
    """Separation load over preload for axial load > 0 and < 0, stacked on the last axis."""
    x = np.log(np.asarray(preload, dtype=float) / 1000.0)
    return np.stack([3.17 * np.exp(0.04 * x), 2.9 * np.exp(0.03 * x)], axis=-1)


def relieved_share(preload, share):
    """(force of the relieved nut over preload)^(2/3) for axial load > 0 and < 0, stacked on the last axis."""
    bend = 0.1 + 0.0 * np.asarray(preload, dtype=float)
    return np.stack(
        [(1.0 - share) * (1.0 + bend * share), (1.0 - share) * (1.0 + 0.5 * bend * share)], axis=-1
    )


def shift(preload, stretched):
    """Change of preload^(2/3) by a temperature difference [N^(2/3)], a cubic polynomial of its stretched value."""
    x = np.log(np.asarray(preload, dtype=float) / 1000.0)
    return -60.0 * stretched * (1.0 + 0.3 * stretched**2) * (1.0 + 0.02 * x)


def nodes(name):
    lo, hi, count = AXIS[name]
    if name in ("force", "speed", "preload"):
        return np.exp(np.linspace(np.log(lo), np.log(hi), count))
    return np.linspace(lo, hi, count)


def make_map(
    viscous_scale: float = 1.0,
    force_exponent: float = 0.0,
    law: str = Law.THREE_PARAMETER,
    free: float | None = None,
) -> NutMap:
    """The map; the viscous torque is multiplied by viscous_scale*(force/1 kN)^force_exponent, for other content.

    free: shear of a ball on two flanks over that on four at 1 kN, with oversize balls
    """
    force, speed, temperature, preload, share, difference = (nodes(name) for name in AXES)
    values = surfaces(force[:, None, None], speed[None, :, None], temperature[None, None, :], law)
    values[..., :2] *= viscous_scale * (force[:, None, None, None] / 1000.0) ** force_exponent
    arrays = map_arrays(
        values, force_curves(force, free), gap_drag(speed[:, None], temperature), separation_ratio(preload),
        relieved_share(preload[:, None], share[None, :]), shift(preload[:, None], difference / 20.0),
    )  # fmt: skip
    header = {
        "axes": {name: list(AXIS[name]) for name in AXES}, "parameters_json": "{}",
        "parameters_hash": "0" * 64, "law": law, "kinematics": "published", "film_model": "synthetic",
        "defaults": DEFAULTS if law == Law.THREE_PARAMETER else MECHANISTIC_DEFAULTS, "screw": SCREW,
        "presliding_angle": PRESLIDING_ANGLE, "certificate": {}, "version": "0.1.0",
    }  # fmt: skip
    return NutMap(sealed(header, arrays), arrays)


@functools.cache
def closed_form(law: str = Law.THREE_PARAMETER, free: float | None = None) -> NutMap:
    """make_map of this law, made once."""
    return make_map(law=law, free=free)

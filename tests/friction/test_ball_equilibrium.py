"""Equilibrium of a ball: against scipy's minimum of the same potential, closed limits, forces that vanish."""

import math

import numpy as np
import pytest
from paths import ROOT
from scipy.optimize import minimize

from ballscrew_tehl.friction.ball_equilibrium import (
    AROUND,
    CONVERGED_AT,
    SMOOTHED,
    Traction,
    ball_equilibria,
    ball_equilibrium,
    radial_nodes,
)
from ballscrew_tehl.parameters.file import FOUR_POINT, changed, load_screw
from ballscrew_tehl.physics.hertz import E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.kinematics import ContactMotion, contact_motion

ROLLING = changed(load_screw(), friction={"law": "mechanistic"})
SCREW = ROLLING.screw
SCREWS = sorted((ROOT / "examples/screws").glob("*.toml"))
LIMITING, TAU_0, BOUNDARY = 0.05, 5e6, 0.12


def hertz_of(screw, raceway, load):
    return ellipse(load, *reduced_radii(screw, screw.contact_angle, raceway), E_prime(screw))


def contacts_of(screw, load, viscosity, film=1e-7, share=0.0, rise=1e-8):
    """Motion, axes (1, c, 2) and traction of one ball with Hertz pressure p and a viscosity times exp(rise p)."""
    motion = contact_motion(screw, screw.contact_angle)
    loads = np.broadcast_to(load, len(motion.raceways))
    hertz = [hertz_of(screw, raceway, q) for raceway, q in zip(motion.raceways, loads, strict=True)]
    axes = np.array([[[float(one.a), float(one.b)] for one in hertz]])
    pressure = np.array([[float(one.p_max) for one in hertz]])
    eta = viscosity * np.exp(rise * pressure[..., None] * np.sqrt(1.0 - radial_nodes()[0] ** 2))
    ones = np.ones_like(pressure)
    return motion, axes, Traction(eta, pressure, film * ones, share * ones, TAU_0, LIMITING, BOUNDARY)


def potential(motion, axes, traction, speed, q):
    """Twin in numpy: potential [W] of one ball and the power of its contacts."""
    radius, weight = radial_nodes()
    around = 2.0 * math.pi * (np.arange(AROUND) + 0.5) / AROUND
    smooth = SMOOTHED[-1] * speed * abs(motion.matrix[0, 0, 0])
    total, power = 0.0, []
    for c in range(len(motion.raceways)):
        slip_x, slip_y, spin = motion.matrix[c] @ q + motion.offset[c] * speed
        a, b = axes[0, c]
        x, y = b * np.outer(radius, np.cos(around)), a * np.outer(radius, np.sin(around))
        v = np.hypot(slip_x + motion.differential[c] * speed * y**2 - spin * y, slip_y + spin * x)
        root = np.sqrt(v**2 + smooth**2)
        p = (traction.pressure[0, c] * np.sqrt(1.0 - radius**2))[:, None]
        k = traction.viscosity[0, c][:, None] / (traction.film[0, c] * traction.tau_0)
        ends = np.minimum(k * root, np.sinh(traction.limiting * p / traction.tau_0))
        stress = np.minimum(traction.tau_0 * np.arcsinh(k * root), traction.limiting * p)
        content = ends * np.arcsinh(ends) - np.sqrt(1.0 + ends**2) + 1.0
        film = traction.tau_0 / k * content + traction.limiting * p * (root - ends / k)
        f = traction.asperities[0, c]
        area = math.pi * a * b * weight[:, None]
        total += np.sum(area * ((1.0 - f) * film + f * traction.boundary * p * root))
        power.append(np.sum(area * v**2 / root * ((1.0 - f) * stress + f * traction.boundary * p)))
    return total, np.array(power)


@pytest.mark.parametrize(("viscosity", "share"), [(1e-4, 0.0), (0.05, 0.0), (0.05, 0.3), (10.0, 1.0)])
@pytest.mark.parametrize("kind", ["double_nut", FOUR_POINT])
def test_equilibrium_is_the_least_potential(viscosity, share, kind):
    screw = changed(ROLLING, screw={"preload_kind": kind}).screw
    motion, axes, traction = contacts_of(screw, 40.0, viscosity, share=share)
    speed = 50.0
    found = ball_equilibrium(motion, np.array([speed]), axes, traction)
    q = found.motion[0]
    at, power = potential(motion, axes, traction, speed, q)
    assert np.max(np.abs(found.power[0] / power - 1.0)) <= 1e-9
    # the twin finds no lower one, neither by a search from there nor by random steps
    scale = 1e-4 * speed * np.array([1.0, 10.0, 10.0, 10.0])
    lower = minimize(lambda z: potential(motion, axes, traction, speed, q + scale * z)[0] / at, np.zeros(4),
                     method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-13, "maxfev": 4000})  # fmt: skip
    assert lower.fun >= 1.0 - 10.0 * CONVERGED_AT
    for step in np.random.default_rng(5).normal(size=(20, 4)):
        assert potential(motion, axes, traction, speed, q + scale * step)[0] >= at


def any_balls(kind):
    """Balls of all screws side by side: films of 1 nm to 10 um, viscosity 1e-3 to 1e13 Pa s, no to all load on
    asperities, diagonals loaded unlike."""
    rng, balls = np.random.default_rng(7), []
    for file in SCREWS:
        screw = changed(load_screw(file), screw={"preload_kind": kind}).screw
        for _ in range(40):
            pressure = 10.0 ** rng.uniform(7.5, 9.4)
            load = np.full(
                4 if kind == FOUR_POINT else 2, (pressure / hertz_of(screw, "screw", 1.0).p_max) ** 3
            )
            if kind == FOUR_POINT:
                load[1::2] *= rng.choice([1.0, rng.uniform(), 10.0 ** rng.uniform(-6.0, 0.0)])
            thin = 10.0 ** rng.uniform(-3.0, 0.5)
            rise = np.log(10.0 ** rng.uniform(math.log10(thin), 13.0) / thin) / pressure
            share = rng.choice([0.0, 1.0, rng.uniform(), 10.0 ** rng.uniform(-8.0, 0.0)])
            balls.append(contacts_of(screw, load, thin, 10.0 ** rng.uniform(-9.0, -5.0), share, rise))
    motions, axes, tractions = zip(*balls, strict=True)
    motion = ContactMotion(
        motions[0].raceways, *(np.stack(parts) for parts in list(zip(*motions, strict=True))[1:])
    )
    parts = (np.concatenate(part) for part in list(zip(*tractions, strict=True))[:4])
    speed = 10.0 ** rng.uniform(-1.0, 2.8, len(balls))
    return motion, speed, np.concatenate(axes), Traction(*parts, *tractions[0][4:])


@pytest.mark.parametrize("kind", ["double_nut", FOUR_POINT])
def test_equilibrium_of_any_ball_is_found_alone_beside_others_and_from_near(kind):
    motion, speed, axes, traction = any_balls(kind)
    found = ball_equilibrium(motion, speed, axes, traction)
    assert np.all(found.power >= 0.0)
    assert found.steps.max() <= 120
    total = found.power.sum(axis=1)
    # states in order: each ball begins from its motion in those before
    thinner = traction._replace(viscosity=0.8 * traction.viscosity)
    states = Traction(
        *(np.stack([a, a, b], axis=1) for a, b in zip(traction[:4], thinner[:4], strict=True)), *traction[4:]
    )
    three = ball_equilibria(motion, speed, np.stack([axes] * 3, axis=1), states)
    assert np.mean(three.steps[:, 1]) <= 0.25 * found.steps.mean()
    # the potential is known to 1e-10, and the power is of first order: as close as the smoothing leaves it
    alone = [found, found, ball_equilibrium(motion, speed, axes, thinner)]
    for k, other in enumerate(alone):
        assert np.max(np.abs(three.power[:, k].sum(axis=1) / other.power.sum(axis=1) - 1.0)) <= 2e-6
    for k in range(0, len(speed), 29):
        own = ContactMotion(motion.raceways, *(part[k] for part in motion[1:]))
        alone = ball_equilibrium(own, speed[k : k + 1], axes[k : k + 1], traction.take(np.s_[k : k + 1]))
        np.testing.assert_allclose(alone.power[0], found.power[k], rtol=1e-8, atol=1e-8 * total[k])
        assert alone.motion[0] == pytest.approx(
            found.motion[k], rel=1e-6, abs=1e-8 * np.abs(found.motion[k]).max()
        )


def test_what_cannot_be_found_is_reported():
    motion, axes, traction = contacts_of(SCREW, 40.0, 0.05, film=math.nan)
    with pytest.raises(ArithmeticError, match="equilibrium of a ball not found"):
        ball_equilibrium(motion, np.array([50.0]), axes, traction)

"""Power balance of a nut by the mechanistic law: closed, and in its limits."""

import numpy as np
import pytest
from law_contacts import VG100, ClosedContacts
from scipy.integrate import quad
from scipy.optimize import brentq

from ballscrew_tehl.friction.film_shear import UnfittedTorques, hysteresis_force
from ballscrew_tehl.friction.mechanistic import (
    breakaway_factor,
    mean_load,
    nut_powers,
    nuts_powers,
    thrust_factor,
)
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.parameters.file import FOUR_POINT, changed
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.ball_law import contact_angle_at_ball_load
from ballscrew_tehl.physics.film import FLOODED, replenishment_factor, supply_factor
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.kinematics import (
    contact_motion,
    entrainment_speed,
    neighbour_sliding,
    rolling_motion,
)
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.physics.lubricant import ambient_density, eta0

SCREW, FRICTION = VG100.screw, VG100.friction
K = 0.0113


def loads_at(force):
    return nut_loads(SCREW, force, SCREW.loaded_ball_count)


def at(force, rpm, contacts, parameters=VG100):
    return nut_powers(parameters, loads_at(force), rpm * RPM, 303.0, contacts)


def test_hysteresis_force_loses_the_stated_share_of_the_elastic_work():
    """Of an ellipse: moment of the front half of the Hertz pressure."""
    load, b, r_b = 32.955, 41.23e-6, 2.3815e-3
    moment = quad(lambda x: 0.75 * load / b * (1 - (x / b) ** 2) * x, 0.0, b)[0]
    assert hysteresis_force(load, b, r_b, 0.01) == pytest.approx(0.01 * moment / r_b, rel=1e-12)


def test_torque_times_speed_is_the_power_of_the_parts():
    """Summed ball by ball: 1e-6 with the supply of the mean ball for all, 5e-5 with that of each."""
    for force, rpm in [(1000.0, 100.0), (1000.0, 2500.0), (6000.0, 20.0), (6000.0, 2500.0)]:
        contacts, loads, speed = ClosedContacts(), loads_at(force), rpm * RPM
        nut = at(force, rpm, contacts)
        u_e = float(entrainment_speed(SCREW, speed))
        angle = float(contact_angle_at_ball_load(SCREW, mean_load(loads)))
        viscosity = eta0(VG100.lubricant, 303.0)
        power, of_each = nut.shear * speed, 0.0
        for raceway in RACEWAYS:
            balls = np.append(loads, mean_load(loads))
            found = contacts.values(raceway, balls, np.array([[speed]]), np.array([303.0]))
            R_x, R_y = reduced_radii(SCREW, angle, raceway)
            b = ellipse(balls, R_x, R_y, E_prime(SCREW)).b
            loss, film = (found[name][:, 0, 0] for name in ("rolling_loss", "central_film"))
            factor = supply_factor(FRICTION.supply_length, balls, loss, u_e, viscosity, film, b, R_x, R_y)
            power += factor[-1] * loss[:-1].sum()
            of_each += ((factor - factor[-1]) * loss)[:-1].sum()
            for load, half in zip(loads, b, strict=False):
                lost = hysteresis_force(load, half, float(R_x), FRICTION.hysteresis_coefficient)
                power += float(lost) * u_e
        # a ball slides on its neighbour with nearly twice the rolling speed: k Q u_e = mu_b N 2 u_e
        thrust = K * nut.thrust_factor * loads / (2.0 * FRICTION.boundary_friction)
        sliding = 2.0 * u_e * neighbour_sliding(SCREW, rolling_motion(contact_motion(SCREW, angle)))
        power += float(np.sum(FRICTION.boundary_friction * thrust * sliding))
        # and shears the oil between them: two spheres at a gap of 1 um, up to what the contacts transmit beside balls
        radius = 0.5 * SCREW.ball_diameter
        full = len(loads) * np.pi * float(viscosity) * radius * np.log(radius / 1e-6) * sliding**2
        limit = (
            (1.0 - FRICTION.boundary_friction) * FRICTION.limiting_shear_coefficient * loads.sum() * sliding
        )
        power += (full**-4.0 + limit**-4.0) ** -0.25
        assert abs(nut.torque(1.0, K) * speed / power - 1.0) <= 1e-6
        assert abs(of_each / power) <= 5e-5


def test_shear_is_at_the_mean_temperature_of_the_film():
    """A film 8 K above the inlet shears as that of an inlet 8 K warmer with the same contact."""

    class Film(ClosedContacts):
        rise = 0.0

        def values(self, raceway, load, speed, temperature):
            found = super().values(raceway, load, speed, np.full_like(temperature, 303.0))
            return found | {"mean_rise": np.full_like(found["mean_rise"], self.rise)}

    same, warm = Film(film=1e-6), Film(film=1e-6)
    warm.rise = 8.0
    cold, heated, hot = (
        nut_powers(VG100, loads_at(1000.0), 50.0, T, film).shear
        for T, film in ((303.0, same), (303.0, warm), (311.0, same))
    )
    assert heated == pytest.approx(hot, rel=1e-9)
    assert heated < 0.95 * cold


def test_without_a_film_all_is_boundary_friction():
    """The thrust is that of mu_b; the shear does not depend on the oil, and is linear in mu_b."""
    dry = ClosedContacts(film=1e-11)
    nut = at(1000.0, 100.0, dry)
    assert nut.thrust_factor == pytest.approx(breakaway_factor(FRICTION), rel=1e-7)
    other = changed(VG100, lubricant={"eyring_stress": 1e7})
    assert at(1000.0, 100.0, dry, other).shear == pytest.approx(nut.shear, rel=1e-9)
    half = changed(VG100, friction={"boundary_friction": 0.06})
    assert at(1000.0, 100.0, dry, half).shear == pytest.approx(0.5 * nut.shear, rel=1e-6)


def test_thrust_is_that_of_two_contacts_at_the_same_creep():
    """Carter: mu Q y (2 - y) with y = creep/mu up to 1; the creep gives kappa Lambda Q in a full film."""

    def transmitted(mu, creep):
        y = min(creep / mu, 1.0)
        return 2.0 * mu * y * (2.0 - y)

    limit = FRICTION.limiting_shear_coefficient
    for kappa in (0.17, 1.0, 2.0):
        creep = brentq(lambda c, kappa=kappa: transmitted(limit, c) - kappa * limit, 0.0, limit)
        for boundary in (0.12, 0.02):
            law = changed(VG100, friction={"ball_thrust": kappa, "boundary_friction": boundary}).friction
            share = np.array([0.0, 0.3, 1.0])
            expected = [transmitted((1.0 - f) * limit + f * boundary, creep) / (kappa * limit) for f in share]
            assert np.max(np.abs(thrust_factor(law, share) / expected - 1.0)) <= 1e-9
    assert thrust_factor(FRICTION, 1.0) == pytest.approx(1.100, abs=5e-4)


def test_supply_only_takes_from_the_rolling_part():
    """SKF's replenishment on top of it: d, D of the bearing from pitch circle and ball diameter/0.3 = D - d."""
    short = at(1000.0, 2500.0, ClosedContacts())
    flooded = at(1000.0, 2500.0, ClosedContacts(), changed(VG100, friction={"supply_length": FLOODED}))
    greased = at(1000.0, 2500.0, ClosedContacts(), changed(VG100, friction={"replenishment_constant": 6e-8}))
    nu = 1e6 * float(eta0(VG100.lubricant, 303.0) / ambient_density(VG100.lubricant, 303.0))
    pitch, half = 2e3 * SCREW.nominal_radius, 0.5e3 * SCREW.ball_diameter / 0.3
    factor = float(replenishment_factor(6e-8, 4.4, 2500.0, nu, pitch - half, pitch + half))
    assert 0.2 < factor < 0.8
    assert greased.viscous_nut == pytest.approx(factor * short.viscous_nut, rel=1e-12)
    assert short.viscous_nut < flooded.viscous_nut
    for part in ("shear", "hysteresis", "sliding", "thrust_factor"):
        assert getattr(greased, part) == getattr(flooded, part)


def test_between_spacer_balls_nothing_slides():
    """The same loads on balls with smaller ones between them: neither oil nor thrust between neighbours."""
    spaced = changed(VG100, screw={"spacer_balls": True, "ball_count": 36, "loaded_ball_count": 36})
    dry = changed(VG100, friction={"neighbour_oil": 0.0})
    nut, same = (nut_powers(one, np.full(36, 30.0), 100.0, 303.0, ClosedContacts()) for one in (spaced, dry))
    k = default_friction_set(spaced).net_sliding_coefficient
    assert nut.torque(1.0, k) == pytest.approx(same.torque(1.0, 0.0), rel=1e-12)


FOUR = changed(VG100, screw={"preload_kind": FOUR_POINT})


def oversize(loaded, relieved, contacts):
    nuts = nuts_powers(FOUR, [relieved, loaded], contacts, 500.0 * RPM, 303.0)
    return [nut for _, nut in nuts]


def test_oversize_ball_free_of_two_flanks_is_a_ball_on_two_flanks():
    """To 1 %: under load the contact angle of a ball on two flanks opens, here by 0.9 degrees."""
    contacts, loads = ClosedContacts(), nut_loads(FOUR.screw, 1000.0, SCREW.loaded_ball_count)
    (free,) = oversize(1000.0, 0.0, contacts)
    two = nut_powers(VG100, loads, 500.0 * RPM, 303.0, contacts)
    for part in UnfittedTorques._fields:
        assert getattr(free, part) == pytest.approx(getattr(two, part), rel=1e-2)
    relieved, loaded = oversize(1000.0, 1e-6, contacts)
    assert loaded.shear == pytest.approx(free.shear, rel=1e-4)
    assert relieved.shear <= 1e-4 * free.shear

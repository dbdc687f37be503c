"""Films of rough contacts: load sharing by hand and in its limits, regressions against what is known of them."""

import math

import numpy as np
import pytest

from ballscrew_tehl.physics.asperity import Roughness, asperity_pressure, typical_roughness
from ballscrew_tehl.physics.film import film_groups, hamrock_dowson, nijenbanning_venner_moes
from ballscrew_tehl.physics.hertz import ellipse
from ballscrew_tehl.physics.rough_film import (
    asperity_share_of_lambda,
    johnson_greenwood_poon,
    load_share_film,
    masjedi_khonsari_line,
    masjedi_khonsari_point,
)

R_X, R_Y, E_PRIME = 2.18e-3, 61.8e-3, 226e9
#: sigma beta eta = 0.1, sigma/beta = 0.02: asperities that can carry a Hertz contact
HARD = typical_roughness(2e-7, product=0.1, slenderness=0.02)


def shared(load=30.0, u_e=0.1, roughness=HARD):
    groups = film_groups(load, u_e, R_X, E_PRIME, 0.1, 2e-8)
    p_max = ellipse(load, R_X, R_Y, E_PRIME).p_max
    smooth = nijenbanning_venner_moes(groups.M, groups.L, R_X / R_Y) * R_X * np.sqrt(2.0 * groups.U)
    return johnson_greenwood_poon(groups, R_X, R_Y, E_PRIME, p_max, roughness), smooth, p_max


def test_whole_load_on_the_oil_is_the_smooth_film():
    M, L = np.array([3.0, 200.0, 1e4]), np.array([4.0, 10.0, 14.0])
    assert (
        np.max(np.abs(load_share_film(M, L, 0.035, 1.0) / nijenbanning_venner_moes(M, L, 0.035) - 1.0))
        <= 1e-15
    )


@pytest.mark.parametrize("s", [0.9, 0.5, 0.1])
def test_film_of_a_share_is_that_of_softer_bodies_under_less_load(s):
    """The same film in metres from film_groups with load s F and modulus s E'."""
    real, part = (film_groups(k * 30.0, 0.5, R_X, k * E_PRIME, 0.1, 2e-8) for k in (1.0, s))
    h = load_share_film(real.M, real.L, R_X / R_Y, s) * R_X * math.sqrt(2 * real.U)
    expected = nijenbanning_venner_moes(part.M, part.L, R_X / R_Y) * R_X * math.sqrt(2 * part.U)
    assert abs(h / expected - 1.0) <= 1e-13


@pytest.mark.parametrize("s", [0.8, 0.3])
def test_limits_of_the_share_film(s):
    def ratio(M, L):
        return load_share_film(M, L, 1.0, s) / load_share_film(M, L, 1.0, 1.0)

    # elastic, piezoviscous: M^(-1/12) L^(3/4) s^(-1/2) is independent of s, as Johnson, Greenwood & Poon found
    assert abs(ratio(1e24, 1e4) - 1.0) <= 1e-3
    # rigid, isoviscous: M^-2 s^(-1/2) = 1/s^2, a film that only depends on its load
    assert abs(ratio(1e-3, 1e-9) * s**2 - 1.0) <= 1e-9


def test_load_balance():
    film, _, p_max = shared()
    p_a = asperity_pressure(HARD, E_PRIME, film.h_c)[0]
    assert abs(p_a - film.asperity_share * 2.0 / 3.0 * p_max) <= 1e-12 * p_max
    groups = film_groups(30.0, 0.1, R_X, E_PRIME, 0.1, 2e-8)
    h_c = (
        load_share_film(groups.M, groups.L, R_X / R_Y, 1.0 - film.asperity_share)
        * R_X
        * math.sqrt(2 * groups.U)
    )
    assert abs(film.h_c / h_c - 1.0) <= 1e-12
    assert 0.05 <= film.asperity_share <= 0.95


def test_smooth_limit():
    for roughness in (Roughness(0.0, 5e10, 1e-5), typical_roughness(1e-9)):
        film, smooth, _ = shared(roughness=roughness)
        assert film.asperity_share <= 1e-15
        assert abs(film.h_c / smooth - 1.0) <= 1e-12


def test_share_falls_with_speed_and_grows_with_roughness():
    speeds = np.array([1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0])
    film, smooth, _ = shared(u_e=speeds)
    assert np.max(np.diff(film.asperity_share)) <= 0.0
    assert np.min(film.h_c / smooth) >= 1.0 - 1e-12
    assert film.asperity_share[-1] <= 1e-6
    alone = [shared(u_e=u)[0].asperity_share for u in speeds]
    assert np.max(np.abs(alone - film.asperity_share)) <= 1e-15
    shares = [
        shared(roughness=typical_roughness(s, 0.1, 0.02))[0].asperity_share for s in (5e-8, 1e-7, 2e-7, 4e-7)
    ]
    assert np.min(np.diff(shares)) > 0.0


def test_share_of_lambda():
    assert asperity_share_of_lambda(0.0) == 1.0
    # below 3 % at 1.7 and 0.1 % at 3: "almost all the load is supported by the film over 2"
    assert np.max(asperity_share_of_lambda(np.array([1.7, 2.0, 3.0])) / np.array([0.035, 0.02, 0.002])) <= 1.0
    assert np.max(np.diff(asperity_share_of_lambda(np.linspace(0.0, 5.0, 50)))) < 0.0
    assert abs(asperity_share_of_lambda(2.0, B=0.5, C=1.0) - math.exp(-1.0)) <= 1e-15


#: the case of Fig. 2 of Masjedi & Khonsari 2012
FIGURE_2 = {"U": 1e-11, "W": 1e-4, "G": 4500.0, "hardness_ratio": 0.01}


@pytest.mark.parametrize(("roughness", "oil_pressure"), [(5e-6, 1.0), (2e-5, 0.82), (5e-5, 0.58)])
def test_share_of_a_line_against_the_figure(roughness, oil_pressure):
    """Oil pressure over Hertz pressure in the middle, as a review describes the figure; second hand, two digits."""
    share = masjedi_khonsari_line(**FIGURE_2, roughness_ratio=roughness).asperity_share
    assert abs(share - (1.0 - oil_pressure)) <= 0.03


def test_smooth_line_films_against_pan_and_hamrock():
    U, W, G = (
        axis.ravel() for axis in np.meshgrid([1e-12, 1e-11, 1e-10], [5e-5, 1e-4, 2e-4], [3500.0, 4500.0])
    )
    film = masjedi_khonsari_line(U, W, G, 0.0, 0.01)
    assert np.max(np.abs(film.H_c / (2.922 * W**-0.166 * U**0.692 * G**0.470) - 1.0)) <= 0.09
    assert np.max(np.abs(film.H_m / (1.714 * W**-0.128 * U**0.694 * G**0.568) - 1.0)) <= 0.12
    assert np.max(film.asperity_share) == 0.0


@pytest.mark.parametrize("radius_ratio", [1.0, 0.3, 0.12, 0.04])
def test_smooth_point_films_against_hamrock_and_dowson(radius_ratio):
    U, W = (axis.ravel() for axis in np.meshgrid([1e-12, 1e-11, 1e-10], [1e-7, 1e-6, 1e-5]))
    film = masjedi_khonsari_point(U, W, 4500.0, radius_ratio, 0.0, 0.01)
    H_c, H_m = hamrock_dowson(U, W, 4500.0, radius_ratio)
    assert np.max(np.abs(film.H_c / H_c - 1.0)) <= 0.14
    assert np.max(np.abs(film.H_m / H_m - 1.0)) <= 0.14


@pytest.mark.parametrize(
    "film", [lambda s: masjedi_khonsari_line(1e-11, 1e-4, 4500.0, s, 0.03),
             lambda s: masjedi_khonsari_point(1e-11, 1e-5, 4500.0, 0.1, s, 0.03)],
    ids=["line", "point"],
)  # fmt: skip
def test_regressions_grow_with_roughness(film):
    roughness = np.array([0.0, 1e-6, 1e-5, 3e-5, 1e-4, 1e-3])
    together = film(roughness)
    assert np.min(np.diff(together.H_c)) > 0.0
    assert np.min(np.diff(together.H_m)) > 0.0
    assert np.min(np.diff(together.asperity_share)) >= 0.0
    assert (together.asperity_share[0], together.asperity_share[-1]) == (0.0, 1.0)
    assert np.max(np.abs([film(s).H_c for s in roughness] - together.H_c)) <= 1e-19


@pytest.mark.parametrize("bad", [-1.0, math.nan, math.inf])
def test_bad_input(bad):
    with pytest.raises(ValueError, match=r"fluid_share = .*needs finite, 0 to 1"):
        load_share_film(100.0, 10.0, 1.0, bad)
    with pytest.raises(ValueError, match=r"p_max = .* Pa; needs finite, > 0"):
        johnson_greenwood_poon(film_groups(1.0, 1.0, R_X, E_PRIME, 0.1, 2e-8), R_X, R_Y, E_PRIME, bad, HARD)
    with pytest.raises(ValueError, match="lambda_ratio = "):
        asperity_share_of_lambda(bad)
    with pytest.raises(ValueError, match="B = "):
        asperity_share_of_lambda(1.0, B=bad)
    with pytest.raises(ValueError, match="roughness_ratio = "):
        masjedi_khonsari_line(1e-11, 1e-4, 4500.0, bad, 0.01)
    with pytest.raises(ValueError, match="hardness_ratio = "):
        masjedi_khonsari_point(1e-11, 1e-4, 4500.0, 1.0, 1e-5, bad)
    with pytest.raises(ValueError, match="radius_ratio = "):
        masjedi_khonsari_point(1e-11, 1e-4, 4500.0, bad, 1e-5, 0.01)


def test_out_of_range():
    for share in (0.0, 1.1):
        with pytest.raises(ValueError, match="fluid_share"):
            load_share_film(100.0, 10.0, 1.0, share)
    with pytest.raises(ValueError, match="short axis"):
        johnson_greenwood_poon(film_groups(1.0, 1.0, R_X, E_PRIME, 0.1, 2e-8), R_Y, R_X, E_PRIME, 1e9, HARD)

"""Closed formulas of the film and of the asperity load share of rough contacts, for comparison with the solver.

U, W, G with the mean speed and E_prime = 2/sum((1-nu^2)/E), as in film.py; x is the rolling direction.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .asperity import Roughness, asperity_pressure
from .bounds import needs, needs_not_negative, needs_positive
from .film import FilmGroups, nijenbanning_venner_moes

#: bisections of the asperity share: 2^-60
_BISECTIONS = 60


class RoughFilm(NamedTuple):
    """Central and minimum film over R_x, and the asperities' share of the load, 0 to 1."""

    H_c: Any
    H_m: Any
    asperity_share: Any


class LoadSharing(NamedTuple):
    """Central film [m] and the asperities' share of the load, 0 to 1."""

    h_c: Any
    asperity_share: Any


def load_share_film(M: Any, L: Any, radius_ratio: Any, fluid_share: Any) -> Any:
    """Central film of an elliptical contact whose oil carries only a share of the load.

    Parameters   M, L : float or array, > 0, Moes groups of the whole load;  radius_ratio : R_x/R_y, 0 < ratio <= 1;
                 fluid_share : s, 0 < s <= 1
    Returns      H_c = (h/R_x) (2U)^(-1/2) with U of the real modulus, broadcast
    Raises       ValueError: not finite or out of range
    Validity     that of nijenbanning_venner_moes; s uniform over the contact.  In the elastic-piezoviscous limit
                 the film does not depend on s, as Johnson, Greenwood & Poon found
    Source       Johnson, Greenwood & Poon, Wear 19 (1972) 91; in the form of Gelinck & Schipper, Tribol Int 33
                 (2000) 175, 1/s = gamma_1 [both from memory, the scaling derived anew]: the bodies deform by
                 p = p_oil/s, so the oil is in a contact of load s F and modulus s E', in which
                 M -> s^(3/4) M, L -> s^(3/4) L, U -> U/s
    """
    needs(
        (np.asarray(fluid_share) > 0.0) & (np.asarray(fluid_share) <= 1.0),
        "fluid_share",
        fluid_share,
        "0 to 1",
    )
    s = np.asarray(fluid_share, dtype=float)
    return nijenbanning_venner_moes(M * s**0.75, L * s**0.75, radius_ratio) / np.sqrt(s)


def johnson_greenwood_poon(
    groups: FilmGroups, R_x: Any, R_y: Any, E_prime: float, p_max: Any, roughness: Roughness
) -> LoadSharing:
    """Central film and asperity load share of a rough elliptical contact by load sharing.

    Parameters   groups : FilmGroups, see film_groups;  R_x, R_y : float or array [m], R_x <= R_y;
                 E_prime : float [Pa];  p_max : float or array [Pa], Hertz pressure;  roughness : Roughness
    Returns      LoadSharing, broadcast.  The film is that of an incompressible oil between the mean planes
    Raises       ValueError: not finite or not positive, R_x > R_y
    Validity     isothermal, flooded; the asperities press with p_a(h_c) on the Hertz ellipse, the oil carries the
                 rest.  No effect of the roughness on the flow (h/sigma above about 1)
    Source       Johnson, Greenwood & Poon, Wear 19 (1972) 91 with the asperities of Greenwood & Tripp 1970:
                 share f = p_a(h_c)/(2 p_max/3), h_c by load_share_film with s = 1 - f; f is unique because h_c grows
                 with f and p_a falls with h_c
    Example
        >>> from .asperity import typical_roughness
        >>> from .film import film_groups
        >>> from .hertz import ellipse
        >>> groups = film_groups(30.0, 0.1, 2.18e-3, 226e9, 0.1, 2e-8)
        >>> p_max = ellipse(30.0, 2.18e-3, 61.8e-3, 226e9).p_max
        >>> film = johnson_greenwood_poon(groups, 2.18e-3, 61.8e-3, 226e9, p_max, typical_roughness(2e-7))
        >>> round(float(film.h_c) * 1e9), round(float(film.asperity_share), 4)
        (81, 0.0176)
    """
    needs_positive(R_x=R_x, p_max=p_max, E_prime=E_prime)
    ratio, length = np.asarray(R_x) / R_y, R_x * np.sqrt(2.0 * groups.U)
    mean = 2.0 * np.asarray(p_max) / 3.0
    shape = np.broadcast(ratio, length, mean, groups.M, groups.L).shape
    low, high = np.zeros(shape), np.ones(shape)
    for _ in range(_BISECTIONS):
        share = 0.5 * (low + high)
        h_c = length * load_share_film(groups.M, groups.L, ratio, 1.0 - share)
        too_low = asperity_pressure(roughness, E_prime, h_c)[0] > share * mean
        low, high = np.where(too_low, share, low), np.where(too_low, high, share)
    h_c = length * load_share_film(groups.M, groups.L, ratio, 1.0 - low)
    return LoadSharing(h_c, low)


def asperity_share_of_lambda(lambda_ratio: Any, B: float = 1.8, C: float = 1.2) -> Any:
    """Asperity load share as a function of the film ratio alone, exp(-B Lambda^C).

    Parameters   lambda_ratio : float or array, central film over composite rms roughness, >= 0;  B, C : float, > 0
    Returns      share, 0 to 1, shaped like lambda_ratio
    Raises       ValueError: not finite or negative
    Validity     B = 1.8, C = 1.2: longitudinal roughness, p_max below 0.4 GPa, used by Aihara for roller ends; the
                 share of a contact of higher pressure is smaller.  Other B, C: fits to one's own surfaces
    Source       Aihara, J Tribol 109 (1987) 471, Eq. (13), after Patir & Cheng [read; second place: an open ball
                 screw program]; form and B, C of the surfaces: Zhou & Hoeprich, J Tribol 113 (1991) 590, Eq. (29)
    Example
        >>> round(float(asperity_share_of_lambda(1.0)), 3)
        0.165
    """
    needs_not_negative(lambda_ratio=lambda_ratio)
    needs_positive(B=B, C=C)
    return np.exp(-B * np.asarray(lambda_ratio, dtype=float) ** C)


def masjedi_khonsari_line(U: Any, W: Any, G: Any, roughness_ratio: Any, hardness_ratio: Any) -> RoughFilm:
    """Films and asperity load share of a rough line contact.

    Parameters   U, W, G : float or array, > 0, U = eta0 u_e/(E' R), W = load per length/(E' R), G = alpha E';
                 roughness_ratio : sigma/R, >= 0;  hardness_ratio : V, Vickers hardness/E', > 0
    Returns      RoughFilm, broadcast, H = h/R.  differs from paper: the share is limited to 1
    Raises       ValueError: not finite, not positive, roughness negative
    Validity     isothermal, flooded, elastic-plastic asperities on one surface (as Greenwood & Williamson, which
                 presses about 10 times harder than Greenwood & Tripp at the same sigma beta eta)
    Source       Masjedi & Khonsari, J Tribol 134 (2012) 011503.  UNVERIFIED: constants from memory, no readable copy
                 was found.  Consistent with them: the smooth films are within 12 % of Pan & Hamrock 1989 (3 % in
                 the middle of their range), and the share within 0.03 of the oil pressures that a review describes for
                 Fig. 2 of the paper
    """
    needs_positive(U=U, W=W, G=G, hardness_ratio=hardness_ratio)
    needs_not_negative(roughness_ratio=roughness_ratio)
    s, V = np.asarray(roughness_ratio, dtype=float), hardness_ratio
    H_c = 2.691 * W**-0.135 * U**0.705 * G**0.556
    H_c = H_c * (1.0 + 0.2 * s**1.222 * V**0.223 * W**-0.229 * U**-0.748 * G**-0.842)
    H_m = 1.652 * W**-0.077 * U**0.716 * G**0.695
    H_m = H_m * (1.0 + 0.026 * s**1.120 * V**0.185 * W**-0.312 * U**-0.809 * G**-0.977)
    contacts = 4470.0 * s**6.015 * V**1.168 * W**0.485 * U**-3.741 * G**-2.898
    per_cent = 0.005 * W**-0.408 * U**-0.088 * G**0.103 * np.log1p(contacts)
    return RoughFilm(H_c, H_m, np.minimum(0.01 * per_cent, 1.0))


def masjedi_khonsari_point(
    U: Any, W: Any, G: Any, radius_ratio: Any, roughness_ratio: Any, hardness_ratio: Any
) -> RoughFilm:
    """Films and asperity load share of a rough elliptical contact.

    Parameters   U, W, G : float or array, > 0, as in film_groups;  radius_ratio : R_x/R_y, 0 < ratio <= 1;
                 roughness_ratio : sigma/R_x, >= 0;  hardness_ratio : V, Vickers hardness/E', > 0
    Returns      RoughFilm, broadcast, H = h/R_x.  differs from paper: the share is limited to 1
    Raises       ValueError: not finite, out of range
    Validity     as masjedi_khonsari_line, 1 <= k <= 8; k = 1.0339 (R_y/R_x)^0.636 as in hamrock_dowson
    Source       Masjedi & Khonsari, Tribol Int 82 (2015) 228.  UNVERIFIED: constants from memory, no readable copy
                 was found, in particular none of the share (its abstract names the ellipticity as an argument, the
                 form here has none).  Consistent: the smooth films are within 14 % of Hamrock & Dowson 1977
    """
    needs_positive(U=U, W=W, G=G, hardness_ratio=hardness_ratio)
    needs_not_negative(roughness_ratio=roughness_ratio)
    ratio = np.asarray(radius_ratio, dtype=float)
    needs((ratio > 0.0) & (ratio <= 1.0), "radius_ratio", radius_ratio, "0 < R_x/R_y <= 1")
    k = 1.0339 * ratio**-0.636
    s, V = np.asarray(roughness_ratio, dtype=float), hardness_ratio
    H_c = 3.672 * W ** (-0.045 * k**0.18) * U ** (0.663 * k**0.025) * G ** (0.502 * k**0.064)
    H_c = H_c * (1.0 - 0.573 * np.exp(-0.74 * k))
    H_c = H_c * (1.0 + 0.025 * s**1.248 * V**0.119 * W**-0.133 * U**-0.884 * G**-0.977 * k**0.081)
    H_m = 1.637 * W ** (-0.09 * k**-0.15) * U ** (0.711 * k**-0.023) * G ** (0.65 * k**-0.045)
    H_m = H_m * (1.0 - 0.974 * np.exp(-0.676 * k))
    H_m = H_m * (1.0 + 0.141 * s**1.073 * V**0.149 * W**-0.044 * U**-0.828 * G**-0.954 * k**-0.395)
    contacts = s**4.689 * V**0.509 * W**-0.501 * U**-2.9 * G**-2.87
    per_cent = 10.0 * W**-0.083 * U**0.143 * G**0.314 * np.log1p(contacts)
    return RoughFilm(H_c, H_m, np.minimum(0.01 * per_cent, 1.0))

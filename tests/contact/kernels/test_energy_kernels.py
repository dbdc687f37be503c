"""Energy kernels: compiled against NumPy, forward and back, with flow, heating and cooling of every sign."""

import energy_twins as twins
import numpy as np
import pytest
from contact_cases import OIL

from ballscrew_tehl.contact.film import energy
from ballscrew_tehl.contact.film import flow as film_flow
from ballscrew_tehl.contact.film.oil import oil_table
from ballscrew_tehl.contact.film.transport import HeatTransport
from ballscrew_tehl.physics import lubricant

T_IN, HEAT, CONDUCTIVITY = 303.15, 2000.0, 0.14
NY, NX, NZ = 5, 10, 6
X = 1e-4 * np.cumsum(np.concatenate([[0.0], np.linspace(0.6, 1.4, NX - 1)]))
H_Y = 2e-4
WIDTH = np.diff(np.concatenate([[X[0]], 0.5 * (X[1:] + X[:-1]), [X[-1]]]))
#: columns that are solved: to the edges, and short of them
START, END = np.array([1, 1, 2, 3, 1]), np.array([NX - 1, NX - 1, NX - 2, NX - 3, NX - 1])
ALONG = {"forward": 1.0, "backward": -1.0, "both": 0.0}
MIRROR = {"mirror": True, "whole plane": False}


class Film:
    """Random flow, sources and temperatures; rupture where the flux is less than the film could carry."""

    def __init__(self, mirror, along, seed=7):
        rng = np.random.default_rng(seed)
        self.mirror = mirror
        self.h = 1e-6 * (0.3 + rng.random((NY, NX)))
        self.t = T_IN + 60.0 * rng.random((NY, NX, NZ + 1))
        # walls and inner levels a few kelvin from the temperatures of the flow
        self.t_at = self.t + 3.0 * rng.normal(size=self.t.shape)
        self.flow = flow = film_flow.FilmFlow.empty(NY, NX, NZ)
        shape = flow.shear.shape
        flow.m_x[:] = 1e-3 * (ALONG[along] + 0.4 * rng.normal(size=shape))
        flow.m_y[:] = 3e-4 * rng.normal(size=shape)
        flow.shear[:] = 1e7 * rng.random(shape)
        # sliding against the pressure flow: its part of the dissipation may be negative
        flow.sliding[:] = flow.shear * rng.uniform(-0.3, 1.0, shape)
        flow.driven[:] = 3.0 * rng.random(shape)
        flow.stress_share[:] = rng.uniform(0.3, 1.0, shape)
        flow.stress_x[:] = 1e7 * rng.random((NY, NX))
        flow.compression[:] = 1e4 * rng.normal(size=shape)
        flow.squeeze[:] = 1e-4 * rng.normal(size=shape)
        flow.soft[:] = 0.05 * rng.random(shape)
        flow.stiff[:] = 1e-8 * rng.random(shape)
        flow.rate[:] = 1.0 + rng.random(shape)
        # stress (rate/fluidity) times rate: heat as large as that of shear
        flow.fluidity[:] = 3e-7 * (0.5 + rng.random((NY, NX)))
        self.face = energy.FaceFlow.empty(START.copy(), END.copy(), NX, NZ)
        self.flux_x = 1e-3 * (
            ALONG[along]
            * rng.uniform(
                [[0.8], [0.8], [1.1], [0.7], [0.9]], [[1.5], [0.9], [1.5], [1.5], [1.5]], (NY, NX - 1)
            )
            + 0.1 * rng.normal(size=(NY, NX - 1))
        )
        self.flux_y = 1e-5 * rng.normal(size=(NY - 1, NX))
        # the largest pressure at any column: continuity counts from there
        self.p = rng.random((NY, NX))
        energy.face_flow(WIDTH, H_Y, mirror, HEAT, self.p, self.flux_x, self.flux_y, flow, self.face)

    def sweep(self, forward, t=None, damped=False, whole=True):
        """The kernel's answer by name."""
        out = {"t": (self.t if t is None else t).copy(), "heat": HeatTransport.empty(NY, X, NZ)}
        out |= {"q_a": np.zeros((NY, NX)), "q_b": np.zeros((NY, NX)), "response": np.zeros((NY, NX, 4))}
        change = energy.sweep(
            X, WIDTH, H_Y, self.mirror, self.h, CONDUCTIVITY, T_IN, self.flow, self.face, self.t_at, damped,
            forward, whole, *out.values(),
        )  # fmt: skip
        return out | {"change": change}


@pytest.mark.parametrize("mirror", MIRROR.values(), ids=MIRROR)
@pytest.mark.parametrize("along", ALONG)
def test_face_flow_is_the_numpy_twin(mirror, along):
    film = Film(mirror, along)
    flow, face = film.flow, film.face
    x, y, z, reverse = twins.face_flow(
        WIDTH, H_Y, mirror, HEAT, film.p, film.flux_x, film.flux_y, flow.m_x, flow.m_y, START, END
    )
    # neither the first nor the last column everywhere
    assert np.unique(film.p[:, 1:-1].argmax(axis=1)).size > 2
    for found, twin in ((face.x, x), (face.y, y), (face.z, z)):
        np.testing.assert_allclose(found, twin, rtol=1e-11, atol=1e-12 * np.abs(twin).max())
    np.testing.assert_array_equal(face.reverse, reverse)
    if along == "forward":
        # some faces are ruptured, others are not
        full = HEAT * 0.5 * (flow.m_x[1, 1:] + flow.m_x[1, :-1])
        kept = np.ptp(face.x[1], axis=1) / np.ptp(full, axis=1)
        assert kept.min() < 0.95
        assert kept.max() == pytest.approx(1.0)


@pytest.mark.parametrize("x", [-400.0, -30.0, -1.1e-3, -0.9e-3, 0.0, 0.9e-3, 1.1e-3, 2.0, 30.0, 400.0])
def test_bernoulli_function(x):
    # series: next term x^4/720
    exact = 1.0 if x == 0.0 else x / np.expm1(x)
    assert energy.bernoulli(x) == pytest.approx(exact, rel=1e-13, abs=1e-100)


@pytest.mark.parametrize("mirror", MIRROR.values(), ids=MIRROR)
@pytest.mark.parametrize("along", ALONG)
def test_heat_through_the_side_faces_is_the_numpy_twin(mirror, along):
    film = Film(mirror, along)
    for j in range(0 if mirror else 1, NY - 1):
        for i in range(START[j], END[j]):
            own = film.t[j, i] + np.linspace(-5.0, 8.0, NZ + 1)
            faces = film.face.x, film.face.y
            diag, rest = np.array([
                energy.sideways(X, WIDTH, H_Y, mirror, film.t, T_IN, *faces, j, i, k) for k in range(NZ + 1)
            ]).T  # fmt: skip
            twin = twins.side_heat(X, WIDTH, H_Y, mirror, film.t, T_IN, film.face, j, i, own)
            assert np.all(diag >= 0.0)
            np.testing.assert_allclose(rest - diag * own, twin, rtol=1e-9, atol=1e-12 * np.abs(rest).max())


DIRECTIONS = {"forward sweep": (True, True), "part of it": (True, False), "backward sweep": (False, True)}


@pytest.mark.parametrize("mirror", MIRROR.values(), ids=MIRROR)
@pytest.mark.parametrize(("forward", "whole"), DIRECTIONS.values(), ids=DIRECTIONS)
@pytest.mark.parametrize("along", ALONG)
@pytest.mark.parametrize("damped", [False, True], ids=["linearised", "damped"])
def test_sweep_is_the_numpy_twin(mirror, forward, whole, along, damped):
    film = Film(mirror, along)
    found = film.sweep(forward, damped=damped, whole=whole)
    twin = twins.sweep(
        X,
        WIDTH,
        H_Y,
        mirror,
        film.h,
        CONDUCTIVITY,
        T_IN,
        film.flow,
        film.face,
        film.t_at,
        damped,
        forward,
        whole,
        film.t,
    )
    if (forward and whole) or along != "forward":
        assert np.abs(twin["t"] - film.t).max() == pytest.approx(
            energy.SWEEP_LIMIT
        )  # some columns are limited
        assert (np.abs(twin["t"] - film.t) < energy.SWEEP_LIMIT).mean() > 0.1
    heat = found.pop("heat")
    found |= {name: getattr(heat, name) for name in ("up_1", "up_2", "source", "squeeze", "lift", "widen")}
    found["answer"] = np.zeros_like(twin["answer"])
    for j, i in zip(*np.nonzero(heat.pivot[..., 0]), strict=True):
        found["answer"][j, i] = twins.column_answer(heat, j, i)
    assert sorted(found) == sorted(twin)
    for name, value in found.items():
        scale = np.abs(twin[name]).max()
        np.testing.assert_allclose(value, twin[name], rtol=1e-8, atol=1e-10 * scale, err_msg=name)
    # walls, and columns outside the ends of a line, are held
    held = np.ones((NY, NX), dtype=bool)
    for j in range(0 if mirror else 1, NY - 1):
        held[j, START[j] : END[j]] = False
    np.testing.assert_array_equal(found["t"][held], film.t[held])
    np.testing.assert_array_equal(found["t"][..., [0, -1]], film.t[..., [0, -1]])


@pytest.mark.parametrize("i", [2, 5])
@pytest.mark.parametrize("at", ["face before", "own face"])
def test_heat_of_reversing_flow_is_continuous(i, at):
    """Nothing jumps where a face turns, nor where the slope begins to count in full; and that slope does count."""
    film, eps = Film(True, "forward"), 1e-9
    face = i - 2 if at == "face before" else i - 1
    flow = np.abs(film.face.x[1, : i + 1, 3]).mean()
    film.face.x[1, : i + 1, 3] = flow

    def heat(here):
        film.face.x[1, face, 3] = here * flow
        diag, rest = energy.sideways(X, WIDTH, H_Y, True, film.t, T_IN, film.face.x, film.face.y, 1, i, 3)
        return rest - diag * film.t[1, i, 3]

    size = abs(heat(1.0)) + flow / WIDTH[i]
    for here in (0.0, 0.25, 4.0):
        assert abs(heat(here + eps) - heat(here - eps)) <= 1e-5 * size
    assert abs(heat(0.25) - heat(0.01)) > 1e-2 * size


@pytest.mark.parametrize("forward", [True, False], ids=["forward in part", "backward"])
def test_sweep_visits_columns_with_reverse_flow_only(forward):
    film = Film(True, "forward")
    film.face.reverse[:] = [0, 4, 3, 0, 0]
    found = film.sweep(forward, whole=False)
    visited = (found["q_a"] != 0.0).sum(axis=1)
    np.testing.assert_array_equal(visited, [0, 4, 2, 0, 0])  # from their start on


@pytest.mark.parametrize("mirror", MIRROR.values(), ids=MIRROR)
@pytest.mark.parametrize(("j", "i"), [(1, 1), (2, 2), (3, 3)])
def test_response_is_the_change_of_flux_with_the_wall_temperatures(mirror, j, i):
    """First column of a line that a forward sweep visits, before its walls have influenced others.

    No flow across and no compression at the walls, whose response to the wall temperature is not included.
    """
    film = Film(mirror, "both")
    film.face.y[:], film.flow.compression[..., [0, -1]] = 0.0, 0.0
    # near its solution, so that no node is limited
    for _ in range(3):
        film.t = film.sweep(True)["t"]
    film.flow.shear[:] *= 0.2
    base = film.sweep(True)
    a_a, b_a, a_b, b_b = base["response"][j, i]
    for wall, fluxes in ((0, (-a_a, a_b)), (-1, (b_a, -b_b))):
        warmer = film.t.copy()
        warmer[j, i, wall] += 0.5
        changed = film.sweep(True, warmer)
        for q, slope in zip(("q_a", "q_b"), fluxes, strict=True):
            # linear in the wall temperature: rounding only
            assert (changed[q] - base[q])[j, i] == pytest.approx(0.5 * slope, rel=1e-6)


def test_sheared_films_are_the_closed_form_of_every_column():
    """Two passes: the slope of viscosity of the walls, then that of half the rise in the middle."""
    rng = np.random.default_rng(4)
    oil = oil_table(OIL, T_IN)
    p, h, slip = 1.5e9 * rng.random((2, 3)), 1e-7 * (1.0 + rng.random((2, 3))), 2.0 * rng.normal(size=(2, 3))
    t_a, t_b = T_IN + 20.0 * rng.random((2, 2, 3))
    t, q = np.full((2, 3, 9), np.nan), np.full((2, 3), np.nan)
    energy.sheared_films(oil, p, h, CONDUCTIVITY, slip, t_a, t_b, t, q)
    assert t.max() - T_IN > 40.0
    z = np.linspace(0.0, 1.0, 9)
    for j, i in np.ndindex(p.shape):
        wall = 0.5 * (t_a[j, i] + t_b[j, i])
        straight, at = t_a[j, i] + (t_b[j, i] - t_a[j, i]) * z, wall
        for _ in range(2):
            up, down = (np.log(lubricant.viscosity(OIL, p[j, i], at + d)) for d in (0.125, -0.125))
            soft = (down - up) / 0.25
            nahme = soft * lubricant.viscosity(OIL, p[j, i], wall) * slip[j, i] ** 2 / CONDUCTIVITY
            a = np.arccosh(np.sqrt(1.0 + nahme / 8.0))
            expected = straight + 2.0 / soft * np.log(np.cosh(a) / np.cosh(a * (1.0 - 2.0 * z)))
            at = 0.5 * (wall + expected[4])
        # slope of the table within 0.25 K
        np.testing.assert_allclose(t[j, i] - straight, expected - straight, rtol=5e-3, atol=1e-9)
        half = 0.5 * (wall + expected[4])
        assert abs(half - wall) < 200.0
        assert q[j, i] == pytest.approx(4.0 * CONDUCTIVITY * a * np.tanh(a) / (soft * h[j, i]), rel=5e-3)

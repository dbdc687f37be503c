"""Film coefficients: compiled against NumPy with the oil laws of the lubricant module."""

import contact_twins as twins
import numpy as np
import pytest
from contact_cases import OIL

from ballscrew_tehl import lubricant
from ballscrew_tehl.contact import film_flow
from ballscrew_tehl.contact.moes import reference_oil

T_IN = 303.15
P_MAX = 1.1e9
OILS = {
    "roelands, compressible, thermal expansion": OIL,
    "barus": OIL.model_copy(update={"pressure_law": "barus"}),
    "incompressible": OIL.model_copy(update={"density_law": "incompressible"}),
    "barus, incompressible, one viscosity": reference_oil("barus"),
}
#: interpolation of ln eta0 in steps of 0.25 K (1e-5 of eta0), enlarged by the pressure term of Roelands
TABLE = 1e-4


def columns(n_z=6, seed=5):
    rng = np.random.default_rng(seed)
    p = np.concatenate([np.zeros((3, 1)), 1.2 * rng.random((3, 4))], axis=1)
    return p, T_IN + 90.0 * rng.random((3, 5, n_z + 1))


def viscosity_and_density(oil, p, t):
    """From the lubricant module, bound to nothing of the solver; density relative to that of reference."""
    p = np.asarray(p)[..., None] * P_MAX
    return lubricant.viscosity(oil, p, t), lubricant.density(oil, p, t) / oil.density


def coefficients(oil, p, t, u_a=3.0, u_b=1.0, scale=0.7):
    out = tuple(np.full(p.shape, np.nan) for _ in range(4))
    film_flow.film_coefficients(
        film_flow.oil_table(oil, T_IN), P_MAX, p, t, u_a, u_b, 0.5 * (u_a + u_b), scale, *out
    )
    return out


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
@pytest.mark.parametrize("speeds", [(3.0, 1.0), (0.5, 2.0), (1.0, -0.4)])
def test_column_integrals_are_the_numpy_twin(oil, speeds):
    p, t = columns()
    table = film_flow.oil_table(oil, T_IN)
    twin = np.stack(twins.column_integrals(*viscosity_and_density(oil, p, t)), axis=-1)
    for j, i in np.ndindex(p.shape):
        compiled = film_flow.column_integrals(table, p[j, i] * P_MAX, t[j, i], *speeds)
        np.testing.assert_allclose(compiled, twin[j, i], rtol=TABLE)


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
@pytest.mark.parametrize(("u_a", "u_b"), [(3.0, 1.0), (0.5, 2.0), (1.0, -0.4)])
def test_film_coefficients_are_the_numpy_twin(oil, u_a, u_b):
    p, t = columns()
    ln_phi, dln_phi, g, dg = coefficients(oil, p, t, u_a, u_b)

    def twin(p):
        e0, e1, r0, r1, r2 = twins.column_integrals(*viscosity_and_density(oil, p, t))
        return np.log(12.0 * 0.7 * (r1 * e0 / e1 - r2)), (u_a * r0 + (u_b - u_a) * e0 * r1) / (
            0.5 * (u_a + u_b)
        )

    np.testing.assert_allclose(ln_phi, twin(p)[0], atol=10.0 * TABLE)  # r1 e0/e1 - r2 is a small difference
    np.testing.assert_allclose(g, twin(p)[1], rtol=TABLE)
    # slopes: one-sided over 1e-5, twin central
    ahead, behind = twin(p + 1e-4), twin(np.maximum(p - 1e-4, 0.0))
    step = 1e-4 + np.minimum(p, 1e-4)
    np.testing.assert_allclose(dln_phi, (ahead[0] - behind[0]) / step, rtol=2e-3)
    np.testing.assert_allclose(dg, (ahead[1] - behind[1]) / step, rtol=2e-3, atol=2e-4)


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
def test_isothermal_coefficients_are_the_oil_laws(oil):
    p, _ = columns()
    out = tuple(np.full(p.shape, np.nan) for _ in range(4))
    film_flow.isothermal_coefficients(film_flow.oil_table(oil, T_IN), P_MAX, p, 321.0, 0.7, *out)

    def law(p):
        eta, rho = viscosity_and_density(oil, p, np.full((*p.shape, 1), 321.0))
        return np.log(0.7 * rho / eta)[..., 0], rho[..., 0]

    ahead, behind, step = law(p + 1e-4), law(np.maximum(p - 1e-4, 0.0)), 1e-4 + np.minimum(p, 1e-4)
    np.testing.assert_allclose(out[0], law(p)[0], atol=TABLE)
    np.testing.assert_allclose(out[2], law(p)[1], rtol=1e-12)
    np.testing.assert_allclose(out[1], (ahead[0] - behind[0]) / step, rtol=2e-3)
    np.testing.assert_allclose(out[3], (ahead[1] - behind[1]) / step, rtol=2e-3, atol=1e-9)


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
def test_generalised_coefficients_of_one_temperature_are_the_isothermal_ones(oil):
    p, _ = columns()
    n_z = 40
    uniform = np.full((*p.shape, n_z + 1), T_IN)
    general = coefficients(oil, p, uniform)
    isothermal = tuple(np.full(p.shape, np.nan) for _ in range(4))
    film_flow.isothermal_coefficients(film_flow.oil_table(oil, T_IN), P_MAX, p, T_IN, 0.7, *isothermal)
    # the trapezoidal rule makes r2 too large by 1/(12 n_z^2), which is 1/n_z^2 of the fluidity
    np.testing.assert_allclose(general[0], isothermal[0], atol=1.01 / n_z**2)
    np.testing.assert_allclose(general[2], isothermal[2], rtol=1e-12)


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
def test_viscosity_and_its_slope_over_temperature(oil):
    table = film_flow.oil_table(oil, T_IN)
    for p, t in ((0.0, 303.15), (0.4e9, 351.7), (1.2e9, 420.2)):
        ln_eta, slope = film_flow.ln_viscosity(table, film_flow.pressure_factor(table, p), t)
        up, down = (np.log(lubricant.viscosity(oil, p, t + dt)) for dt in (0.5, -0.5))
        assert ln_eta == pytest.approx(np.log(lubricant.viscosity(oil, p, t)), abs=TABLE)
        assert slope == pytest.approx(up - down, rel=5e-3, abs=1e-12)  # slope of the chord within 0.25 K
        density = film_flow.density_ratio(table, p, t)
        assert density == pytest.approx(lubricant.density(oil, p, t) / oil.density, rel=1e-12)


def test_temperatures_beyond_the_table_keep_its_ends():
    table = film_flow.oil_table(OIL, T_IN)
    ends = (table.table_start, table.table_start + 0.25 * (table.ln_eta0.size - 1))
    for end, outside in zip(ends, (ends[0] - 50.0, ends[1] + 500.0), strict=True):
        assert film_flow.ln_viscosity(table, 0.0, outside)[0] == film_flow.ln_viscosity(table, 0.0, end)[0]

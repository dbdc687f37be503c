"""Oil properties of the compiled kernels against the lubricant module, slopes against differences."""

import contact_twins as twins
import numpy as np
import pytest
from contact_cases import OIL, OILS

from ballscrew_tehl.contact.film import oil as oil_kernels
from ballscrew_tehl.contact.moes import reference_oil
from ballscrew_tehl.physics import lubricant

T_IN = 303.15
RHEOLOGIES = {
    "eyring": {"rheology": "eyring", "eyring_stress": 4e6},
    "carreau": {"rheology": "carreau", "carreau_modulus": 2e6, "carreau_exponent": 0.4},
    "carreau, n = 0.1": {"rheology": "carreau", "carreau_modulus": 2e6, "carreau_exponent": 0.1},
    "carreau, n = 1": {"rheology": "carreau", "carreau_modulus": 2e6, "carreau_exponent": 1.0},
    "limiting, slope": {"rheology": "limiting_shear_stress", "limiting_stress_slope": 0.05},
    "limiting, lower bound": {"rheology": "limiting_shear_stress", "limiting_stress_ambient": 8e7},
}
P = 6e8
#: interpolation of ln eta0 in steps of 0.25 K (1e-5 of eta0), enlarged by the pressure term of Roelands
TABLE = 1e-4


def table_of(oil, **update):
    return oil_kernels.oil_table(oil.model_copy(update=update), T_IN)


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
@pytest.mark.parametrize(("p", "t"), [(0.0, 303.15), (0.4e9, 351.7), (1.2e9, 420.2)])
def test_viscosity_and_its_slopes(oil, p, t):
    table = table_of(oil)
    factor, d_factor = oil_kernels.pressure_factor(table, p)
    ln_eta, slope, by_factor = oil_kernels.ln_viscosity(table, factor, t)
    assert ln_eta == pytest.approx(np.log(lubricant.viscosity(oil, p, t)), abs=TABLE)
    up, down = (np.log(lubricant.viscosity(oil, p, t + dt)) for dt in (0.5, -0.5))
    assert slope == pytest.approx(up - down, rel=5e-3, abs=1e-12)  # slope of the chord within 0.25 K
    # d ln eta/dp by the chain of both slopes; pressure by the law, without the table
    dp = 1e4
    up, down = (np.log(lubricant.viscosity(oil, p + s * dp, t)) for s in (1.0, -1.0 if p > 0.0 else 0.0))
    per_pressure = (up - down) / (dp * (2.0 if p > 0.0 else 1.0))
    assert by_factor * d_factor == pytest.approx(per_pressure, rel=1e-4)


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
@pytest.mark.parametrize("p", [0.0, 0.4e9, 1.2e9])
def test_density_and_its_slope(oil, p):
    table = table_of(oil)
    rho, slope = oil_kernels.pressure_density(table, p)
    at_p = lubricant.density(oil, p, 350.0) / oil.density + oil.density_temperature * (
        350.0 - oil.reference_temperature
    )
    assert rho == pytest.approx(at_p, rel=1e-12)
    up, down = (oil_kernels.pressure_density(table, p + dp)[0] for dp in (1e5, -1e5))
    assert slope == pytest.approx((up - down) / 2e5, rel=1e-6, abs=1e-18)


def test_temperatures_beyond_the_table_keep_its_ends():
    table = table_of(OIL)
    ends = (table.table_start, table.table_start + oil_kernels.TABLE_STEP * (table.ln_eta0.size - 1))
    for end, outside in zip(ends, (ends[0] - 50.0, ends[1] + 500.0), strict=True):
        (kept, slope, _), (there, _, _) = (oil_kernels.ln_viscosity(table, 0.3, t) for t in (outside, end))
        assert kept == there
        assert slope == 0.0


def test_viscosity_stops_where_pressure_would_thin_the_oil():
    hot = table_of(OIL).ln_eta0[-1]
    assert hot >= -oil_kernels.ROELANDS_LN
    thin = table_of(reference_oil("barus").model_copy(update={"viscosity": 1e-6}))
    assert oil_kernels.ln_viscosity(thin, 0.0, T_IN)[0] == -oil_kernels.ROELANDS_LN


# --- shear thinning ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
@pytest.mark.parametrize("rate", 10.0 ** np.arange(-3.0, 7.1))
def test_shear_thinning_is_the_law_at_its_stress(update, rate):
    """Both ways: stress of a rate by the closed law, thinning at that stress = eta rate/stress."""
    oil, eta = OIL.model_copy(update=update), 60.0
    tau = twins.shear_stress(oil, P, eta, rate)
    limit = max(oil.limiting_stress_ambient, oil.limiting_stress_slope * P)
    if "limiting" in oil.rheology and eta * rate > 10.0 * limit:
        pytest.skip("the stress does not determine the rate to the required digits")
    thinning, _ = oil_kernels.shear_thinning(table_of(oil), P, eta, tau)
    # series near zero stress: t^4/120 (eyring), t^3/4 (limiting) of the next term; digits of the sum in log1p
    assert thinning == pytest.approx(eta * rate / tau, rel=1e-9)
    assert thinning == pytest.approx(eta * twins.shear_rate(oil, P, eta, tau) / tau, rel=1e-9)
    assert thinning >= 1.0


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
@pytest.mark.parametrize("tau", 10.0 ** np.arange(1.0, 7.45, 0.25))
def test_slope_of_shear_thinning(update, tau):
    table, eps = table_of(OIL, **update), 1e-5
    _, slope = oil_kernels.shear_thinning(table, P, 60.0, tau)
    up, down = (oil_kernels.shear_thinning(table, P, 60.0, tau * np.exp(s * eps))[0] for s in (1.0, -1.0))
    # rounding of S over 2 eps, and the fourth term of the series
    assert slope == pytest.approx((up - down) / (2.0 * eps), rel=1e-5, abs=1e-10)


@pytest.mark.parametrize(("update", "switch"), [("eyring", 4e6 * 1e-2), ("limiting, slope", 0.05 * P * 1e-3)])
def test_series_joins_the_law(update, switch):
    table = table_of(OIL, **RHEOLOGIES[update])
    below, above = (oil_kernels.shear_thinning(table, P, 1.0, switch * (1.0 + s)) for s in (-1e-9, 1e-9))
    assert below[0] == pytest.approx(above[0], rel=1e-9)
    assert below[1] == pytest.approx(above[1], rel=1e-4)

"""Groups and closed forms of a contact: what depends on them alone, and quantities that are read back."""

import numpy as np
import pytest
from synthetic_atlas import contacts, nothing_missed, rolling

from ballscrew_tehl.atlas.groups import QUANTITIES, closed_forms, modelled, unmodelled

#: exponent of size of each quantity at fixed groups
SIZE = {"central_film": 1, "minimum_film": 1, "rolling_loss": 3, "core_area": 2}


def test_quantities_are_read_back():
    rng = np.random.default_rng(1)
    for contact in contacts()[:20]:
        closed = closed_forms(rolling(contact)).values
        values = {name: closed[name] * np.exp(rng.normal(size=1)) for name in QUANTITIES}
        values |= {"minimum_film": 0.7 * values["central_film"], "mean_rise": rng.normal(size=1)}
        again = unmodelled(modelled(values, closed), closed)
        assert nothing_missed(again, values, 1e-12)
    none = unmodelled(modelled(values | {"temperature_rise": np.array([-1e-3])}, closed), closed)
    assert 0.0 <= none["temperature_rise"][0] <= 1e-9 * closed["temperature_rise"][0]


def test_size_changes_no_group_and_a_closed_form_by_its_dimension():
    """Larger in all lengths, faster, with an oil that conducts more: the film per size, pressures and rise the same."""
    for contact in contacts()[:20]:
        one, s = rolling(contact), 3.7
        oil = one.oil.model_copy(update={"thermal_conductivity": s**2 * one.oil.thermal_conductivity})
        large = one._replace(load=s**2 * one.load, R_x=s * one.R_x, R_y=s * one.R_y, u_e=s * one.u_e, oil=oil)
        small, other = closed_forms(one), closed_forms(large)
        for own, same in zip(other.groups, small.groups, strict=True):
            np.testing.assert_allclose(own, same, rtol=1e-9)
        zero = dict.fromkeys(QUANTITIES, np.zeros(1))
        first, second = unmodelled(zero, small.values), unmodelled(zero, other.values)
        for name in QUANTITIES:
            assert second[name] == pytest.approx(s ** SIZE.get(name, 0) * first[name], rel=1e-9), name

"""Forces of one ball against quadrature."""

import pytest
from scipy.integrate import quad

from ballscrew_tehl.friction import parts as friction


def test_hysteresis_force_loses_the_stated_share_of_the_elastic_work():
    load, b, r_b = 32.955, 41.23e-6, 2.3815e-3
    # of an ellipse: moment of the front half of the Hertz pressure is 3 Q b/16
    moment = quad(lambda x: 0.75 * load / b * (1 - (x / b) ** 2) * x, 0.0, b)[0]
    assert friction.hysteresis_force(load, b, r_b, 0.01) == pytest.approx(0.01 * moment / r_b, rel=1e-12)

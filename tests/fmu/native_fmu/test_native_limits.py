"""Special cases of the native models: rest at the sliding deflection, and a torque that hardly depends on the preload
(compared with the Python estimate; numbers of the documentation)."""

import pytest
from native_model import NativeModel, compiled_model
from synthetic_map import make_map

from ballscrew_fmu.models import MONITOR
from ballscrew_tehl.runtime.packed import FrictionParameters
from ballscrew_tehl.runtime.preload import estimate_preload

pytestmark = pytest.mark.slow


def test_bristle_at_rest_beyond_the_slip_limit_holds_by_its_spring(tmp_path, synthetic_nut_map):
    """Slip has the direction of the speed: at rest there is none, so the torque is stiffness times deflection."""
    model = NativeModel(compiled_model(tmp_path, synthetic_nut_map), synthetic_nut_map, continuous=True)
    nut = synthetic_nut_map.evaluate(2000.0, 0.0, 303.15)
    stiffness, coulomb = 400.0, nut.hysteresis_torque + nut.sliding_torque
    for share in (0.9995, -0.9995):
        model.reset(True)
        deflection = share * coulomb / stiffness
        model.latch(
            preload=2000.0, presliding_stiffness=stiffness, speed=0.0, presliding_deflection=deflection
        )
        if share > 0.0:  # the indicator treats rest as forward motion
            assert model.get("slip_indicator") < 0.0
        model.initial_event()
        assert not model.event()
        assert model.get("friction_torque") == pytest.approx(stiffness * deflection, rel=1e-12)
        assert model.get("power_loss") == 0.0


def flat_map(elasticity: float):
    """Map whose viscous torque has this elasticity (d ln torque/d ln preload) at 1000 N, 10 rad/s, 303.15 K.

    The parts of screw and nut, 9 and 17, have the exponents 0.66 and 0.67 in the closed form.
    """
    return make_map(force_exponent=elasticity - (9.0 * 0.66 + 17.0 * 0.67) / 26.0)


@pytest.mark.parametrize(("elasticity", "determined"), [(0.03, True), (0.007, False)])
def test_preload_is_in_range_where_one_per_cent_moves_the_torque_by_a_hundredth_of_that(
    tmp_path, elasticity, determined
):
    nut_map = flat_map(elasticity)
    friction, at = FrictionParameters(1e6, 0.0, 0.0, 1.0), (10.0, 303.15)
    torque = nut_map.evaluate(1000.0, *at, 0.0, *friction).viscous_torque
    state = nut_map.evaluate(1000.0, *at, 0.0, *friction)
    assert state.hysteresis_torque <= 1e-6 * torque
    found = estimate_preload(nut_map, torque, *at, 0.0, friction, 0.0)
    assert found.in_range == determined
    model = NativeModel(compiled_model(tmp_path, nut_map, MONITOR), nut_map, model=MONITOR)
    model.step(
        1e-3, torque=torque, speed=at[0], temperature=at[1], axial_load=0.0, speed_min=1.0,
        regularization_speed=0.0, **friction._asdict(),
    )  # fmt: skip
    assert bool(model.get("in_range")) == determined
    if determined:
        assert found.preload == pytest.approx(1000.0, rel=1e-5)  # hysteresis 1e-7 of the torque
        assert model.get("preload") == pytest.approx(found.preload, rel=1e-9)

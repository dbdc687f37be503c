"""The native model at standstill with the start values of its parameters: reversals, a held rotor, breaking away."""

from itertools import product

import pytest
from native_model import NativeModel, compiled_model
from standstill_runs import ACCELERATIONS, INERTIAS, STEPS, coulomb_level, reversal_peak, rotor
from synthetic_map import LAWS, make_map

pytestmark = pytest.mark.slow
SLIDING = 10.0  # [rad/s]


@pytest.fixture(scope="module", params=LAWS)
def subject(request, tmp_path_factory):
    nut_map = make_map(law=request.param)
    folder = tmp_path_factory.mktemp("standstill")
    return NativeModel(compiled_model(folder / "model", nut_map), nut_map), nut_map


@pytest.mark.parametrize("exchange", [False, True])
def test_the_coulomb_part_stays_at_its_level_in_reversals(subject, exchange):
    model, nut_map = subject
    for acceleration, step in product(ACCELERATIONS, STEPS):
        peak = reversal_peak(model, nut_map, acceleration, step, exchange)
        assert 0.9 <= peak <= 1.02, (acceleration, step)


@pytest.mark.parametrize("friction_first", [False, True])
@pytest.mark.parametrize(("inertia", "step"), list(product(INERTIAS, (1e-4, 1e-3))))
def test_a_rotor_is_held_and_breaks_away(subject, inertia, step, friction_first):
    """By half of the Coulomb torque in motion: at rest it may be higher, and the start swings beyond the load."""
    model, nut_map = subject
    run = inertia, step, friction_first
    held = rotor(model, 0.5 * coulomb_level(nut_map, SLIDING), *run, settle=15.0, hold=10.0)
    assert held.drift < 1e-9
    free = rotor(model, 1.1 * coulomb_level(nut_map, 0.0), *run, settle=2.0, hold=0.0)
    assert free.speed > 0.1

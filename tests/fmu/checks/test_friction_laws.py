"""FMUs of both friction laws, for Python hosts and native: replay, tunable parameters, breakaway, documentation."""

import math

import pytest
from synthetic_map import LAWS, make_map

from ballscrew_fmu.checks.check import check, check_replay
from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.checks.replay_fmi3 import Fmu3Instance
from ballscrew_fmu.models import FRICTION, MODELS, MONITOR
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_file_name
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_tehl.runtime.packed import MECHANISTIC

pytestmark = pytest.mark.slow

SUBJECTS = ("python", 2, 3)
AGREEMENT = 1e-12


@pytest.fixture(scope="module", params=LAWS)
def nut_map(request):
    return make_map(law=request.param)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory, nut_map):
    """Files by model and subject, native ones for this machine only."""
    folder = tmp_path_factory.mktemp(nut_map.law)
    built = {}
    for model in MODELS:
        built[model.name, "python"] = build_fmu(nut_map, folder / f"{model.name}.fmu", model=model).path
        for version in (2, 3):
            path = folder / native_file_name(version, model)
            built[model.name, version] = build_native_fmu(
                nut_map, version, path, platforms=("x86_64-linux",), model=model
            ).path
    return built


def kind_of(subject):
    return Fmu3Instance if subject == 3 else FmuInstance


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
@pytest.mark.parametrize("subject", SUBJECTS)
def test_it_is_valid_and_replays_the_map(fmus, nut_map, model, subject):
    fmu = fmus[model.name, subject]
    assert "no finding" in check(fmu, nut_map, kind_of(subject), model)
    if model is FRICTION:
        assert check_replay(fmu, nut_map, kind_of(subject), model) <= AGREEMENT


@pytest.mark.parametrize("subject", SUBJECTS)
def test_friction_parameters_are_tunable_and_those_of_the_map(fmus, nut_map, subject):
    parameters = {
        "apparent_viscosity_ratio": 2.5, "net_sliding_coefficient": 0.009, "roughness_height": 90e-9,
        "breakaway_factor": 3.0,
    }  # fmt: skip
    with kind_of(subject)(fmus[FRICTION.name, subject], presliding=False) as one:
        for speed in (0.2, -0.2, 30.0):
            for given in (nut_map.header["defaults"], parameters):
                assert one.step(1e-3, preload=1500.0, axial_load=400.0, speed=speed, **given)
                state = nut_map.evaluate(1500.0, speed, 303.15, 400.0, **given)
                sign = math.tanh(speed / 0.1)
                expected = {
                    "viscous_torque": math.copysign(state.viscous_torque, speed),
                    "hysteresis_torque": sign * state.hysteresis_torque,
                    "sliding_torque": sign * state.sliding_torque,
                    "lambda_ratio": state.lambda_ratio,
                }
                for name, value in expected.items():
                    assert one.get(name) == pytest.approx(value, rel=AGREEMENT), name


@pytest.mark.parametrize("subject", SUBJECTS)
def test_the_bristle_slides_at_the_coulomb_torque_of_its_conditions(fmus, nut_map, subject):
    """Warm or cold, fast or nearly at rest, in steps that take the bristle to its end: the torque of that step."""
    start = {"breakaway_factor": 2.0}
    seen = []
    with kind_of(subject)(fmus[FRICTION.name, subject], **start) as one:
        for speed, temperature in ((100.0, 290.0), (0.4, 290.0), (0.1, 290.0), (0.1, 340.0), (0.01, 340.0)):
            assert one.step(2.0, speed=speed, temperature=temperature)
            state = nut_map.evaluate(2000.0, speed, temperature, breakaway_factor=2.0)
            assert one.get("sliding_torque") == pytest.approx(state.sliding_torque, rel=1e-6)
            assert one.get("power_loss") >= one.get("viscous_torque") * speed
            seen.append(one.get("sliding_torque"))
    assert seen[0] < seen[1] < seen[2]
    assert (abs(seen[3] - seen[2]) > 0.01 * seen[2]) == (nut_map.law == MECHANISTIC)
    assert seen[3] < seen[4]


def test_the_monitor_recovers_the_preload_below_the_slowest_speed_of_the_map(fmus, nut_map):
    for subject in SUBJECTS:
        friction, monitor = (fmus[model.name, subject] for model in (FRICTION, MONITOR))
        given = {"breakaway_factor": 2.5, "regularization_speed": 0.01}
        with (
            kind_of(subject)(friction, presliding=False, **given) as source,
            kind_of(subject)(monitor, speed_min=0.05, **given) as one,
        ):
            for preload in (300.0, 1700.0, 6000.0):
                assert source.step(1e-3, preload=preload, speed=0.1)
                assert one.step(1e-3, torque=source.get("friction_torque"), speed=0.1)
                assert one.get("in_range")
                assert one.get("preload") == pytest.approx(preload, rel=1e-9)

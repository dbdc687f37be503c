"""When the fitted coefficient of the packaged set counts as fitted, and what selecting a set keeps of a screw file."""

from ballscrew_tehl.friction.interval import fit_of
from ballscrew_tehl.friction.origin import with_set, without_overrides
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.parameters.file import changed, load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_VG100

SCREW = load_parameters(PACKAGED_VG100)


def test_the_packaged_coefficient_is_fitted_with_the_constants_of_its_fit_only():
    assert fit_of(default_friction_set(SCREW), SCREW) is not None
    for other in ({"replenishment_constant": 0.0}, {"boundary_friction": 0.1}, {"roughness_height": 1e-6}):
        parameters = changed(SCREW, friction=other)
        assert fit_of(default_friction_set(parameters), parameters) is None


def test_the_roughness_of_a_screw_is_kept_with_a_mechanistic_set():
    rough = changed(SCREW, friction={"roughness_height": 1e-6, "net_sliding_coefficient": 0.01})
    kept = without_overrides(rough, "mechanistic").friction
    assert (kept.roughness_height, kept.net_sliding_coefficient) == (1e-6, None)
    assert without_overrides(rough, "three_parameter").friction.roughness_height is None
    assert with_set(rough, "mechanistic") is rough

"""Drag torque of a delivered screw: its point, the tolerance, the true preload it implies, entries that contradict."""

import math

import numpy as np
import pytest
from command_line import answer
from law_contacts import VG100, ClosedContacts

from ballscrew_tehl import load_screw
from ballscrew_tehl.applications.calibration.measured import calibrate_point
from ballscrew_tehl.applications.calibration.measurements import Measurement
from ballscrew_tehl.applications.catalogue import CatalogueSizes, catalogue_parameters
from ballscrew_tehl.applications.published_formulas import REXROTH, rexroth_torque
from ballscrew_tehl.friction.drag_torque import drag_torque_set, implied_preload, in_test_oil
from ballscrew_tehl.friction.interval import (
    DEVIATIONS,
    OperatingPoint,
    torque_and_ends,
    torque_interval,
    uniform_moments,
    with_constants,
)
from ballscrew_tehl.friction.mechanistic import double_nut_parts
from ballscrew_tehl.friction.sets import carried_over, default_friction_set, refuse_other_fit
from ballscrew_tehl.parameters.file import PACKAGED_VG100, ParameterError, changed, graded_oil
from ballscrew_tehl.parameters.friction import BOUNDED, PRELOAD_FORCE, ball_ball_coefficient
from ballscrew_tehl.parameters.identity import parameters_hash
from ballscrew_tehl.parameters.screw import tolerance_of_class
from ballscrew_tehl.parameters.template import example_parameters, screw_template
from ballscrew_tehl.parameters.units import CELSIUS, RPM

CONTACTS = ClosedContacts()
NOMINAL = changed(VG100, screw={"preload_basis": "nominal"})
TEST = OperatingPoint(2000.0, 100.0 * RPM, 20.0 + CELSIUS)
AWAY = OperatingPoint(2000.0, 900.0 * RPM, 41.0 + CELSIUS), OperatingPoint(1200.0, 300.0 * RPM, 308.0, 500.0)


def delivered(torque, like=NOMINAL, percent=25.0, **entries):
    entries |= {"drag_torque": torque, "drag_torque_preload": TEST.preload}
    return changed(like, screw=entries | {"drag_torque_tolerance_percent": percent})


def law(parameters, point, factor, coefficient):
    forces = point.forces(parameters, factor)
    return double_nut_parts(
        parameters, forces, CONTACTS, point.speed, point.temperature, 1.0, coefficient
    ).total


@pytest.mark.parametrize("ratio", [0.35, 0.7, 1.1])
def test_law_has_the_torque_at_its_point_with_the_tolerance(ratio):
    """Between low friction at the nominal force and the nominal friction at a low force, in the oil of the test."""
    torque = ratio * law(NOMINAL, TEST, 1.0, ball_ball_coefficient(NOMINAL.friction))
    screw = delivered(torque)
    found = drag_torque_set(screw, lambda _: CONTACTS)
    k, factor = found.net_sliding_coefficient, found.preload_factor
    assert law(screw, TEST, factor, k) == pytest.approx(torque, rel=1e-9)
    here = torque_interval(screw, TEST, CONTACTS, found)
    assert here.torque == pytest.approx(torque, rel=1e-9)
    assert 1.0 <= here.high / here.low / (1.25 / 0.75) <= 1.05
    implied, low, high = implied_preload(found, TEST.preload).values()
    assert low < implied < high
    assert implied == pytest.approx(factor * TEST.preload, rel=1e-12)
    # the preloads of all points are as nominal as that of the test, with or without an axial load
    for point in AWAY:
        assert torque_interval(screw, point, CONTACTS, found).torque == pytest.approx(
            law(screw, point, factor, k), rel=1e-12
        )
    refuse_other_fit(found, screw)
    assert carried_over(found, screw) == ""
    assert parameters_hash(screw) == parameters_hash(VG100)


def test_of_a_known_force_it_is_one_measured_torque():
    torque = law(VG100, TEST, 1.0, 0.009)
    found = drag_torque_set(delivered(torque, VG100), lambda _: CONTACTS)
    at = Measurement(*TEST[:3], torque, limits=(0.75 * torque, 1.25 * torque))
    other = calibrate_point(at, VG100, CONTACTS).friction_set
    assert found.net_sliding_coefficient == pytest.approx(other.net_sliding_coefficient, rel=1e-9)
    assert found.preload_factor == 1.0
    assert implied_preload(found, TEST.preload) == {}
    ends = [torque_interval(VG100, AWAY[0], CONTACTS, entry).relative for entry in (found, other)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-6)


@pytest.mark.slow
def test_interval_holds_torques_elsewhere_and_the_true_preload_of_random_screws():
    """60 of random friction and force; 80 % +- 5 % (one standard deviation)."""
    random, held = np.random.default_rng(5), []
    deviation = 0.5 * math.log(1.25 / 0.75) / DEVIATIONS
    for _ in range(60):
        values = {n: b.low / random.random() if n == "supply_length" else random.uniform(b.low, b.high)
                  for n, b in BOUNDED.items()}  # fmt: skip
        factor = PRELOAD_FORCE.low * (PRELOAD_FORCE.high / PRELOAD_FORCE.low) ** random.random()
        truth = with_constants(NOMINAL, values)
        k, kelvin = ball_ball_coefficient(truth.friction, values["ball_thrust"]), random.uniform(-5.0, 5.0)
        warm = [p._replace(temperature=p.temperature + kelvin) for p in (TEST, AWAY[0])]
        true = [law(truth, point, factor, k) for point in warm]
        screw = delivered(true[0] * math.exp(deviation * random.standard_normal()) / math.sqrt(0.75 * 1.25))
        found = drag_torque_set(screw, lambda _: CONTACTS)
        away = torque_interval(screw, AWAY[0], CONTACTS, found)
        _, low, high = implied_preload(found, 1.0).values()
        held.append((away.low <= true[1] <= away.high, low <= factor <= high))
    assert np.all((np.mean(held, axis=0) >= 0.65) & (np.mean(held, axis=0) <= 0.95))


def test_nominal_preload_widens_the_interval_and_arrays_have_the_same():
    entry = default_friction_set(changed(NOMINAL, friction={"ball_thrust": 1.0}))
    wide, narrow = (torque_interval(each, TEST, CONTACTS, entry) for each in (NOMINAL, VG100))
    widths = [math.log(each.high / each.low) / 2.0 / DEVIATIONS for each in (narrow, wide)]
    ends = np.log(np.divide(wide.ends["preload_force"], wide.torque))
    _, variance = uniform_moments(*ends, PRELOAD_FORCE.place(1.0))
    assert widths[1] ** 2 - widths[0] ** 2 == pytest.approx(variance, rel=1e-6)
    for end, force in zip(wide.ends["preload_force"], (0.3, 1.1), strict=True):
        assert end == pytest.approx(law(NOMINAL, TEST, force, entry.net_sliding_coefficient), rel=1e-12)
    assert "nominal preload" in wide.meaning
    assert "nominal" not in narrow.meaning
    preload, speed, temperature = (np.array([value]) for value in TEST[:3])
    _, *ends = torque_and_ends(NOMINAL, preload, CONTACTS, speed, temperature, entry)
    assert np.ravel(ends) == pytest.approx(wide.relative, rel=1e-9)


def test_oil_of_the_test_is_its_own_only_where_the_grade_is():
    assert in_test_oil(delivered(0.4, drag_torque_oil=100)).lubricant == NOMINAL.lubricant
    oil = in_test_oil(delivered(0.4, drag_torque_oil=68)).lubricant
    assert oil == graded_oil(68, 95.0).model_copy(
        update={"temperature_tolerance": NOMINAL.lubricant.temperature_tolerance}
    )


WHOLE = {"drag_torque_Nm": 0.4, "drag_torque_tolerance_percent": 25.0, "drag_torque_preload_N": 1e3}
BAND = {
    "drag_torque_Nm": 0.4,
    "drag_torque_min_Nm": 0.3,
    "drag_torque_max_Nm": 0.5,
    "drag_torque_preload_N": 1e3,
}
REFUSED = [
    (WHOLE | {"drag_torque_tolerance_percent": None}, "tolerance_percent = (missing)"),
    (WHOLE | {"drag_torque_preload_N": None}, "preload_N = (missing)"),
    ({"drag_torque_oil": 68}, "Nm = (missing)"),
    (BAND | {"drag_torque_min_Nm": None}, "min_Nm = (missing)"),
    (BAND | {"drag_torque_Nm": 0.6}, "Nm = 0.6; allowed: d"),
    (BAND | {"drag_torque_tolerance_percent": 9.0}, "tolerance_percent = 9.0; allowed: no entry"),
    (WHOLE | {"drag_torque_oil": 90}, "oil = 90; allowed: 7, 10"),
]  # fmt: skip


@pytest.mark.parametrize(("entries", "expected"), REFUSED)
def test_a_drag_torque_that_is_not_whole_is_one_line(entries, expected, tmp_path):
    path, lines = tmp_path / "s.toml", [f"{key} = {value}" for key, value in entries.items() if value]
    path.write_text(screw_template(example_parameters()).replace("[screw]", "\n".join(["[screw]", *lines])))
    with pytest.raises(ParameterError) as refused:
        load_screw(path)
    assert f"screw.drag_torque_{expected}" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_torque_that_the_law_cannot_have_is_refused():
    with pytest.raises(
        ValueError, match=r"drag_torque_Nm = 400 at 2000 N; allowed: .* by the law: check unit"
    ):
        drag_torque_set(delivered(400.0), lambda _: CONTACTS)
    stated = changed(VG100, friction={"net_sliding_coefficient": 0.01})
    with pytest.raises(ValueError, match="it can fix neither force nor friction"):
        drag_torque_set(delivered(0.4, stated), lambda _: CONTACTS)


def test_rexroth_torques_are_those_of_its_rows():
    """40x10Rx6-4: 0.56 N.m of a double nut at 3500 N, 1.0 N.m of a single nut at 2500 N."""
    for kind, preload, printed in zip(REXROTH, (3500.0, 2500.0), (0.56, 1.0), strict=True):
        sizes = CatalogueSizes(40.0, 10.0, ball_mm=6.0, nut_kind=kind)
        screw = catalogue_parameters(sizes, example_parameters())[0].screw
        assert rexroth_torque(screw, preload) == pytest.approx(printed, rel=0.01)


def test_commands_answer_the_torque_at_its_point_and_the_true_preload(capsys, tmp_path):
    """With the packaged map: of the same screw and oil."""
    text = PACKAGED_VG100.read_text().replace('"force"', '"nominal"')
    path, torque = tmp_path / "s.toml", 0.3
    printed = f"drag_torque_Nm = {torque}\ndrag_torque_tolerance_percent = 25\ndrag_torque_preload_N = 1300"
    path.write_text(text.replace("[screw]", f"[screw]\n{printed}"))
    point = "--preload-n", 1300, "--speed-rpm", 100, "--temperature-c", 20
    found, _ = answer(capsys, "torque", "--screw", path, *point)
    # error of the map
    assert found["friction_torque_nm"] == pytest.approx(torque, rel=0.01)
    assert found["torque_high_nm"] / found["torque_low_nm"] == pytest.approx(1.7, abs=0.1)
    assert (
        found["preload_implied_low_n"] < found["preload_implied_n"] < found["preload_implied_high_n"] < 1300.0
    )
    screw, _ = answer(capsys, "screw", "--screw", path, "--preload-n", 1300)
    implied = found["preload_implied_n"]
    assert (screw["preload_implied_n"], screw["nut_force_a_n"]) == pytest.approx((implied, implied), rel=1e-9)
    assert found["catalogue_torque_nm"] == screw["catalogue_torque_nm"] == pytest.approx(0.3281, rel=1e-3)
    back, _ = answer(
        capsys, "preload", "--screw", path, "--torque-nm", found["friction_torque_nm"], *point[2:]
    )
    assert (back["preload_n"], back["preload_actual_n"]) == pytest.approx((1300.0, implied), rel=1e-3)


def test_tolerance_by_class_and_slenderness_is_that_of_the_standards():
    """Cells read in the catalogues; beyond the table the tolerance is asked for."""
    for grade, slenderness, torque, expected in (
        ("T5", 30.0, 0.56, 40.0), ("T5", 50.0, 0.56, 45.0), ("C0", 40.0, 0.3, 35.0), ("C5", 60.0, 8.0, 25.0),
        ("T7", 20.0, 0.5, None), ("C1", 20.0, 8.0, None), ("T3", 20.0, 0.1, None), ("T3", 20.0, 11.0, None),
    ):  # fmt: skip
        assert tolerance_of_class(grade, slenderness, torque) == expected
    stated = {"drag_torque": 0.56, "drag_torque_preload": 3500.0, "drag_torque_class": "T5"}
    screw = changed(VG100, screw=stated).screw
    assert (screw.drag_torque_min, screw.drag_torque_max) == pytest.approx((0.336, 0.784))
    with pytest.raises(ValueError, match="drag_torque_tolerance_percent"):
        changed(VG100, screw=stated | {"drag_torque": 0.1})

"""Screw files: packaged values, units, defaults, and one clear line for every kind of mistake."""

import math
from importlib import resources

import pytest
from reference_screw import GD4008

from ballscrew_tehl.friction.film_shear import nut_forces
from ballscrew_tehl.parameters.file import Law, changed, load_screw
from ballscrew_tehl.parameters.identity import differences, map_parameters_json, parameters_hash
from ballscrew_tehl.parameters.screw import NITRIDE
from ballscrew_tehl.parameters.template import example_parameters
from ballscrew_tehl.parameters.toml import ParameterError
from ballscrew_tehl.physics.hertz import E_prime
from ballscrew_tehl.physics.rating import computed_dynamic_rating, dynamic_rating

PACKAGED = (resources.files("ballscrew_tehl") / "data" / "gd4008.toml").read_text(encoding="utf-8")
EXAMPLE = (resources.files("ballscrew_tehl") / "data" / "example_25x10.toml").read_text(encoding="utf-8")


@pytest.fixture
def read(tmp_path):
    def from_text(text):
        path = tmp_path / "screw.toml"
        path.write_text(text, encoding="utf-8")
        return load_screw(path)

    return from_text


def edited(old, new, text=PACKAGED):
    assert text.count(old) == 1, old
    return text.replace(old, new)


def graded(**entries):
    """The example with a mineral oil by its grade and more entries; None leaves one out."""
    entries = {"iso_vg": 68, "viscosity_index": 95, **entries}
    lines = [f"{key} = {value}" for key, value in entries.items() if value is not None]
    head, rest = EXAMPLE.split("[lubricant]")
    tail = rest.split("[friction]")[1]
    return "\n".join([head, "[lubricant]", 'name = "mine"', *lines, "[friction]", tail])


def test_example_screw_derives_its_viscosity_and_exponent(read):
    lub = read(EXAMPLE).lubricant
    # 100 mm2/s at 40 C times 890 kg/m3
    assert lub.viscosity == pytest.approx(0.089, rel=1e-12)
    slope = lub.z_roelands / lub.roelands_pressure * (math.log(lub.viscosity) + 9.67)
    assert slope == pytest.approx(21e-9, rel=1e-12)
    assert read(EXAMPLE).screw.screw_section_area == pytest.approx(math.pi * 0.0117**2, rel=1e-12)


def test_units_of_other_dimensions(read):
    text = PACKAGED
    for old, new in (
        ("youngs_modulus_GPa = 205.0", "youngs_modulus_MPa = 205e3"),
        ("lead_angle_deg = 3.64", "lead_angle_rad = 0.06353"),
        ("viscosity_Pas = 0.033", "viscosity_mPas = 33"),
        ("reference_temperature_K = 303.0", "reference_temperature_degC = 30"),
        ("pressure_viscosity_per_Pa = 1.85e-8", "pressure_viscosity_per_GPa = 18.5"),
        ("reference_speed_rpm = 3000.0", "reference_speed_rad_s = 314.0"),
        ("ball_diameter_mm = 4.763", "ball_diameter_um = 4763"),
    ):
        text = edited(old, new, text)
    p = read(text)
    assert (p.screw.ball_diameter, p.screw.youngs_modulus, p.screw.lead_angle) == (0.004763, 205e9, 0.06353)
    assert (p.lubricant.viscosity, p.lubricant.reference_temperature) == (0.033, 303.15)
    assert p.lubricant.pressure_viscosity == pytest.approx(1.85e-8, rel=1e-15)
    assert p.published_speeds.reference_speed == 314.0
    # a viscosity in cSt or mm2/s is the same oil, and the hotter point may come first
    points = read(EXAMPLE).lubricant
    assert read(EXAMPLE.replace("_mm2_s = ", "_cSt = ")).lubricant == points
    assert points.astm_viscosity_1 == pytest.approx(1e-4, rel=1e-12)
    turned = EXAMPLE.replace("_1_", "_9_").replace("_2_", "_1_").replace("_9_", "_2_")
    assert read(turned).lubricant.viscosity == pytest.approx(points.viscosity, rel=1e-12)


#: entry of the packaged file => entry instead => what the line says; ^: of the example;  +entries: grade oil instead
MISTAKES = """
ball_diameter_mm = 4.763 => ball_diameter_mm = -4.763 => screw.ball_diameter_mm = -4.763; > 0 mm; diameter of a ball
ball_diameter_mm = 4.763 => ball_diameter_mm = nan => screw.ball_diameter_mm = nan; finite number
ball_diameter_mm = 4.763 => ball_diameter_mm = "4.763" => screw.ball_diameter_mm = '4.763'; a number
youngs_modulus_GPa = 205.0 => youngs_modulus_GPa = 205e9 => screw.youngs_modulus_GPa = 205000000000.0; <= 1000 GPa
ball_diameter_mm = 4.763 => ball_diameter_inch = 0.1875 => ball_diameter_mm, ball_diameter_m, ball_diameter_um; bad unit
lead_mm = 8.0 => lead = 8.0 => screw.lead = 8.0; lead_mm; bad unit
ball_diameter_mm = 4.763 => bal_diameter_mm = 4.763 => screw.bal_diameter_mm = 4.763; nearest: ball_diameter_mm
[solid] => [solids] => [solids] = ; nearest: solid
ball_diameter_mm = 4.763 =>  => screw.ball_diameter_mm = (missing); ball_diameter_m,; diameter of a ball
lead_mm = 8.0 => lead_mm = 8.0@lead_m = 0.008 => screw.lead_m = 0.008; lead is given twice
viscosity_law = "section_2_3" => viscosity_law = "x" => lubricant.viscosity_law = 'x'; 'section_2_3'; 'astm_d341'
nut_raceway_radius_mm = 2.477 => nut_raceway_radius_mm = 2.3 => screw.nut_raceway_radius_mm = 2.3; more than the ball
lead_angle_deg = 3.64 => lead_angle_deg = 5 => screw.lead_angle_deg = 5; 3.643 deg
loaded_ball_count = 72 => loaded_ball_count = 80 => screw.loaded_ball_count = 80; at most 79
viscosity_Pas = 0.033 => viscosity_Pas = 0.033@astm_viscosity_1_cSt = 100 => lubricant.astm_viscosity_1_cSt = 100; d341
^astm_temperature_2_degC = 100.0 =>  => lubricant.astm_temperature_2_degC = (missing); two points
^astm_viscosity_2_mm2_s = 11.1 => astm_viscosity_2_mm2_s = 111 => lubricant.astm_viscosity_2_mm2_s = 111; below point 1
^astm_viscosity_1_mm2_s = 100.0 => astm_viscosity_1_mm2_s = 1e5 => 1 to 6.5 as slope of D341; points, not 8.8
conductivity_W_mK = 0.14 => conductivity_W_mK = 0.00014 => lubricant.thermal_conductivity_W_mK = 0.00014; >= 0.05
viscosity_Pas = 0.033 => viscosity_Pas = 46 => lubricant.viscosity_Pas = 46; up to 30 Pa s; is 0.046 Pa s meant?
^pressure_viscosity_per_GPa = 21.0 => pressure_viscosity_per_GPa = 2.1 => per_GPa = 2.1; mineral oils: 15
^astm_viscosity_1_mm2_s => viscosity_Pas = 0.1@astm_viscosity_1_mm2_s => lubricant.viscosity_Pas = 0.1; no entry
law = "three_parameter" => kinematics = "published" => friction.kinematics = 'published'; law = "three_parameter"
law = "three_parameter" => sliding_coefficient = 0.15 => friction.sliding_coefficient = 0.15; no entry; no effect
law = "three_parameter" => law = "two_parameter" => friction.law = 'two_parameter'; mechanistic; three_parameter
lead_mm = 8.0 => lead_mm = 8.0@ball_material = "glass" => screw.ball_material = 'glass'; 'silicon_nitride'
+iso_vg = 69 => => lubricant.iso_vg = 69; 46, 68, 100
+viscosity_index = None => => lubricant.viscosity_index = (missing); iso_vg needs it
+astm_viscosity_1_cSt = 100 => => lubricant.astm_viscosity_1_cSt = 100; no entry with iso_vg
density_kg_m3 = 970.0 => density_kg_m3 = 970.0@density_15c_kg_m3 = 980 => density_15c_kg_m3 = 980; no entry without
ball_count = 86  => ball_count = 159  => screw.ball_count = 159; at most 158; more than fit the turns and returns
lead_mm = 8.0 => lead_mm = 4.5@starts = 1 => screw.ball_diameter_mm = 4.763; less than 4.491 mm; the grooves meet
lead_mm = 8.0 => lead_mm = 8.0@starts = 2 => screw.ball_diameter_mm = 4.763; less than 3.992 mm; the grooves meet
nominal_radius_mm = 20.0 => nominal_radius_mm = 4.7 => ball_diameter_mm = 4.763; less than nominal_radius; check both
nominal_radius_mm = 20.0 => nominal_radius_mm = 2.5 => less than nominal_radius; in inches? 1 in = 25.4 mm
lead_mm = 8.0 => lead_mm = -8.0@hand = "right" => screw.lead_mm = -8.0; more than 0 with hand = right; left-hand
turns = 3 => turns = "3x" => screw.turns = '3x'; a number; as 5 or "2.5x2"
lead_mm = 8.0 => lead_mm = 8.0@root_diameter_mm = 33 => screw.root_diameter_mm = 33; 34.42 to 35.85 mm
loaded_ball_count = 72  => return_ball_count = 85  => screw.return_ball_count = 85; at most 84
loaded_ball_count = 72  => return_ball_count = 10@loaded_ball_count = 72  => loaded_ball_count = 72; 76, or no entry
[friction] => [map]@preload_min_N = 1.0@[friction] => map.preload_max_N = (missing); a range needs both ends
[friction] => [map]@speed_min_rpm = 2@speed_max_rpm = 1@[friction] => map.speed_max_rpm = 1; more than speed_min
[friction] => [map]@temperature_max_degC = 501.0@[friction] => map.temperature_max_degC = 501.0; <= 500 degC
law = "three_parameter" => raceway_rq_um = 0.05  => friction.ball_rq_mm = (missing); raceway_rq needs it
"""


def test_a_file_of_notepad_is_read_and_one_of_any_length_refused(read):
    assert read("\ufeff" + EXAMPLE.replace("\n", "\r\n")) == read(EXAMPLE)
    with pytest.raises(ParameterError, match="1000001 characters; allowed: a screw file"):
        read("," * 1_000_001)


def test_a_mistake_gives_one_line_with_file_key_value_and_remedy(read):
    cases = [("[screw\n", "no valid TOML; line 1")]
    for line in MISTAKES.strip("\n").splitlines():
        old, new, said = (part.replace("@", "\n") for part in line.split("=> "))
        if old.startswith("+"):
            given = dict(entry.split(" = ") for entry in old[1:].rstrip().split(", "))
            text = graded(**{key: None if value == "None" else value for key, value in given.items()})
        else:
            text = edited(old.removeprefix("^")[:-1], new[:-1], EXAMPLE if old.startswith("^") else PACKAGED)
        cases.append((text, said))
    for text, said in cases:
        with pytest.raises(ParameterError) as caught:
            read(text)
        line = str(caught.value)
        assert "\n" not in line
        for part in ["screw.toml: ", *said.split("; ")]:
            assert part in line, (part, line)


def test_changed_parameters_are_checked_and_derived_again():
    wider = changed(GD4008, screw={"nominal_radius": 0.0201})
    assert wider.screw.spacer_length == 0.0201
    assert wider.lubricant == GD4008.lubricant
    with pytest.raises(ValueError, match="greater than 0"):
        changed(GD4008, screw={"nominal_radius": -1.0})
    with pytest.raises(ValueError, match="Extra inputs"):
        changed(GD4008, screw={"nominal_radii": 1.0})


def test_balls_in_the_returns_carry_no_load(read):
    screw = read(edited("loaded_ball_count = 72 ", "return_ball_count = 14 ")).screw
    assert (screw.ball_count, screw.loaded_ball_count) == (86, 72)
    assert changed(GD4008, screw={"ball_count": 80}).screw.loaded_ball_count == 72
    assert read(edited("loaded_ball_count = 72 ", "# ")).screw.loaded_ball_count == 79
    text = edited("ball_count = 86  ", "# ", edited("loaded_ball_count = 72 ", "return_ball_count = 10 "))
    assert (read(text).screw.ball_count, read(text).screw.loaded_ball_count) == (89, 79)


def test_a_screw_as_catalogues_state_it(read):
    """Turns x circuits, a left-hand thread, the ball by the root; none of it but turns and balls is of the map."""
    left = read(edited("lead_mm = 8.0", "lead_mm = -8.0", edited("turns = 3 ", 'turns = "1.5 x 2" ')))
    assert (left.screw.turns, left.screw.lead, left.screw.signed_lead) == (3.0, 0.008, -0.008)
    assert read(edited("lead_mm = 8.0", 'lead_mm = 8.0\nhand = "left"')).screw == left.screw
    rooted = read(edited("ball_diameter_mm = 4.763", "root_diameter_mm = 35.132"))
    assert rooted.screw.ball_diameter == pytest.approx(4.763e-3, rel=1e-4)
    for same in (left, changed(GD4008, screw={"static_rating": 9e4})):
        assert parameters_hash(same) == parameters_hash(GD4008)
    two = changed(GD4008, screw={"starts": 2, "lead": 0.016, "lead_angle": 0.127}).screw
    assert changed(GD4008, screw={"ball_count": 150}).screw.loaded_ball_count == 72
    with pytest.raises(ValueError, match="at most 316"):
        changed(GD4008, screw=two.model_dump(exclude_unset=True) | {"ball_count": 320})


def test_ball_count_is_of_the_laws_of_the_paper(read):
    """Mechanistic: neither force nor map depends on it; texts of maps of before hold it."""

    def axial(parameters):
        return nut_forces(parameters, 2000.0, 1500.0)

    rolling = changed(GD4008, friction={"law": "mechanistic"})
    for parameters, balls in ((rolling, 72), (GD4008, 80)):
        other = changed(parameters, screw={"ball_count": 80})
        assert other.summed_balls == balls
        texts = map_parameters_json(parameters), map_parameters_json(other)
        force, hashed = ([of(own) for own in (parameters, other)] for of in (axial, parameters_hash))
        for same in (differences(*texts) is None, force[0] == force[1], hashed[0] == hashed[1]):
            assert same == (balls == 72)


def test_lead_angle_follows_and_a_rating_is_not_of_the_map(read):
    """The angle of the paper is rounded: 3.64 for 3.643 degrees."""
    found = read(edited("lead_angle_deg = 3.64 ", "dynamic_rating_kN = 30 # "))
    assert found.screw.lead_angle == pytest.approx(math.atan(0.2 / math.pi), rel=1e-12)
    rated = changed(GD4008, screw={"dynamic_rating": 30e3})
    assert parameters_hash(rated) == parameters_hash(GD4008) != parameters_hash(found)
    assert dynamic_rating(rated.screw) == 30e3
    assert computed_dynamic_rating(rated.screw) == dynamic_rating(GD4008.screw)


def test_balls_of_silicon_nitride(read):
    """ISO 26602: 310 GPa, 0.26; each side adds (1 - nu^2)/E. The same by its numbers is the same screw."""
    modulus = "youngs_modulus_GPa = 205.0"
    text = edited(modulus, f'{modulus}\nball_material = "silicon_nitride"')
    hybrid = read(text)
    assert E_prime(hybrid.screw) == pytest.approx(2.0 / (0.91 / 205e9 + 0.9324 / 310e9), rel=1e-12)
    assert hybrid.solids == (GD4008.solid, NITRIDE)
    numbers = {"ball_youngs_modulus": 310e9, "ball_poisson_ratio": 0.26}
    same = changed(GD4008, screw=numbers, ball=NITRIDE.model_dump())
    assert parameters_hash(same) == parameters_hash(hybrid)
    ball = "density_kg_m3 = 6000.0\nspecific_heat_J_kgK = 400.0\nthermal_conductivity_W_mK = 2.5"
    heavy = read(f"{text}\n[ball]\n{ball}")
    assert heavy.solids[1].density == 6000.0
    stiff = changed(GD4008, screw={"ball_youngs_modulus": 210e9})
    others = [GD4008, hybrid, heavy, stiff, changed(hybrid, screw={"ball_youngs_modulus": 300e9})]
    assert len({parameters_hash(each) for each in others}) == len(others)


def test_roughness_height_is_the_composite_of_both_surfaces(read):
    text = edited('law = "three_parameter"', "raceway_rq_um = 0.04\nball_rq_nm = 0 ")
    with pytest.raises(ParameterError, match="bad unit"):
        read(text)
    found = read(text.replace("ball_rq_nm = 0", "ball_rq_um = 0.03")).friction
    assert found.roughness_height == pytest.approx(0.05e-6, rel=1e-12)
    assert read(text.replace("ball_rq_nm", "ball_rq_um")).friction.roughness_height == 0.04e-6
    assert GD4008.friction.roughness_height is None


def test_an_oil_by_its_grade_is_derived_again_when_changed(read):
    oil = read(graded())
    thicker = changed(oil, lubricant={"iso_vg": 100})
    assert thicker.lubricant.astm_viscosity_1 == pytest.approx(1e-4, rel=1e-12)
    assert thicker.lubricant.viscosity > 1.4 * oil.lubricant.viscosity
    assert thicker.lubricant == read(graded(iso_vg=100)).lubricant
    assert oil.lubricant.model_fields_set == {"name", "iso_vg", "viscosity_index"}
    assert hash(oil) == hash(read(graded()))


def test_law_is_mechanistic_where_a_file_states_none(read):
    assert GD4008.friction.law is Law.THREE_PARAMETER
    assert read(edited('law = "three_parameter"', "")).friction.law is Law.MECHANISTIC
    own = example_parameters().friction
    assert own.law is Law.MECHANISTIC
    assert "law" in own.model_fields_set

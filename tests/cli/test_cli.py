"""Command line: results equal the API, bad input gives one line and exit code 2, short imports."""

import csv
import json
import math
import re
import subprocess
import sys

import command_line
import numpy as np
import pytest
from command_line import refused
from paths import PUBLISHED, ROOT
from reference_screw import GD4008

from ballscrew_tehl.cli import main as cli
from ballscrew_tehl.friction.sets import default_friction_set, load_friction_sets
from ballscrew_tehl.nut_map.file import load_map

POINT = ("--preload-n", "2000", "--speed-rpm", "1000", "--temperature-c", "30")


def run(capsys, *arguments):
    """Exit code, parsed JSON, stderr."""
    code, out, err = command_line.run(capsys, *arguments, "--json")
    return code, json.loads(out) if out else None, err


def test_a_point_outside_the_map_is_said_in_one_line(capsys):
    code, _, err = command_line.run(capsys, "torque", *POINT, "--axial-load-n", "0")
    assert (code, err) == (0, "")
    code, _, err = command_line.run(capsys, "torque", "--preload-n", "5e9", *POINT[2:])
    assert code == 0
    assert err.startswith(
        "in_range: false; preload_n 5e+09 is outside the map, the numbers are those at its edge"
    )
    assert err.count("\n") == 1
    _, _, err = command_line.run(capsys, "torque", "--preload-n", "50", *POINT[2:])
    assert "preload_n 50 is outside the map, the numbers are extrapolated from its lowest preload" in err
    error = refused(capsys, "torque", *POINT[:4], "--temperature-c", "303.15")
    assert "is 303.15 K = 30 C meant?" in error


def test_torque_is_that_of_the_map(capsys):
    code, found, _ = run(capsys, "torque", *POINT, "--axial-load-n", "-300")
    state = load_map(None, GD4008).evaluate(
        2000.0, 1000.0 * math.pi / 30.0, 303.15, -300.0, *default_friction_set(GD4008).values
    )
    assert code == 0
    for key, value in (
        ("viscous_torque_nm", state.viscous_torque),
        ("hysteresis_torque_nm", state.hysteresis_torque),
        ("sliding_torque_nm", state.sliding_torque),
        ("film_thickness_min_m", state.film_thickness_min),
        ("film_thickness_central_screw_m", state.film_thickness_central_screw),
        ("film_thickness_central_nut_m", state.film_thickness_central_nut),
        ("film_temperature_rise_k", state.film_temperature_rise),
        ("contact_pressure_max_pa", state.contact_pressure_max),
        ("ball_load_max_n", state.ball_load_max),
        ("lambda_ratio", state.lambda_ratio),
    ):
        assert found[key] == pytest.approx(float(value), rel=1e-12), key
    parts = sum(found[f"{name}_torque_nm"] for name in ("viscous", "hysteresis", "sliding"))
    assert found["friction_torque_nm"] == pytest.approx(parts, rel=1e-15)
    assert found["in_range"] is True
    assert found["clamped"] == []
    assert found["preload_n"] == 2000.0


def test_torque_opposes_the_motion(capsys):
    _, forward, _ = run(capsys, "torque", *POINT)
    _, backward, _ = run(
        capsys, "torque", "--preload-n", "2e3", "--speed-rpm", "-1e3", "--temperature-c", "30"
    )
    _, rest, _ = run(capsys, "torque", "--preload-n", "2000", "--speed-rpm", "0", "--temperature-c", "30")
    assert forward["friction_torque_nm"] > 0.0
    assert backward["friction_torque_nm"] == -forward["friction_torque_nm"]
    assert backward["sliding_torque_nm"] == -forward["sliding_torque_nm"]
    assert rest["friction_torque_nm"] == 0.0


def test_outside_the_map_is_flagged(capsys):
    _, found, _ = run(
        capsys, "torque", "--preload-n", "2000", "--speed-rpm", "90000", "--temperature-c", "30"
    )
    assert found["in_range"] is False
    assert found["clamped"] == ["speed"]


def test_films_below_a_nanometre_are_named_and_in_range(capsys):
    _, found, _ = run(capsys, "torque", "--preload-n", "9000", "--speed-rpm", "5.5", "--temperature-c", "79")
    assert found["film_thickness_min_m"] < 1e-9
    assert found["too_thin_film"].startswith("least film 0.")
    assert found["in_range"] is True
    _, found, _ = run(capsys, "torque", *POINT)
    assert "too_thin_film" not in found


def test_preload_inverts_torque(capsys):
    _, torque, _ = run(
        capsys, "torque", "--preload-n", "3210", "--speed-rpm", "-140", "--temperature-c", "41"
    )
    magnitude = repr(abs(torque["friction_torque_nm"]))
    code, found, _ = run(
        capsys, "preload", "--torque-nm", magnitude, "--speed-rpm", "-140", "--temperature-c", "41"
    )
    assert code == 0
    assert found["preload_n"] == pytest.approx(3210.0, rel=1e-9)


def test_points_over_the_published_tables_reach_the_targets(capsys):
    """Mean deviations over Tables 2, 4 and 3 with the default set of the paper's own model or better."""
    for name, target in (("table2_torque_vs_preload", 0.0159), ("table4_torque_vs_speed", 0.0117)):
        path = PUBLISHED / "zhao2023" / f"{name}.csv"
        code, found, err = run(capsys, "torque", "--points", str(path), "--temperature-c", "29.85")
        rows = list(
            csv.DictReader(line for line in path.read_text().splitlines() if not line.startswith("#"))
        )
        assert code == 0
        assert "columns not used: measured_nm, zhao_nm, zhou_nm, nsk_nm" in err
        errors = [
            abs(point["friction_torque_nm"] / float(row["measured_Nm"]) - 1.0)
            for point, row in zip(found, rows, strict=True)
        ]
        assert np.mean(errors) <= target, name
    path = PUBLISHED / "zhao2023" / "table3_preload_from_torque.csv"
    rows = list(csv.DictReader(line for line in path.read_text().splitlines() if not line.startswith("#")))
    _, found, _ = run(
        capsys, "preload", "--points", str(path), "--speed-rpm", "100", "--temperature-c", "29.85"
    )
    errors = [abs(p["preload_n"] / float(row["preload_N"]) - 1.0) for p, row in zip(found, rows, strict=True)]
    assert np.mean(errors) <= 0.0219


def test_points_always_give_a_list(capsys, tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("preload_n,speed_rpm,temperature_c\n2000,1000,30\n")
    _, found, _ = run(capsys, "torque", "--points", str(path))
    _, single, _ = run(capsys, "torque", *POINT)
    assert found == [single]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("torque",), "--preload-n (missing)"),
        (("torque", *POINT[:4]), "--temperature-c (missing)"),
        (
            ("torque", *POINT[:4], "--temperature-c", "-274"),
            "--temperature-c = -274; allowed: -73.15 to 200",
        ),
        (("torque", "--preload-n", "-1e3", *POINT[2:]), "--preload-n = -1e3; allowed: a finite number >= 0"),
        (("torque", "--preload-n", "nan", *POINT[2:]), "--preload-n = nan"),
        (("torque", "--speed-rpm", "-inf", *POINT[:2], *POINT[4:]), "--speed-rpm = -inf"),
        (("torque", *POINT, "--preload"), "unrecognized arguments: --preload"),
        (("torque", *POINT, "--screw", "none.toml"), "none.toml: cannot be read"),
        (("torque", *POINT, "--map", "none.nc"), "none.nc"),
        (("torque", *POINT, "--kinematics", "fixed"), "invalid choice: 'fixed'"),
        (("torque", "--points", "none.csv"), "none.csv: cannot be read"),
        (("torque", "--direct", "--preload-n", "0", *POINT[2:]), "allowed with --direct: not 0"),
        (("preload", "--torque-nm", "1", "--speed-rpm", "0", "--temperature-c", "30"), "--speed-rpm = 0"),
        (
            ("preload", "--torque-nm", "1e3", "--speed-rpm", "1", "--temperature-c", "30"),
            "torque_nm = 1000 at 1 r/min and 30 C; allowed: ",
        ),
        (("contact",), "--load-n (missing)"),
        (
            ("contact", "--moes", "20", "x", "--radius-ratio", "1", "--law", "barus"),
            "--moes = 20 x; allowed: two numbers",
        ),
        (("contact", "--moes", "20", "5", "--radius-ratio", "2", "--law", "barus"), "radius_ratio = 2.0"),
        (("contact", "--moes", "20", "5", "--law", "barus"), "--radius-ratio (missing)"),
        (
            ("contact", "--moes", "20", "5", "--radius-ratio", "1", "--law", "barus", "--roughness-um", "1"),
            "--roughness-um = 1.0",
        ),
        (("contact", "--moes", "20", "5", "--load-n", "3"), "--radius-ratio (missing)"),
        (
            ("contact", "--rheology", "maxwell"),
            "invalid choice: 'maxwell' (choose from 'newtonian', 'eyring', 'carreau', 'limiting_shear_stress')",
        ),
        (("map", "info", "none.nc"), "none.nc"),
        (("map", "check", "--count", "0"), "--count = 0"),
        (("map", "build", "--workers", "0"), "--workers = 0"),
        (("map", "polish"), "invalid choice: 'polish'"),
        (("calibrate",), "either MEASUREMENTS.csv or --packaged"),
        (("calibrate", "none.csv"), "none.csv: cannot be read"),
        (("paint",), "invalid choice: 'paint'"),
        ((), "the following arguments are required: COMMAND"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(capsys, arguments, named):
    assert named in refused(capsys, *arguments)


def test_screw_file_selects_kinematics_and_overrides(capsys, tmp_path):
    path = tmp_path / "screw.toml"
    source = (ROOT / "solver" / "ballscrew_tehl" / "data" / "gd4008.toml").read_text()
    changed = source.replace(
        'kinematics = "published"', 'kinematics = "published"\nnet_sliding_coefficient = 0.0'
    )
    assert changed != source
    path.write_text(changed)
    _, found, _ = run(capsys, "torque", *POINT, "--screw", str(path))
    assert found["sliding_torque_nm"] == 0.0
    path.write_text(source.replace("ball_diameter_mm = 4.763", "ball_diameter_mm = 4.5"))
    assert "ball_diameter" in refused(capsys, "torque", *POINT, "--screw", str(path))


def test_map_info_prints_axes_and_hash(capsys):
    code, found, _ = run(capsys, "map", "info")
    assert code == 0
    assert set(found["axes"]) == {"force", "speed", "temperature", "preload", "share"}
    assert found["kinematics"] == "published"
    assert cli.main(["map", "info"]) == 0
    text = capsys.readouterr().out
    # the packaged map as docs/import_the_fmu.md describes it
    assert re.search(r"axes\.speed +\S+ to 5880\.1 r/min, ", text)
    assert re.search(r"axes\.temperature +10 to 80 C, ", text)
    assert found["file_hash"] in text
    assert default_friction_set(GD4008).provenance in " ".join(text.split())


def test_calibrate_a_user_file(capsys, tmp_path):
    """Torques made from known parameters are fitted back, written, and shown as lines for the screw file."""
    from section7 import MEASURED

    from ballscrew_tehl.calibration.packaged import torque_basis
    from ballscrew_tehl.nut_map.contact_map import SolvedFilm
    from ballscrew_tehl.nut_map.file import load_contact_map, packaged_map

    basis = torque_basis(GD4008, SolvedFilm(load_contact_map(None, GD4008), True), MEASURED)
    torques = basis.torque((8.0, 0.004, 20e-9))
    lines = ["preload_N,speed_rpm,torque_Nm,table"]
    for m, torque in zip(MEASURED, torques, strict=True):
        lines.append(f"{m.preload},{m.speed * 30.0 / math.pi!r},{float(torque)!r},{m.tables[-1]}")
    path, output = tmp_path / "measured.csv", tmp_path / "fitted.toml"
    path.write_text("\n".join(lines))
    common = ("calibrate", str(path), "--map", str(packaged_map("published")))
    code, found, _ = run(capsys, *common, "--output", str(output))
    assert code == 0
    entry = found["published.three_parameter"]
    assert entry["apparent_viscosity_ratio"] == pytest.approx(8.0, rel=1e-4)
    assert entry["net_sliding_coefficient"] == pytest.approx(0.004, rel=1e-4)
    assert entry["roughness_height"] == pytest.approx(20e-9, rel=1e-4)
    assert entry["film_model"] == "solved_thermal"
    written = load_friction_sets(output)["published", "three_parameter"]
    assert written.apparent_viscosity_ratio == pytest.approx(8.0, rel=1e-4)
    assert cli.main([*common, "--set", "two_parameter"]) == 0
    text = capsys.readouterr().out
    assert '[friction]\nset = "two_parameter"\nnet_sliding_coefficient = ' in text
    assert "roughness_height_m = 0\n" in text


def test_validate_prints_all_sets_and_all_models(capsys, tmp_path):
    code, found, _ = run(capsys, "validate")
    assert code == 0
    assert set(found["tables"]) == {"three_parameter", "two_parameter", "mechanistic"}
    table2, table4, table3 = found["tables"]["three_parameter"]
    assert table2["deviations"][0] <= 0.0159
    assert table4["deviations"][0] <= 0.0117
    assert table3["deviations"][0] <= 0.0219
    assert [law["name"] for law in found["laws"]][:3] == ["three_parameter", "two_parameter", "mechanistic"]
    picture = tmp_path / "shares.png"
    assert cli.main(["validate", "--plot", str(picture)]) == 0
    assert picture.stat().st_size > 10_000
    text = capsys.readouterr().out
    assert text.count("mean deviation") == 9
    assert "Jungnickel" in text
    assert "inferred from friction coefficients" in text
    assert "NSK" in text


def test_contact_by_moes_numbers(capsys):
    # film_references.csv: 3.2610 and 2.0271 within 0.5 and 1.5 %
    code, found, _ = run(
        capsys,
        "contact",
        "--moes",
        "20",
        "5",
        "--radius-ratio",
        "1",
        "--law",
        "barus",
        "--domain",
        "-4.5",
        "1.5",
        "3",
    )
    assert code == 0
    assert found["converged"] is True
    assert found["branch"] == "resolved"
    assert found["Hc"] == pytest.approx(3.2610, rel=5e-3)
    assert found["Hm"] == pytest.approx(2.0271, rel=1.5e-2)
    assert 0.0 < found["error_estimate"] < 5e-3


def test_contact_by_dimensions_equals_the_solver(capsys):
    from dataclasses import replace

    from ballscrew_tehl.contact.conditions import ContactConditions, SolverOptions
    from ballscrew_tehl.contact.solve import solve_contact
    from ballscrew_tehl.physics.asperity import typical_roughness
    from ballscrew_tehl.physics.hertz import E_prime

    numbers = (20.0, 2.18e-3, 61.8e-3, 1.0, 0.9, 313.15)
    options = ("--load-n", "--radius-x-m", "--radius-y-m", "--u1-m-s", "--u2-m-s", "--temperature-k")
    arguments = [text for pair in zip(options, map(str, numbers), strict=True) for text in pair]
    code, found, _ = run(capsys, "contact", *arguments, "--isothermal")
    conditions = ContactConditions(*numbers, E_prime(GD4008.screw))
    direct = solve_contact(conditions, GD4008.lubricant, GD4008.solid, SolverOptions(thermal=False))
    assert code == 0
    assert found["h_c_m"] == pytest.approx(direct.h_c, rel=1e-9)
    assert found["h_m_m"] == pytest.approx(direct.h_m, rel=1e-9)
    assert found["temperature_rise_k"] == 0.0
    assert found["M"] == pytest.approx(direct.M, rel=1e-12)
    assert set(found) >= {"p_max_pa", "traction_force_n", "converged", "iterations", "seconds", "L"}
    assert found["asperity_load_share"] == 0.0
    code, rough, _ = run(capsys, "contact", *arguments, "--isothermal", "--roughness-um", "0.2")
    direct = solve_contact(
        replace(conditions, roughness=typical_roughness(2e-7)), GD4008.lubricant, GD4008.solid,
        SolverOptions(thermal=False),
    )  # fmt: skip
    assert code == 0
    assert rough["h_c_m"] == pytest.approx(direct.h_c, rel=1e-9)
    assert rough["asperity_load_share"] == pytest.approx(direct.asperity_load_share, rel=1e-9)
    assert rough["asperity_load_share"] > 1e-4


def test_contact_points_mix_moes_and_dimensions(capsys, tmp_path):
    path = tmp_path / "contacts.csv"
    path.write_text("moes,radius_ratio,law,domain\n20 5,1,barus,-4.5 1.5 3\n20 5,1,roelands,-4.5 1.5 3\n")
    code, found, _ = run(capsys, "contact", "--points", str(path))
    assert code == 0
    # film_references.csv
    assert [entry["Hc"] for entry in found] == pytest.approx([3.2610, 2.9891], rel=5e-3)
    path.write_text("moes,radius_ratio,lore\n20 5,1,barus\n")
    assert "row 1: lore: unknown" in refused(capsys, "contact", "--points", str(path))


@pytest.mark.slow
def test_direct_solve_agrees_with_the_map(capsys):
    """Bounds: the largest errors of the certificate of the map."""
    certificate = load_map(None, GD4008).header["certificate"]
    _, by_map, _ = run(capsys, "torque", *POINT)
    code, direct, _ = run(capsys, "torque", *POINT, "--direct")
    assert code == 0
    films = ("film_thickness_central_screw_m", "film_thickness_central_nut_m")
    for keys, error in (
        (("friction_torque_nm",), certificate["torque_error_max"]),
        (films, certificate["film_error_max"]),
        (("film_temperature_rise_k",), certificate["temperature_rise_error_max"]),
        (("contact_pressure_max_pa", "ball_load_max_n"), 1e-3),
    ):
        for key in keys:
            assert direct[key] == pytest.approx(by_map[key], rel=error), key


@pytest.mark.parametrize(
    "arguments",
    [("torque", *POINT), ("preload", "--torque-nm", "0.8", "--speed-rpm", "100", "--temperature-c", "30")],
    ids=["torque", "preload"],
)
def test_commands_that_read_the_map_import_nothing_slow(arguments):
    code = (
        "import sys; from ballscrew_tehl.cli.main import main; code = main(sys.argv[1:]);"
        "heavy = {'numba', 'scipy.optimize', 'xarray', 'pandas', 'matplotlib', 'rich'} & set(sys.modules);"
        "assert not heavy, heavy; sys.exit(code)"
    )
    done = subprocess.run([sys.executable, "-c", code, *arguments, "--json"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    json.loads(done.stdout)


def test_choices_of_the_parser_are_those_of_the_modules():
    """The parser repeats names so that it does not import the modules that define them."""
    from ballscrew_tehl.calibration.fit import LOSSES
    from ballscrew_tehl.calibration.packaged import FILM_OF_SET
    from ballscrew_tehl.calibration.user import DROPS
    from ballscrew_tehl.cli.contact import LAWS as OFFERED_LAWS
    from ballscrew_tehl.contact.moes import LAWS
    from ballscrew_tehl.friction.sets import SETS
    from ballscrew_tehl.nut_map.file import FILM_MODELS
    from ballscrew_tehl.parameters.template import LUBRICANTS
    from ballscrew_tehl.physics.kinematics import KINEMATICS

    assert tuple(LOSSES) == cli.LOSS_NAMES
    assert DROPS == cli.DROP_KINDS
    assert LUBRICANTS == cli.LUBRICANTS
    assert tuple(SETS) == cli.SET_NAMES
    assert tuple(KINEMATICS) == cli.KINEMATICS
    assert set(FILM_OF_SET.values()) == set(FILM_MODELS)
    assert set(FILM_OF_SET) == set(SETS)
    assert set(FILM_OF_SET.values()) == set(FILM_MODELS)
    assert tuple(LAWS) == OFFERED_LAWS


def test_module_and_pipe():
    done = subprocess.run(
        [sys.executable, "-m", "ballscrew_tehl", "--version"], capture_output=True, text=True
    )
    assert done.returncode == 0
    assert done.stdout.startswith("ballscrew_tehl ")
    # a pipe that is closed early gives no error message
    command = f"{sys.executable} -m ballscrew_tehl validate | head -n 1"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True)
    assert "Errno" not in done.stderr
    assert done.stdout.count("\n") == 1

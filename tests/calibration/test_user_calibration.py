"""calibrate on files: used and dropped rows, recovered parameters, bad input, picture, friction file."""

import json
from dataclasses import replace
from pathlib import Path

import command_line
import numpy as np
import pytest
from closed_film import HamrockDowsonFilm
from command_line import refused
from reference_screw import GD4008
from section7 import MEASURED

from ballscrew_tehl.calibration.diagnostics import SPLIT
from ballscrew_tehl.calibration.fit import fit_values
from ballscrew_tehl.calibration.measurement_file import MeasurementFile, read_measurement_file
from ballscrew_tehl.calibration.measurements import PACKAGED_TORQUE, packaged_measurements
from ballscrew_tehl.calibration.packaged import torque_basis
from ballscrew_tehl.calibration.plot import calibration_figure
from ballscrew_tehl.calibration.user import calibrate_file
from ballscrew_tehl.cli import main as cli
from ballscrew_tehl.friction.sets import friction_set_of_file, load_friction_sets
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.nut_map.contact_map import SolvedFilm
from ballscrew_tehl.nut_map.file import load_contact_map, load_map, packaged_map
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.parameters.packaged_data import PACKAGED_DATA
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.refinement.direct import DirectFilm
from ballscrew_tehl.runtime.packed import MapError

MAP = str(packaged_map("published"))
PUBLISHED_FILE = str(PACKAGED_DATA / "gd4008.toml")
TRUTH = (5.2, 0.0055, 22e-9)
HEAD = "preload [kN],speed [1/min],temperature [degC],torque [N.m],axial load [N]"
POINTS = [
    (preload, rpm, celsius, axial)
    for preload, axial in ((1.0, 0.0), (3.0, 600.0), (5.0, -900.0))
    for rpm in (30.0, 100.0, 400.0, 1500.0)
    for celsius in (20.0, 45.0)
]


@pytest.fixture(scope="module")
def films():
    contact_map = load_contact_map(None, GD4008)
    return {name: SolvedFilm(contact_map, name == "solved_thermal") for name in ("solved", "solved_thermal")}


@pytest.fixture(scope="module")
def torques(films):
    """Torques of POINTS with the films of the packaged map and the parameters TRUTH, noise 0.5 %."""
    points = [
        replace(
            MEASURED[0], preload=1e3 * preload, speed=rpm * RPM, temperature=celsius + CELSIUS, axial_load=axial,
            tables=(),
        )
        for preload, rpm, celsius, axial in POINTS
    ]  # fmt: skip
    noise = 1.0 + 0.005 * np.random.default_rng(8).normal(size=len(points))
    return torque_basis(GD4008, films["solved_thermal"], points).torque(TRUTH) * noise


@pytest.fixture
def measured(tmp_path, torques):
    """Writes the file; rows: number from 1 -> line to put instead."""

    def write(rows=None, name="measured.csv"):
        lines = [
            f"{preload},{rpm},{celsius},{torque!r},{axial}"
            for (preload, rpm, celsius, axial), torque in zip(POINTS, torques.tolist(), strict=True)
        ]
        for number, line in (rows or {}).items():
            lines[number - 1] = line
        path = tmp_path / name
        path.write_text("\n".join([HEAD, *lines]) + "\n")
        return str(path)

    return write


def run(capsys, *arguments):
    code, out, err = command_line.run(capsys, "calibrate", *arguments, "--json")
    assert code == 0, err
    return json.loads(out), err


def test_torque_basis_under_axial_load_is_the_double_nut(films):
    film = HamrockDowsonFilm(GD4008)
    points = [replace(MEASURED[1], axial_load=load) for load in (0.0, 1500.0, -8000.0)]
    basis = torque_basis(GD4008, film, points)
    assert np.isinf(basis.film[2]).sum() == 2  # one nut has separated
    entry = load_friction_sets()["published", "three_parameter"]
    for m, torque in zip(points, basis.torque(entry.values), strict=True):
        direct = double_nut_torque(GD4008, entry, film, m.preload, m.speed, m.temperature, m.axial_load)
        assert torque == pytest.approx(direct.total, rel=1e-12)
    values = np.array(entry.values)
    step = np.array([0.0, 0.0, 1e-5 * values[2]])
    numeric = (basis.errors(values + step) - basis.errors(values - step)) / (2.0 * step[2])
    np.testing.assert_allclose(basis.jacobian(values)[:, 2], numeric, rtol=1e-6)


def test_torque_basis_with_the_films_of_the_map_is_the_torque_of_the_map(films):
    """Map and basis interpolate differently: 0.2 %, twice the certified error of a map."""
    loads = (0.0, 1500.0, -2500.0)
    points = [replace(MEASURED[1], speed=400.0 * RPM, axial_load=load) for load in loads]
    found = torque_basis(GD4008, films["solved_thermal"], points).torque(TRUTH)
    state = load_map(None, GD4008).evaluate(2000.0, 400.0 * RPM, 303.0, np.array(loads), *TRUTH)
    np.testing.assert_allclose(found, state.friction_torque, rtol=2e-3)


def test_known_parameters_lie_in_their_limits(capsys, measured):
    found, _ = run(capsys, measured(), "--map", MAP)
    entry = found["published.three_parameter"]
    for name, value in zip(("apparent_viscosity_ratio", "net_sliding_coefficient", "roughness_height"), TRUTH,
                           strict=True):  # fmt: skip
        ends = entry["limits"][name]
        assert ends["low"] < value < ends["high"], name
        assert ends["high"] - ends["low"] < 0.1 * value, name
    calibration = entry["calibration"]
    assert entry["not_identified"] == calibration["not_identified"] == {}
    assert calibration["dropped"] == calibration["outliers"] == []
    assert len(calibration["points"]) == len(POINTS)
    assert calibration["points"][9]["axial_load_n"] == 600.0
    assert calibration["points"][9]["speed_rpm"] == pytest.approx(30.0)
    assert "24 points of 24 rows" in entry["provenance"]
    assert entry["screw"] == "GD4008-3"


@pytest.mark.parametrize("name", ["two_parameter", "three_parameter"])
def test_the_tables_of_the_paper_give_the_packaged_set(capsys, name):
    """Films of the map instead of direct solves: values within a tenth of their intervals, torques within 0.1 %."""
    found, _ = run(capsys, str(PACKAGED_TORQUE), "--map", MAP, "--set", name, "--loss", "soft_l1")
    entry, packaged = found[f"published.{name}"], load_friction_sets()["published", name]
    for parameter, half in packaged.intervals.items():
        assert entry[parameter] == pytest.approx(getattr(packaged, parameter), abs=0.1 * half), parameter
        assert entry["intervals"][parameter] == pytest.approx(half, rel=0.1)
    assert entry["errors"]["mean"] == pytest.approx(packaged.errors["mean"], abs=1e-3)
    assert entry["errors"]["leave_one_out_mean"] == pytest.approx(
        packaged.errors["leave_one_out_mean"], abs=1e-3
    )
    unknown = entry["not_identified"]
    assert SPLIT in unknown
    assert ("roughness_height" in unknown) == (name == "three_parameter")
    assert "sliding share of the torque" in unknown[SPLIT]
    # with a roughness height the first point lies at the limit: 4.5 of 4.1, 4.0 with earlier films
    outliers = entry["calibration"]["outliers"]
    assert outliers == [[1, 7]] or (name == "three_parameter" and outliers == [])


@pytest.mark.slow
def test_direct_solves_give_the_packaged_set_to_its_digits():
    basis = torque_basis(
        GD4008, DirectFilm(GD4008, thermal=False), read_measurement_file(PACKAGED_TORQUE, 303.0).measurements
    )
    packaged = load_friction_sets()["published", "two_parameter"]
    np.testing.assert_allclose(fit_values(basis, 2, "soft_l1"), packaged.values, rtol=1e-5)


def test_impossible_rows_stop_the_fit_unless_dropped(capsys, measured):
    bad = {3: "-1,30,20,0.3,0", 7: "1,0,20,0.3,0", 12: "3,30,300,1.0,0", 20: "5,100,20,1500,0"}
    path = measured(bad)
    line = refused(capsys, "calibrate", path, "--map", MAP)
    for part in ("4 impossible row(s)", "row 3 (line 4): preload = -1 kN", "row 7 (line 8): speed = 0 1/min",
                 "row 12 (line 13): temperature = 300 degC", "probably K, not degC", "row 20 (line 21): torque = 1500",
                 "--drop impossible"):  # fmt: skip
        assert part in line
    found, _ = run(capsys, path, "--map", MAP, "--drop", "impossible")
    entry = found["published.three_parameter"]
    assert [problem["row"] for problem in entry["calibration"]["dropped"]] == [3, 7, 12, 20]
    assert [row for point in entry["calibration"]["points"] for row in point["rows"]] == [
        row for row in range(1, 25) if row not in bad
    ]
    assert "20 points of 24 rows, without rows 3, 7, 12, 20" in entry["provenance"]


def test_rows_outside_the_map_stop_the_fit_unless_dropped(capsys, measured):
    path = measured({5: "1,30,95,0.3,0", 6: "20,30,20,7,0"})
    line = refused(capsys, "calibrate", path, "--map", MAP)
    assert (
        "2 row(s) outside the map: row 5 (line 6): temperature = 368.15 K; allowed: 283.15 to 353.15 K"
        in line
    )
    assert "row 6 (line 7): force of a nut = 20000 N; allowed: 12 to 12000 N" in line
    found, _ = run(capsys, path, "--map", MAP, "--drop", "outside")
    assert [p["row"] for p in found["published.three_parameter"]["calibration"]["dropped"]] == [5, 6]


@pytest.mark.slow
def test_outliers_are_reported_and_kept_unless_dropped(capsys, measured, torques):
    rows = {}
    for number, factor in ((4, 1.2), (18, 1.25)):
        preload, rpm, celsius, axial = POINTS[number - 1]
        rows[number] = f"{preload},{rpm},{celsius},{factor * torques[number - 1]},{axial}"
    path = measured(rows)
    kept, _ = run(capsys, path, "--map", MAP)
    entry = kept["published.three_parameter"]
    assert entry["calibration"]["outliers"] == [[4], [18]]
    assert len(entry["calibration"]["points"]) == 24
    notes = " ".join(entry["calibration"]["notes"])
    assert "row 4 (1000 N, 100 r/min): outlier, kept: torque" in notes
    assert "to leave it out: --drop outliers" in notes
    left, _ = run(capsys, path, "--map", MAP, "--drop", "outliers")
    entry = left["published.three_parameter"]
    assert [p["row"] for p in entry["calibration"]["dropped"]] == [4, 18]
    assert entry["calibration"]["outliers"] == []
    assert "without rows 4, 18" in entry["provenance"]
    assert entry["apparent_viscosity_ratio"] == pytest.approx(TRUTH[0], rel=0.02)


def test_few_points_are_refused_or_warned_of(capsys, tmp_path, measured):
    lines = (tmp_path / measured()).read_text().splitlines()
    path = tmp_path / "few.csv"

    def few(numbers):
        path.write_text("\n".join([HEAD] + [lines[number] for number in numbers]))
        return str(path)

    line = refused(capsys, "calibrate", few([1, 3, 5]), "--map", MAP)
    assert (
        "3 usable rows at 3 operating points; the 3 parameters of three_parameter need at least 4 rows"
        in line
    )
    assert "or fit --set two_parameter" in line
    assert "2 operating points; the 3 parameters" in refused(
        capsys, "calibrate", few([1, 1, 3, 3]), "--map", MAP
    )
    found, _ = run(capsys, few([1, 3, 7]), "--map", MAP, "--set", "two_parameter")
    entry = found["published.two_parameter"]
    assert any(
        "3 rows for 2 parameters: 1 degree(s) of freedom" in note for note in entry["calibration"]["notes"]
    )
    assert SPLIT in entry["not_identified"]
    found, _ = run(capsys, few([1, 3, 5, 5, 5, 5, 5, 5]), "--map", MAP)
    notes = found["published.three_parameter"]["calibration"]["notes"]
    assert "3 operating points for 3 parameters: no point is left to check the shape of the torque" in notes
    assert any("no other point checks it" in note for note in notes)


def test_stated_uncertainties_are_compared_with_the_errors(capsys, tmp_path, torques):
    path = tmp_path / "uncertain.csv"
    rows = [
        f"{preload},{rpm},{celsius},{torque!r},{axial},0.5"
        for (preload, rpm, celsius, axial), torque in zip(POINTS, torques.tolist(), strict=True)
    ]
    path.write_text("\n".join([HEAD + ",torque_uncertainty [%]", *rows]))
    found, _ = run(capsys, str(path), "--map", MAP)
    # 24 points, 3 parameters: chi of 21 degrees of freedom, 0.1 % tails
    assert 0.56 < found["published.three_parameter"]["calibration"]["error_over_uncertainty"] < 1.5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("--set", "mechanistic", "--screw", PUBLISHED_FILE),
            "friction set = mechanistic; allowed with kinematics published: three_parameter, two_parameter",
        ),
        (("--map", "none.nc"), "none.nc: no such map file"),
        (("--output", "nowhere/f.toml"), "nowhere/f.toml: no such folder"),
        (("--plot", "nowhere/f.png"), "nowhere/f.png: no such folder"),
        (("--temperature-c", "-300"), "--temperature-c = -300; allowed: -73.15 to 200"),
    ],
)
def test_bad_options_are_one_line(capsys, measured, arguments, message):
    assert message in refused(capsys, "calibrate", measured(), *arguments)


def test_options_without_effect_on_the_packaged_sets(capsys):
    assert "--map with --packaged; allowed: with MEASUREMENTS.csv only" in refused(
        capsys, "calibrate", "--packaged", "--map", MAP
    )


def test_temperature_of_rows_without_one(capsys, tmp_path, measured):
    path = tmp_path / "without.csv"
    lines = [line.split(",") for line in Path(measured()).read_text().splitlines()]
    path.write_text("\n".join(",".join(f for i, f in enumerate(line) if i != 2) for line in lines))
    found, _ = run(capsys, str(path), "--map", MAP, "--temperature-c", "25")
    calibration = found["published.three_parameter"]["calibration"]
    assert {point["temperature_k"] for point in calibration["points"]} == {298.15}
    assert "all rows: no oil temperature given, 298.15 K assumed" in calibration["notes"]


def test_text_names_points_limits_and_assumptions(capsys):
    assert cli.main(["calibrate", str(PACKAGED_TORQUE), "--map", MAP]) == 0
    out = capsys.readouterr().out
    assert "Not identified by these data:\n" in out
    for part in (
        "      1=7      1000      100",
        "95 % by profile: roughness_height",
        "condition number",
        "note: columns not used: zhao_Nm, zhou_Nm, nsk_Nm",
        "303 K assumed",
        'set = "three_parameter"',
    ):
        assert part in out
    assert "Only the total torque is identified" not in out


def test_friction_file_contains_values_and_provenance(capsys, measured, tmp_path):
    output = tmp_path / "friction.toml"
    found, err = run(
        capsys, measured(), "--map", MAP, "--output", str(output), "--plot", str(tmp_path / "p.png")
    )
    assert f"written: {output}" in err
    assert (tmp_path / "p.png").read_bytes()[:4] == b"\x89PNG"
    assert not list(tmp_path.glob("*.part"))
    entry = friction_set_of_file(output, GD4008)
    assert entry.limits == {
        name: {end: pytest.approx(value, rel=1e-5) for end, value in ends.items()}
        for name, ends in found["published.three_parameter"]["limits"].items()
    }
    assert entry.not_identified == {}
    nut_map = load_map(None, GD4008, entry)
    assert tuple(nut_map.defaults) == (*entry.values, 1.0)
    assert nut_map.header["friction"]["provenance"].startswith("measured.csv (SHA-256 ")
    assert nut_map.header["film_model"] == "solved_thermal"


def test_a_friction_file_of_another_screw_or_kinematics_is_refused(capsys, measured, tmp_path):
    output = tmp_path / "friction.toml"
    run(capsys, measured(), "--map", MAP, "--output", str(output))
    rolling = changed(GD4008, friction={"kinematics": "rolling_frame"})
    with pytest.raises(
        ValueError,
        match=r"kinematics = published with set three_parameter; allowed: rolling_frame",
    ):
        friction_set_of_file(output, rolling)
    other = changed(GD4008, friction={"hysteresis_coefficient": 0.02})
    entry = friction_set_of_file(output, GD4008)
    with pytest.raises(
        MapError, match=r"no packaged map fits .*friction\.hysteresis_coefficient = 0\.02.*0\.01"
    ):
        load_map(None, other, entry)
    with pytest.raises(MapError, match=r"the screw GD4008-3 \(000000000000\); expected GD4008-3 .*calibrate"):
        load_map(None, GD4008, replace(entry, parameters_hash="000000000000"))
    text = output.read_text()
    for old, new, message in (
        (
            "net_sliding_coefficient = 0.005",
            "net_sliding_coefficient = 5.005",
            "net_sliding_coefficient = 5.00",
        ),
        ("apparent_viscosity_ratio = ", "apparent_viscosity_ratio = -", "apparent_viscosity_ratio = -5"),
        ("apparent_viscosity_ratio = ", "viscosity_ratio = ", "no friction sets"),
    ):
        output.write_text(text.replace(old, new, 1))
        with pytest.raises(
            ValueError, match=r"allowed|give a file that calibrate --output has written"
        ) as caught:
            friction_set_of_file(output, GD4008)
        assert message in str(caught.value)
    with pytest.raises(
        ValueError, match=r"cannot be read .*; give a file that calibrate --output has written"
    ):
        friction_set_of_file(tmp_path / "none.toml", GD4008)


def test_a_file_name_with_quotes_is_kept_in_the_friction_file(capsys, measured, tmp_path):
    output = tmp_path / "friction.toml"
    path = measured(name='bench "3" \\ morning.csv')
    run(capsys, path, "--map", MAP, "--output", str(output))
    assert friction_set_of_file(output, GD4008).provenance.startswith('bench "3" \\ morning.csv (SHA-256')


def test_the_picture_shows_the_numbers(films, tmp_path):
    points = [replace(m, torque=m.torque * (1.3 if i == 5 else 1.0), rows=(i + 1,))
              for i, m in enumerate(packaged_measurements(303.0))]  # fmt: skip
    points = [replace(m, uncertainty=0.02 * m.torque) for m in points]
    file = MeasurementFile(tmp_path / "x.csv", points, [], [], tuple(range(2, 13)), "0")
    result = calibrate_file(file, GD4008, lambda name: films[name], "three_parameter")
    assert result.points.outliers == [5]
    left, right = calibration_figure(result).axes[:2]
    shown = np.asarray(left.collections[0].get_offsets())
    np.testing.assert_allclose(shown[:, 0], [m.torque for m in points])
    np.testing.assert_allclose(shown[:, 1], result.basis.torque(result.friction_set.values))
    assert [text.get_text() for text in right.texts] == ["row 6"]
    labels = [text.get_text() for text in right.get_legend().get_texts()]
    assert set(labels) == {
        "fitted to all points",
        "fitted without the point",
        "outlier",
        "standard uncertainty",
    }
    deviations = next(c for c in right.collections if c.get_label() == "fitted to all points").get_offsets()
    np.testing.assert_allclose(np.asarray(deviations)[:, 1], 100.0 * result.points.deviation)
    rest = result.basis.subset([j for j in range(11) if j != 5])
    alone = result.basis.torque(fit_values(rest, 3, "least_squares"))[5] / points[5].torque - 1.0
    assert result.left_out[5] == pytest.approx(alone, rel=1e-9)

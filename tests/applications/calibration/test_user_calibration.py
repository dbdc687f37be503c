"""calibrate on files: used and dropped rows, recovered parameters, bad input, picture, friction file."""

import json
from dataclasses import replace
from itertools import zip_longest

import command_line
import numpy as np
import pytest
from closed_film import HamrockDowsonFilm
from command_line import refused
from reference_screw import GD4008
from section7 import MEASURED

from ballscrew_tehl.applications.calibration.fit import torque_basis
from ballscrew_tehl.applications.calibration.measured import MapFilm
from ballscrew_tehl.applications.calibration.measured_screw import PACKAGED_TORQUE
from ballscrew_tehl.applications.calibration.measurements import Measurement
from ballscrew_tehl.friction.film_shear import double_nut_torque
from ballscrew_tehl.friction.sets import FITTED, friction_set_of_file, load_friction_sets
from ballscrew_tehl.nut_map.file import packaged_map
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.runtime.packed import MapError

MAP = str(packaged_map("published"))
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
    return MapFilm(load_map(None, GD4008), GD4008)


@pytest.fixture(scope="module")
def torques(films):
    """Torques of POINTS with the films of the packaged map and the parameters TRUTH, noise 0.5 %."""
    points = [
        Measurement(1e3 * preload, rpm * RPM, celsius + CELSIUS, 1.0, axial_load=axial)
        for preload, rpm, celsius, axial in POINTS
    ]
    noise = 1.0 + 0.005 * np.random.default_rng(8).normal(size=len(points))
    return torque_basis(GD4008, films, points).torque(TRUTH) * noise


@pytest.fixture
def measured(tmp_path, torques):
    """Writes the file; rows: number from 1 -> line to put instead."""

    def write(rows=None):
        lines = [
            f"{preload},{rpm},{celsius},{torque!r},{axial}"
            for (preload, rpm, celsius, axial), torque in zip(POINTS, torques.tolist(), strict=True)
        ]
        for number, line in (rows or {}).items():
            lines[number - 1] = line
        path = tmp_path / "measured.csv"
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
    entry = load_friction_sets()["three_parameter"]
    for m, torque in zip(points, basis.torque(entry.values), strict=True):
        direct = double_nut_torque(GD4008, entry, film, m.preload, m.speed, m.temperature, m.axial_load)
        assert torque == pytest.approx(direct.total, rel=1e-12)


def test_known_parameters_lie_in_their_limits_and_in_the_file_of_their_screw(capsys, measured, tmp_path):
    output, picture = tmp_path / "friction.toml", tmp_path / "p.png"
    found, _ = run(capsys, measured(), "--map", MAP, "--output", str(output), "--plot", str(picture))
    assert picture.read_bytes()[:4] == b"\x89PNG"
    entry, read = found["three_parameter"], friction_set_of_file(output, GD4008)
    assert len(entry["limits"]) == len(TRUTH)
    for (name, ends), value in zip(entry["limits"].items(), TRUTH, strict=True):
        assert ends["low"] < value < ends["high"], name
        assert ends["high"] - ends["low"] < 0.1 * value, name
        assert read.limits[name] == pytest.approx(ends, rel=1e-5)
    calibration = entry["calibration"]
    assert entry["not_identified"] == calibration["not_identified"] == {}
    assert calibration["dropped"] == calibration["outliers"] == []
    assert calibration["points"][9]["axial_load_n"] == 600.0
    assert "24 points of 24 rows" in entry["provenance"]
    assert tuple(load_map(None, GD4008, read).defaults) == (*read.values, 1.0)
    with pytest.raises(ValueError, match="law = three_parameter; allowed: mechanistic, as in the screw file"):
        friction_set_of_file(output, changed(GD4008, friction={"law": "mechanistic"}))
    with pytest.raises(MapError, match=r"the screw GD4008-3 \(000000000000\); expected GD4008-3 .*calibrate"):
        load_map(None, GD4008, replace(read, parameters_hash="000000000000"))


#: least squares on the directly solved films, printed by examples/paper/packaged_fit.py: values, half-widths of their
#: intervals, mean, left-out mean
DIRECT = (5.14442, 0.00574592, 2.3466e-08), (0.224, 3.71e-4, 8.50e-9), 0.0097, 0.0213


def test_the_tables_of_the_paper_give_the_packaged_set(capsys):
    """Films of the map instead of direct solves: values within a tenth of their intervals, errors within 0.1 %."""
    found, _ = run(capsys, str(PACKAGED_TORQUE), "--map", MAP)
    entry, (values, halves, mean, left_out) = found["three_parameter"], DIRECT
    for parameter, value, half in zip_longest(FITTED, values, halves, fillvalue=0.0):
        assert entry[parameter] == pytest.approx(value, abs=0.1 * half), parameter
        assert entry["intervals"].get(parameter, 0.0) == pytest.approx(half, rel=0.1), parameter
    assert entry["errors"]["mean"] == pytest.approx(mean, abs=1e-3)
    assert entry["errors"]["leave_one_out_mean"] == pytest.approx(left_out, abs=1e-3)
    unknown = entry["not_identified"]
    assert "95 % interval" in unknown["roughness_height"]
    # with a roughness height the first point lies at the limit: 4.4 of 4.1, 4.0 with earlier films
    outliers = entry["calibration"]["outliers"]
    assert outliers in ([[1, 7]], [])


def test_impossible_rows_stop_the_fit_unless_dropped(capsys, measured):
    bad = {3: "-1,30,20,0.3,0", 12: "3,30,300,1.0,0", 20: "5,100,20,1500,0"}
    path = measured(bad)
    line = refused(capsys, "calibrate", path, "--map", MAP)
    for part in ("3 impossible row(s)", "row 3 (line 4): preload = -1 kN", "row 20 (line 21): torque = 1500",
                 "--drop impossible"):  # fmt: skip
        assert part in line
    found, _ = run(capsys, path, "--map", MAP, "--drop", "impossible")
    entry = found["three_parameter"]
    assert [problem["row"] for problem in entry["calibration"]["dropped"]] == [*bad]
    used = [row for point in entry["calibration"]["points"] for row in point["rows"]]
    assert used == [row for row in range(1, 25) if row not in bad]
    assert "21 points of 24 rows, without rows 3, 12, 20" in entry["provenance"]

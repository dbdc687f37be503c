"""Tables of friction: the points of a list, and every format read back."""

import json
import re

import numpy as np
import pytest

from ballscrew_tehl.applications.export.formats import (
    csv_text,
    json_text,
    matlab_text,
    modelica_text,
    twincat_text,
)
from ballscrew_tehl.applications.export.friction_table import FrictionTable, read_identified
from ballscrew_tehl.applications.export.piecewise import few_points, weighted_points
from ballscrew_tehl.parameters.units import CELSIUS, RPM

SPEED = np.geomspace(1.0, 200.0, 7)
TORQUE = np.array([[[0.3 + 1e-4 * f + 0.05 * w**0.5 / (k - 250.0) for k in (293.15, 313.15)] for f in (1e3, 2e3)]
                   for w in SPEED])  # fmt: skip
TABLE = FrictionTable(SPEED, np.array([1e3, 2e3]), np.array([293.15, 313.15]), TORQUE, 0.9 * TORQUE, 1.1 * TORQUE,
                      {"screw": "mine"})  # fmt: skip


def numbers(line):
    return [float(word) for word in re.findall(r"[-+\d.e]+", line)]


def test_points_have_the_least_largest_error():
    x = np.linspace(0.0, 1.0, 401)
    parabola = few_points(x, x**2, 5)
    # four equal pieces: w^2/8 is the sagitta, half of it on each side
    assert parabola.error == pytest.approx(0.25**2 / 8.0, rel=0.03)
    bent = 1.0 - np.exp(-8.0 * x) + 0.3 * np.sin(6.0 * x)
    found = few_points(x, bent, 12)
    assert found.bound <= found.error <= 1.6 * found.bound
    assert found.error < 0.7 * np.max(np.abs(np.interp(x, x[::36], bent[::36]) - bent))
    assert few_points(x, 2.0 * x, 3).error == pytest.approx(0.0, abs=1e-12)


def test_points_do_not_follow_noisy_bins():
    rng, x = np.random.default_rng(3), np.linspace(0.1, 3.0, 40)
    errors = np.where(np.arange(40) % 10 < 8, 1e-3, 2e-2)
    found = weighted_points(x, 1.0 + 0.3 * x + errors * rng.standard_normal(40), errors, 19)
    assert len(found.x) < 8
    assert np.max(np.abs(np.interp(x, found.x, found.y) - 1.0 - 0.3 * x)) < 0.01 < 0.4 * found.error


def test_csv_and_json_are_read_back():
    lines = [line for line in csv_text(TABLE).splitlines() if not line.startswith("#")]
    rows = np.array([numbers(line) for line in lines[1:]])
    ahead = rows[(rows[:, 0] == 2e3) & (rows[:, 1] == 40.0) & (rows[:, 2] > 0.0)]
    assert ahead[:, 2] * RPM == pytest.approx(SPEED, rel=1e-6)
    assert ahead[:, 3] == pytest.approx(TORQUE[:, 1, 1], rel=1e-6)
    assert rows[:, 2:].sum(axis=0) == pytest.approx(0.0, abs=1e-9)
    assert np.allclose(json.loads(json_text(TABLE))["torque_nm"], TORQUE, rtol=1e-6)


def test_modelica_text_is_read_back():
    text = modelica_text(TABLE)
    assert text.startswith("#1\n")
    tables = re.findall(r"double \w+\((\d+),(\d+)\)\n((?:[^#d]+\n)+)", text)
    assert [(int(n), int(m)) for n, m, _ in tables] == [(2 * len(SPEED) + 1, 4)] * 4
    last = np.array([numbers(line) for line in tables[3][2].splitlines()])
    assert np.allclose(last[len(SPEED) + 1 :, 1], TORQUE[:, 1, 1], rtol=1e-6)
    assert np.allclose(last, -last[::-1], rtol=1e-9)
    assert np.all(np.diff(last[:, 0]) > 0.0)


def test_matlab_function_is_read_back():
    text = matlab_text(TABLE, "friction")
    assert text.startswith("function [torque, t] = friction(")
    given = {key: np.array(numbers(values)) for key, values in re.findall(r"t\.(\w+) = \[(.*?)\];", text)}
    assert np.allclose(given["torque"].reshape(TORQUE.shape, order="F"), TORQUE, rtol=1e-6)
    assert np.allclose(given["temperature"] + CELSIUS, TABLE.temperature)
    assert f"reshape(t.torque, [{len(SPEED)} 2 2])" in text


def test_compensation_list_is_read_back():
    points = few_points(SPEED, TORQUE[:, 0, 0], 5)
    text = twincat_text(TABLE, 8e-3, points, 1.0 / 0.8, 1e-3, "preload 1000 N")
    entries = dict(re.findall(r"^(frict_comp\S+)\s+(\S+)$", text, re.MULTILINE))
    assert (entries["frict_comp.mode"], entries["frict_comp.table_entries"]) == ("3", "6")
    speed, current = (
        np.array([float(entries[f"frict_comp.table[{i}].{key}"]) for i in range(6)]) for key in ("in", "out")
    )
    assert (speed[0], current[0]) == (0.0, 0.0)
    assert np.all(np.diff(speed) > 0.0)
    back = np.interp(SPEED * 8e3 / (2.0 * np.pi), speed, current) * 1e-3 * 0.8
    assert np.max(np.abs(back - TORQUE[:, 0, 0])) == pytest.approx(points.error, abs=1e-9)


def identified(path, rotary):
    """Friction that is 0.1 higher forwards, as identify writes it."""
    speed, effort = ("speed_rpm", "torque_{}nm") if rotary else ("velocity_m_s", "force_{}n")
    both = np.r_[-SPEED[::-1], SPEED]
    value = np.sign(both) * (0.5 + 0.01 * np.abs(both) ** 0.5) + 0.05
    keys = speed, *(effort.format(part) for part in ("", "low_", "high_", "error_")), "samples"
    columns = (
        both / (RPM if rotary else 1.0), value, value - 0.01, value + 0.01, *np.full((2, len(both)), 9.0),
    )  # fmt: skip
    rows = [dict(zip(keys, map(float, row), strict=True)) for row in zip(*columns, strict=True)]
    kind = "rotary" if rotary else "linear"
    path.write_text(json.dumps({"kind": kind, "friction": rows, "log": "now.csv"}))
    return both, value


@pytest.mark.parametrize("rotary", [True, False])
def test_friction_of_an_axis_is_read_back_in_each_direction(tmp_path, rotary):
    path = tmp_path / "identified.json"
    speed, value = identified(path, rotary)
    found = read_identified(path)
    one = RPM if rotary else 1.0
    lines = [line for line in csv_text(found.table).splitlines() if not line.startswith("#")]
    assert lines[0].startswith("speed [r/min],torque [N.m]," if rotary else "velocity [m/s],force [N],")
    rows = np.array([numbers(line) for line in lines[1:]])
    assert np.allclose(rows, np.column_stack([speed / one, value, value - 0.01, value + 0.01]), rtol=1e-6)
    torque = json.loads(json_text(found.table))["torque_nm" if rotary else "force_n"]
    assert np.allclose(torque, value, rtol=1e-6)
    text = modelica_text(found.table)
    table = np.array([numbers(line) for line in text.split("double friction_1(15,4)\n")[1].splitlines()])
    assert np.allclose(np.delete(table, 7, axis=0), rows * [one, 1.0, 1.0, 1.0], rtol=1e-6)
    assert np.all(table[7] == 0.0)
    arrays = re.findall(r"t\.(\w+) = \[(.*?)\];", matlab_text(found.table, "f"))
    assert np.allclose(np.transpose([numbers(row) for _, row in arrays]), table, rtol=1e-6)
    if rotary:
        both = found.between(2.0, 100.0).mean
        assert np.allclose(both.speed, SPEED[1:-1])
        assert np.allclose(both.mean, 0.5 + 0.01 * both.speed**0.5, rtol=1e-6)
        assert np.allclose(both.difference, 0.05, rtol=1e-6)
    else:
        with pytest.raises(ValueError, match="--lead-mm"):
            _ = found.mean

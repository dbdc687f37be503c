"""Coefficient and supply length from three and more torques: recovered, covered by limits, taken by map and torque."""

import json
from dataclasses import replace

import command_line
import numpy as np
import pytest
from law_contacts import VG100, ClosedContacts

from ballscrew_tehl.applications.calibration.fit import (
    MAX_INVERSE,
    OF_MECHANISTIC,
    fit_law,
    supply_limits,
    torque_basis,
)
from ballscrew_tehl.applications.calibration.measurements import Measurement
from ballscrew_tehl.friction.interval import OperatingPoint, torque_interval
from ballscrew_tehl.friction.sets import FITTED, friction_set_of_file, with_supply
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import PACKAGED_VG100, changed
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.refinement.contacts import contacts_of

K, LENGTH, PLACE = 0.009, 15.0, (1500.0, 310.0)
POINTS = [Measurement(PLACE[0], rpm * RPM, PLACE[1], 1.0) for rpm in (100.0, 400.0, 1000.0, 1700.0, 2500.0)]
BASIS = torque_basis(VG100, ClosedContacts(), POINTS)


def measured(basis, coefficient, inverse, noise=0.0):
    """The basis with torques of these numbers, with relative errors."""
    torques = replace(basis, names=OF_MECHANISTIC[1:]).torque((1.0, coefficient, inverse)) * (1.0 + noise)
    points = [replace(m, torque=float(t)) for m, t in zip(basis.measurements, torques, strict=True)]
    return replace(basis, measurements=tuple(points))


def fitted(basis):
    return fit_law(basis, [[i] for i in range(len(basis))], VG100, 0.0107)


def test_both_numbers_come_back_and_the_default_is_kept_where_it_agrees():
    basis, found = fitted(measured(BASIS, K, 1.0 / LENGTH))
    assert found.values[1:] == pytest.approx([K, 1.0 / LENGTH], rel=2e-3)
    assert found.leverage.sum() == pytest.approx(2.0)
    assert found.limits["supply_length"]["low"] < LENGTH < found.limits["supply_length"]["high"]
    basis, found = fitted(measured(BASIS, K, 1.0 / 6.0))
    assert (basis.names, found.values[1]) == (FITTED[1:2], pytest.approx(K, rel=1e-4))
    assert BASIS.subset([0, 1, 2]).rolling.shape[1] == 3
    for known in (changed(VG100, friction={"supply_length": 6.0}), POINTS[:3]), (VG100, POINTS[:2]):
        assert torque_basis(known[0], ClosedContacts(), known[1]).rolling is None


def test_a_point_left_out_has_the_error_of_a_new_fit_without_it():
    """With the choice of that fit, of level or level and shape."""
    whole = measured(BASIS, K, 1.0 / LENGTH, np.array([0.0, 0.04, -0.04, 0.03, -0.02]))
    chosen, found = fitted(whole)
    names = {chosen.names}
    for i, m in enumerate(whole.measurements):
        new, fit = fitted(whole.subset([k for k in range(len(whole)) if k != i]))
        expected = replace(whole, names=new.names).torque(fit.values)[i] / m.torque - 1.0
        assert found.left_out[i] == pytest.approx(expected, abs=1e-6)
        names.add(new.names)
    assert len(names) == 2


def test_limits_hold_95_percent_of_truths_after_any_choice():
    rng, held, chosen = np.random.default_rng(4), [], []
    for _ in range(200):
        k, inverse = rng.uniform(0.0041, 0.018), rng.uniform(0.0, MAX_INVERSE)
        limits = supply_limits(measured(BASIS, k, inverse, 0.03 * rng.normal(size=len(POINTS))))
        held.append(
            [
                low <= truth <= high
                for truth, (low, high) in ((k, limits.coefficient), (inverse, limits.inverse))
            ]
        )
        chosen.append(not limits.inverse[0] <= 1.0 / 6.0 <= limits.inverse[1])
    for rate in (np.mean(held, axis=0), np.mean(np.array(held)[chosen], axis=0)):
        assert np.all((rate > 0.89) & (rate < 0.99)), rate


def test_file_carries_the_length_to_torque_map_and_interval(capsys, tmp_path):
    basis = measured(torque_basis(VG100, contacts_of(VG100), POINTS), K, 1.0 / LENGTH)
    rows = [f"1500,{m.speed / RPM!r},{m.temperature - 273.15!r},{m.torque!r}" for m in basis.measurements]
    table, output = tmp_path / "t.csv", tmp_path / "f.toml"
    table.write_text("\n".join(["preload [N],speed [r/min],temperature [degC],torque [N.m]", *rows]) + "\n")
    arguments = "calibrate", str(table), "--screw", str(PACKAGED_VG100), "--output", str(output), "--json"
    code, out, err = command_line.run(capsys, *arguments)
    assert code == 0, err
    entry = friction_set_of_file(output, VG100)
    assert entry.supply_length == pytest.approx(LENGTH, rel=5e-3)
    assert "level and shape fitted" in json.loads(out)["mechanistic"]["calibration"]["notes"][-1]
    m = basis.measurements[-1]
    torque = load_map(None, VG100, entry).evaluate(m.preload, m.speed, m.temperature).friction_torque
    assert torque == pytest.approx(m.torque, rel=5e-3)
    place = OperatingPoint(m.preload, m.speed, m.temperature), contacts_of(VG100)
    found = torque_interval(with_supply(VG100, entry), *place, entry)
    bare = torque_interval(VG100, *place, replace(entry, supply_length=None, learned={}))
    assert found.torque == pytest.approx(m.torque, rel=1e-3)
    assert found.high / found.low < 1.1 < bare.high / bare.low
    with pytest.raises(ValueError, match=r"supply_length = 1\.0; allowed: >= 2"):
        replace(entry, supply_length=1.0)

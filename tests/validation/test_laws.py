"""Laws compared: rows, their fits against direct formulas, the twelfth point, parts of the torque and their picture."""

import numpy as np
import pytest
from law_contacts import VG100
from synthetic_map import closed_form

from ballscrew_tehl.calibration.measurements import packaged_measurements
from ballscrew_tehl.friction.baselines import jungnickel_torque, zhou_torque
from ballscrew_tehl.friction.sets import FrictionSet, load_friction_sets
from ballscrew_tehl.validation.laws import baseline_rows, law_points, set_row
from ballscrew_tehl.validation.shares import PARTS, Law, torque_parts

POINTS = packaged_measurements(303.0)
MEASURED = np.array([m.torque for m in POINTS])


def exact(preload, speed, temperature):
    """Every measured torque, 3.04 N.m elsewhere."""
    found = [m.torque for m in POINTS if (m.preload, m.speed) == (preload, speed)]
    return found[0] if found else 3.04


def test_row_of_a_set_has_the_figures_of_its_fit():
    entry = load_friction_sets()["rolling_frame", "mechanistic"]
    row = set_row(entry, exact)
    assert row.numbers == 1
    assert row.from_rest == {name: entry.leave_one_table_out[name]["mean"] for name in ("table2", "table4")}
    assert row.left_out == (entry.errors["leave_one_out_mean"], entry.errors["leave_one_out_max"])
    assert row.mean == 0.0
    by_hand = set_row(FrictionSet("by hand", "rolling_frame", "mechanistic", 1.0, 0.01), exact)
    assert by_hand.from_rest is by_hand.left_out is None


def test_closed_baseline_is_its_least_squares():
    J = np.array([jungnickel_torque(VG100, m.preload, m.speed, 303.0) for m in law_points()])
    F = np.array([m.preload for m in law_points()])
    one, two, zhou, nsk = baseline_rows(VG100)
    over = F[:-1] / MEASURED
    length = float(np.sum((1.0 - J[:-1] / MEASURED) * over) / np.sum(over**2))
    np.testing.assert_allclose(one.torques, J + length * F, rtol=1e-9)
    assert f"{1e3 * length:.3g} mm F" in one.name
    both, *_ = np.linalg.lstsq(np.stack([J[:-1] / MEASURED, over], axis=1), np.ones(11), rcond=None)
    np.testing.assert_allclose(two.torques, both[0] * J + both[1] * F, rtol=1e-9)
    assert (one.numbers, two.numbers, zhou.numbers, nsk.numbers) == (1, 2, 0, 0)
    # table 4 by the fit to table 2: points of table 4 only
    first = [i for i, m in enumerate(POINTS) if "table2" in m.tables]
    rest = [i for i in range(11) if i not in first]
    length = float(np.sum(((1.0 - J[:-1] / MEASURED) * over)[first]) / np.sum(over[first] ** 2))
    missed = np.abs((J[:-1] + length * F[:-1]) / MEASURED - 1.0)[rest]
    assert one.from_rest["table4"] == pytest.approx(float(missed.mean()), rel=1e-9)
    assert zhou.torques[3] == float(zhou_torque(VG100.screw, 4000.0))


def test_parts_add_up_to_the_torque():
    entry = FrictionSet("mechanistic", "rolling_frame", "mechanistic", 1.0, 0.0048)
    law = Law(VG100, entry, closed_form("mechanistic"), 303.0)
    preload, speed = np.array([[600.0], [3000.0]]), np.array([5.0, 50.0, 200.0])
    parts = torque_parts(law, preload, speed)
    assert parts.shape == (len(PARTS), 2, 3)
    whole = law.nut_map.evaluate(preload, speed, 303.0, 0.0, 1.0, 0.0048)
    np.testing.assert_allclose(parts.sum(axis=0), whole.friction_torque, rtol=1e-12)
    np.testing.assert_allclose(parts[list(PARTS).index("rolling")], whole.viscous_torque, rtol=1e-12)

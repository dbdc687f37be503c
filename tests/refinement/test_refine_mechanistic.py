"""Refinement of the mechanistic law on the packaged map: the rolling part follows direct solves, the rest the map."""

import pytest

from ballscrew_tehl.friction.mechanistic import nut_powers
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_VG100
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.refinement.direct import DirectContacts
from ballscrew_tehl.refinement.refine import Refinement, map_parameters

SCREW = load_parameters(PACKAGED_VG100)


def test_parameters_of_the_header_give_the_same_supply():
    found = map_parameters(load_map(None, SCREW).header)
    assert found.friction.replenishment_constant == SCREW.friction.replenishment_constant
    assert found.friction.set == "mechanistic"
    assert found.lubricant.eyring_stress == SCREW.lubricant.eyring_stress


@pytest.mark.slow
def test_refined_rolling_torque_is_that_of_direct_solves():
    nut_map = load_map(None, SCREW)
    at = 1700.0, 700.0 * RPM, 311.0
    refined = Refinement(nut_map, tolerance=1e-4)
    plain, found = nut_map.evaluate(*at), refined.evaluate(*at)
    assert len(refined) == 2
    loads = nut_loads(SCREW.screw, at[0], SCREW.screw.loaded_ball_count)
    direct = nut_powers(SCREW, loads, at[1], at[2], DirectContacts(SCREW))
    rolling = 2.0 * (direct.rolling_screw + direct.rolling_nut)
    assert found.viscous_torque == pytest.approx(rolling, rel=1e-4)
    assert plain.viscous_torque == pytest.approx(rolling, rel=0.02)
    for name in ("hysteresis_torque", "sliding_torque", "contact_pressure_max"):
        assert getattr(found, name) == getattr(plain, name)

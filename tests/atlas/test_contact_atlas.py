"""The atlas file and its range: refused if damaged, ratios kept beyond it, screws that it does not hold named."""

import json

import numpy as np
import pytest
from synthetic_atlas import atlas, atlas_bytes, contacts, interpolated, nothing_missed, rolling
from synthetic_contacts import LAW

from ballscrew_tehl.atlas.ball_contacts import BallContacts
from ballscrew_tehl.atlas.contact_atlas import (
    ATLAS_FORMAT,
    OF_THE_SCREW,
    OutsideAtlasError,
    content_hash,
    load_atlas,
)
from ballscrew_tehl.atlas.groups import MAX_HEATING_N, closed_forms, unmodelled
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.runtime.packed import MapError


def test_contacts_of_a_screw_are_predicted():
    """Of a screw that is none of the atlas, at 300 points by 300 contacts of random screws: 0.15 % off at most."""
    rng, balls = np.random.default_rng(1), BallContacts(LAW, None, atlas())
    at = (
        np.exp(rng.uniform(0.0, 5.0, 300)), np.exp(rng.uniform(0.0, 6.0, 300)), rng.uniform(285.0, 350.0, 300),
    )  # fmt: skip
    forms = closed_forms(balls.contacts("nut", *at))
    assert balls.inside("nut", *at).all()
    assert nothing_missed(balls.at("nut", *at), unmodelled(interpolated(forms.groups), forms.values), 0.005)


def test_damaged_and_other_files_are_refused_in_one_line(tmp_path):
    path, whole = tmp_path / "atlas.npz", atlas_bytes()
    path.write_bytes(whole)
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    header = json.loads(str(arrays.pop("header")))

    def refused(**entries):
        np.savez(path, header=np.array(json.dumps(header | entries)), **arrays)
        with pytest.raises(MapError) as caught:
            load_atlas.__wrapped__(path)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    assert f"atlas format {ATLAS_FORMAT - 1}; expected {ATLAS_FORMAT}" in refused(format=ATLAS_FORMAT - 1)
    assert content_hash(arrays) == header["hash"]
    arrays["weights"] = arrays["weights"] * (1.0 + 1e-15)
    assert "the file was damaged" in refused()
    for part in (b"", b"text", whole[: len(whole) // 2], whole[:-1]):
        path.write_bytes(part)
        with pytest.raises(MapError, match="not a readable atlas"):
            load_atlas.__wrapped__(path)
    with pytest.raises(MapError, match=r"not a readable atlas \(FileNotFoundError"):
        load_atlas.__wrapped__(tmp_path / "none.npz")


@pytest.mark.parametrize("name", ["M", "L", "N", "pressure"])
def test_beyond_a_group_the_ratio_to_the_closed_forms_is_that_at_its_end(name):
    """N is extrapolated to MAX_HEATING_N."""
    forms = closed_forms(rolling(contacts()[40]))
    low, high = (float(getattr(end, name)) for end in atlas().ends)
    inside = (True, name != "N")
    high = MAX_HEATING_N if name == "N" else high
    for end, beyond, known in zip((low, high), (0.03 * low, 30.0 * high), inside, strict=True):
        last, far = (
            forms._replace(groups=forms.groups._replace(**{name: np.array([v])})) for v in (end, beyond)
        )
        assert atlas().inside(last.groups).all() == known
        assert not atlas().inside(far.groups).any()
        there = atlas().interpolated(far)
        for quantity, value in atlas().interpolated(last).items():
            np.testing.assert_array_equal(there[quantity], value)


def refusal(parameters):
    with pytest.raises(OutsideAtlasError) as caught:
        BallContacts(parameters, None, atlas())
    text = str(caught.value)
    assert "\n" not in text
    assert text.endswith("remedy: ballscrew torque --direct, which solves the contacts")
    return text


def test_screws_and_oils_outside_are_named_with_value_and_range():
    BallContacts(LAW, None, atlas())
    modulus = changed(LAW, screw={"youngs_modulus": 320e9})
    assert "E' = 351.6 GPa; the atlas of contacts holds 200 to 300 GPa" in refusal(modulus)
    for name, value, words in (
        ("pressure_law", "barus", "= barus; "), ("density_law", "incompressible", "= incompressible; "),
        ("roelands_pressure", 1e8, "= 100 MPa; the atlas of contacts holds 186.3 to 205.9 MPa"),
        ("viscosity_law", "constant", "= constant; the atlas of contacts holds oils that thin with heat"),
    ):  # fmt: skip
        oil = LAW.lubricant.model_copy(update={name: value})
        assert f"{name} {words}" in refusal(LAW.model_copy(update={"lubricant": oil}))
    ball = LAW.screw.ball_diameter
    wide = {"screw_raceway_radius": 1.5 * ball, "nut_raceway_radius": 1.5 * ball}
    cold = {"density": 7800.0, "specific_heat": 460.0, "thermal_conductivity": 5.0}
    for name, change, meaning in (
        ("radius_ratio", {"screw": wide}, "groove over the ball"),
        ("z", {"lubricant": {"z_roelands": 0.95}}, "pressure exponent"),
        ("wall", {"solid": cold}, "effusivity"),
    ):
        assert name in OF_THE_SCREW
        text, (low, high) = refusal(changed(LAW, **change)), (getattr(end, name) for end in atlas().ends)
        assert text.startswith(f"{name} = ")
        assert meaning in text
        assert f"the atlas of contacts holds {low:.4g} to {high:.4g}" in text
        found = float(text.split()[2])
        assert found < low or found > high

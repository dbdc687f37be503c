"""The interval of the mechanistic torque in descriptions and on the documentation page."""

from xml.etree import ElementTree

import pytest
import synthetic_map

from ballscrew_fmu.description.fmi2 import model_description
from ballscrew_fmu.description.native import native_description
from ballscrew_fmu.models import MODELS
from ballscrew_fmu.pages.friction import validity
from ballscrew_fmu.pages.page import friction_provenance
from ballscrew_fmu.variables.friction import band_text
from ballscrew_tehl.runtime.packed import MECHANISTIC

HEADER = synthetic_map.make_map(law=MECHANISTIC).header
BAND = {
    "preload": 2000.0,
    "speed": 18.138,
    "temperature": 303.15,
    "low": 0.7249,
    "high": 1.6386,
    "fitted": False,
}
TEXT = "torque 0.72 to 1.64 times the computed one (about 80 %) at 2000 N, 173 r/min, 30 degC, not fitted to this screw"


def described(header, model):
    texts = [model_description(header, "guid", "tool", model)]
    texts += [native_description(header, version, "token", "tool", ["all.c"], model) for version in (2, 3)]
    return [ElementTree.fromstring(text).get("description") for text in texts]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_every_description_states_the_band(model):
    for description in described({**HEADER, "mechanistic_interval": BAND}, model):
        assert description.endswith(f", map {HEADER['content_hash'][:12]}; {TEXT}")
    for description in described(HEADER, model):
        assert description.endswith(f", map {HEADER['content_hash'][:12]}")


def test_text_says_whether_fitted():
    fitted = band_text({"mechanistic_interval": BAND | {"fitted": True}})
    assert fitted == TEXT.replace("not fitted", "fitted")
    assert band_text({}) == ""


def test_page_states_the_band_and_what_it_omits():
    (page,) = validity({**HEADER, "mechanistic_interval": BAND}).content
    assert TEXT in page
    assert "viscosity and supply of the oil, nor seals" in page
    (page,) = validity(HEADER).content
    assert "times the computed one" not in page


def test_page_says_where_the_numbers_were_measured():
    friction = {
        "set": "mechanistic", "loss": "", "provenance": "carried over", "errors": {}, "limits": {},
        "not_identified": None, "carried_over": "the numbers of friction set mechanistic were measured on A, not on B",
    }  # fmt: skip
    page = "".join(friction_provenance({**HEADER, "friction": friction}))
    assert "The numbers of friction set mechanistic were measured on A, not on B." in page
    page = "".join(friction_provenance({**HEADER, "friction": friction | {"carried_over": ""}}))
    assert "measured on" not in page

"""An FMU whose friction numbers are those of another screw says so once, at instantiation; another one says nothing."""

import subprocess

import native_library
import pytest
from native_library import WARNING, NativeInstance
from native_model import compiler, write_sources
from synthetic_map import make_map

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.models import FRICTION
from ballscrew_fmu.native_fmu.compile import COMPILER_OPTIONS, WARNINGS
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_fmu.variables.friction import origin_text
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import MECHANISTIC, sealed

#: a name that C and printf would misread
SAYS = 'the numbers of friction set mechanistic were measured on A, not on "B" 50 % \\ ??/ \u00e4'


def map_of(carried_over):
    made = make_map(law=MECHANISTIC)
    friction = {
        "set": "mechanistic", "loss": "", "provenance": "of A", "errors": {}, "limits": {}, "not_identified": None,
        "carried_over": carried_over, "catalogue": {"preload": 2000.0, "torque": 0.5048},
    }  # fmt: skip
    band = {"preload": 2000.0, "speed": 10.0, "temperature": 303.15, "low": 0.7, "high": 1.6, "fitted": False}
    header = {**made.header, "friction": friction, "mechanistic_interval": band}
    return NutMap(sealed(header, made.arrays), made.arrays)


def test_text_has_catalogue_torque_and_interval():
    text = origin_text(map_of(SAYS).header)
    assert text.startswith(SAYS + "; catalogue torque 0.505 N.m at 2000 N; torque 0.70 to 1.60 times")
    assert text.endswith("not fitted to this screw")
    assert origin_text(map_of("").header) == origin_text(make_map().header) == ""


@pytest.mark.parametrize("carried_over", [SAYS, ""])
def test_python_fmu_says_it_once(tmp_path, carried_over):
    nut_map = map_of(carried_over)
    fmu = build_fmu(nut_map, tmp_path / "BallScrewFriction.fmu").path
    with FmuInstance(fmu) as one:
        for _ in range(3):
            one.step(speed=30.0)
        # printf's % is doubled: the message of FMI 2 is a format
        said = [text.replace("%%", "%") for status, text in one.messages if status == WARNING]
    assert said == ([origin_text(nut_map.header)] if carried_over else [])


@pytest.mark.parametrize("carried_over", [SAYS, ""])
@pytest.mark.parametrize("version", [2, 3])
def test_native_fmu_says_it_once(tmp_path, monkeypatch, version, carried_over):
    nut_map = map_of(carried_over)
    write_sources(tmp_path, nut_map, version, FRICTION)
    library = tmp_path / "library.so"
    units = sorted(file.name for file in tmp_path.glob("*.c"))
    command = [
        *compiler(),
        *COMPILER_OPTIONS,
        *WARNINGS,
        "-shared",
        "-fPIC",
        "-o",
        str(library),
        *units,
        "-lm",
    ]
    subprocess.run(command, cwd=tmp_path, check=True, timeout=300)
    monkeypatch.setattr(native_library, "compiled", lambda version, **others: library)
    with NativeInstance(version) as one:
        assert one.handle
        said = [(message.status, message.text) for message in one.opening if message.status == WARNING]
    # printf's % is doubled in FMI 2, whose message is a format
    text = origin_text(nut_map.header)
    assert [(status, one.replace("%%", "%")) for status, one in said] == (
        [(WARNING, text)] if carried_over else []
    )
    with NativeInstance(version, logging=False) as quiet:
        assert quiet.opening == quiet.messages == []

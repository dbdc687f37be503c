"""FMUs for Python hosts: values, start, bad input, damaged states, the monitor, the entry library.

What it has in common with the native FMUs: tests/fmu/native_fmu.
"""

import math
import shutil
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi1 import FMICallException
from fmu_checks import exports, fmi_functions
from native_library import DISCARD, ERROR, ME, WARNING, NativeInstance
from processes import RUNS_HERE, output
from synthetic_map import make_map

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.models import MONITOR
from ballscrew_fmu.python_fmu.package import PLATFORMS, build_fmu
from ballscrew_fmu.variables.friction import origin_text
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import Law, sealed

pytestmark = pytest.mark.skipif(not RUNS_HERE, reason="opens the library for x86_64 Linux")


def go_on(instance, speeds=(0.002, 0.02, -0.01, 1.0, 0.0)):
    return [(instance.step(1e-3, speed=speed), instance.outputs()) for speed in speeds]


def test_a_bad_start_value_can_be_replaced_also_from_a_saved_state(unpacked):
    """The elements then slide in the direction of the speed, as if the good value had been there at once."""
    with FmuInstance(unpacked, presliding_side=-1.1) as one:
        assert one.step() is False
        assert one.messages[-1] == (DISCARD, "presliding_side = -1.1; needs a finite number >= -1")
    for restored in (False, True):
        with FmuInstance(unpacked, speed=math.nan) as one, FmuInstance(unpacked, speed=0.01) as good:
            assert one.messages == [(DISCARD, "speed = nan; needs a finite number")]
            assert one.step() is False
            if restored:
                content = one.slave.serializeFMUstate(one.slave.getFMUstate())
                assert one.step(speed=-2.0)
                one.slave.setFMUstate(one.slave.deSerializeFMUstate(content))
                one.time = 0.0
                assert math.isnan(one.get("speed"))
            assert go_on(one, (0.01, 0.01)) == go_on(good, (0.01, 0.01))


def test_an_exception_is_logged_and_has_no_effect(unpacked):
    """An exception of the Python code would kill the process when the instance is freed (pythonfmu 0.7)."""
    with FmuInstance(unpacked) as one:
        one.step(speed=30.0)
        before = one.outputs()
        package = next(Path(unpacked).glob("resources/_ballscrew_*")).name  # others may be loaded as well
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(f"{package}.python_fmu_slave.friction_step", None)
            assert one.step(presliding_stiffness=1.0) is False
        assert one.messages[-1][1].startswith("step failed: TypeError")
        assert one.outputs() == before
        assert one.step() is True


def refused(call, *arguments):
    with pytest.raises(FMICallException) as error:
        call(*arguments)
    assert error.value.status == ERROR


def test_a_state_of_another_map_or_damaged_is_refused_and_the_steps_after_it_too(unpacked, tmp_path):
    other = build_fmu(make_map(viscous_scale=2.0), tmp_path / "other.fmu").path
    with FmuInstance(unpacked) as one, FmuInstance(other) as two:
        good = two.slave.getFMUstate()
        content = two.slave.serializeFMUstate(good)
        another = two.slave.deSerializeFMUstate(one.slave.serializeFMUstate(one.slave.getFMUstate()))
        for call, given, reason in (
            (two.slave.setFMUstate, another, "of another version or map"),
            *((two.slave.deSerializeFMUstate, text, "damaged")
              for text in (b"\xff{", b"", b"[1]", content[:-1], content[:-20] + b"1" + content[-19:])),
        ):  # fmt: skip
            refused(call, given)
            assert two.messages[-1][0] == ERROR
            assert reason in two.messages[-1][1]
            refused(two.step)
            assert "called in Error" in two.messages[-1][1]
            two.slave.setFMUstate(good)
            assert two.step(speed=1.0) is True


def test_friction_numbers_of_another_screw_are_reported_once(tmp_path):
    """The text of the header; here and in a native FMU, whose compiler and printf would misread it."""
    made = make_map(law=Law.MECHANISTIC)
    says = 'measured on A, not on "B" 50 % \\ ??/ \u00e4'
    catalogue = {"preload": 2000.0, "torque": 0.5048}
    friction = {"set": "mechanistic", "loss": "", "provenance": "of A", "errors": {}, "limits": {}}
    friction |= {"not_identified": None, "carried_over": says, "catalogue": catalogue}
    band = {"preload": 2000.0, "speed": 10.0, "temperature": 303.15, "low": 0.7, "high": 1.6, "fitted": False}
    band |= {"force_low": 0.8, "force_high": 1.5}
    header = {**made.header, "friction": friction, "mechanistic_interval": band}
    text = origin_text(header)
    assert text.startswith(says + "; catalogue torque 0.505 N.m at 2000 N; torque 0.70 to 1.60 times")
    nut_map = NutMap(sealed(header, made.arrays), made.arrays)
    with FmuInstance(build_fmu(nut_map, tmp_path / "python.fmu").path) as one:
        go_on(one)
        # % is doubled in FMI 2, whose message is a format of printf
        assert [found.replace("%%", "%") for status, found in one.messages if status == WARNING] == [text]
    for version in (2, 3):
        with NativeInstance(version, nut_map=nut_map) as native:
            native.start().go()
            found = [message.text for message in native.opening if message.status == WARNING]
            assert [line.replace("%%", "%") for line in found] == [text]


def test_seals_are_a_part_of_the_torque_and_not_of_the_preload(unpacked, folder_of):
    with FmuInstance(unpacked, seal_torque=0.3) as one, FmuInstance(unpacked) as bare:
        for preload, speed in ((2000.0, 30.0), (0.0, 30.0), (2000.0, -30.0)):
            for each in (one, bare):
                assert each.step(1.0, preload=preload, speed=speed)  # all elements slide
            names = ("friction_torque", "friction_torque_nut_a", "friction_torque_nut_b", "power_loss")
            more = [a - b for a, b in zip(one.get(*names), bare.get(*names), strict=True)]
            seal = math.copysign(0.3, speed)
            assert more[:3] == pytest.approx([seal, 0.5 * seal, 0.5 * seal], rel=1e-9)
            assert more[3] == pytest.approx(9.0, rel=1e-3)  # some of it is stored
            assert one.get("sliding_torque") == pytest.approx(bare.get("sliding_torque"), rel=1e-12)
        with FmuInstance(folder_of(MONITOR, 2), seal_torque=0.3) as inverse:
            inverse.step(torque=one.get("friction_torque"), speed=speed)
            assert inverse.get("preload", "in_range") == [pytest.approx(2000.0, rel=1e-6), True]
        assert one.step(1.0, preload=0.0, speed=0.0)  # they hold the axis without preload
        assert one.get("friction_torque") == pytest.approx(-0.3, rel=1e-9)


FOLDER, _, SUFFIX = PLATFORMS["x86_64-linux"]
EXCHANGE = ("Mode", "DiscreteStates", "IntegratorStep", "SetTime", "States", "GetDerivatives", "Indicators")


@pytest.fixture(scope="module")
def library(unpacked):
    return Path(unpacked, "binaries", FOLDER, f"BallScrewFriction{SUFFIX}")


REFUSED = [
    ({"token": "{another}"}, "GUID is {another}, the resources have "),
    ({"token": None}, "GUID is NULL, the resources have "),
    ({"kind": ME}, "co-simulation only"),
    ({"name": b" "}, "instance name is empty"),
    ({"resources": None}, "location of the resources is NULL"),
    ({"resources": "file:///no/such/folder"}, "no resources of this FMU in file:///no/such/folder"),
    ({"resources": "file:///with%2520in/it"}, "without %%20"),  # pythonfmu would read it as a blank
    ({"resources": "file:///latin%FC"}, "UTF-8"),
    ({"resources": "file:///" + "x" * 5000}, "no resources of this FMU in "),
]


def test_what_would_end_the_host_or_belongs_to_another_fmu_is_refused(opened, library):
    for arguments, reason in REFUSED:
        one = opened("python", **arguments)
        assert one.handle is None
        ((status, category, text),) = one.messages
        assert (status, category) == (ERROR, "logStatusError")
        assert reason in text
        assert opened("python", functions="NULL", **arguments).handle is None
    needed = {name for name in fmi_functions(2) if not name.endswith(EXCHANGE)}
    assert len(needed) > 25
    assert exports(library, sorted(needed)) == []


def test_a_step_before_the_end_of_the_initialization_is_discarded(opened):
    with opened("python") as one:
        one.initialize()
        assert one.step(0.0, 1e-3) == DISCARD
        assert "exitInitializationMode" in one.last


NATIVE_HOST = """
#include <dlfcn.h>
#include <stdio.h>

static void logger(void *e, const char *n, int s, const char *c, const char *message, ...)
{ (void)e, (void)n, (void)s, (void)c, (void)puts(message); }

int main(int count, char **arguments)
{
    void *(*make)(const char *, int, const char *, const char *, const void *, int, int);
    void (*functions[5])() = {(void (*)())logger};
    *(void **)&make = dlsym(dlopen(arguments[1], RTLD_NOW), "fmi2Instantiate");
    return make("one", 1, arguments[2], arguments[3], functions, 0, 1) == NULL ? 0 : count;
}
"""


def test_in_a_host_without_python_it_says_so(library, unpacked, tmp_path):
    compiler = shutil.which("cc") or pytest.skip("no C compiler of the system")
    (tmp_path / "host.c").write_text(NATIVE_HOST)
    output("host.c", "-o", "host", "-ldl", program=compiler, folder=tmp_path)
    token, resources = fmpy.read_model_description(unpacked).guid, Path(unpacked, "resources").as_uri()
    printed = output(library, token, resources, program=str(tmp_path / "host"))
    assert "needs a host that runs Python" in printed

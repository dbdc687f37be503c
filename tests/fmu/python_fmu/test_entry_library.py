"""The entry library of the FMU for Python hosts: what it refuses before pythonfmu is called, and what it passes on."""

import shutil
import sys
import zipfile
from ctypes import byref, c_char_p, c_double, c_int, c_size_t
from pathlib import Path

import fmpy
import pytest
from fmu_checks import exports, fmi_functions
from native_library import CS, DISCARD, ERROR, ME, OK, NativeInstance, doubles
from paths import writable
from processes import output

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.python_fmu.entry_library import PLATFORMS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="calls the library for Linux"),
]
FOLDER, _, SUFFIX = PLATFORMS["x86_64-linux"]
EXCHANGE = ("Mode", "DiscreteStates", "IntegratorStep", "SetTime", "States", "GetDerivatives", "Indicators")


@pytest.fixture(scope="module")
def library(unpacked):
    return Path(unpacked, "binaries", FOLDER, f"BallScrewFriction{SUFFIX}")


@pytest.fixture(scope="module")
def identity(unpacked):
    return {
        "token": fmpy.read_model_description(unpacked).guid, "resources": Path(unpacked, "resources").as_uri(),
    }  # fmt: skip


@pytest.fixture
def entry(library, identity):
    """Function: an instance by direct calls of fmi2Instantiate and the others."""
    return lambda kind=CS, **options: NativeInstance(2, kind, library=library, **identity | options)


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


def test_what_would_end_the_host_or_belongs_to_another_fmu_is_refused(entry, library):
    for arguments, reason in REFUSED:
        one = entry(**arguments)
        assert one.handle is None
        ((status, category, text),) = one.messages
        assert (status, category) == (ERROR, "logStatusError")
        assert reason in text
        assert entry(functions="NULL", **arguments).handle is None
    needed = {name for name in fmi_functions(2) if not name.endswith(EXCHANGE)}
    assert len(needed) > 25
    assert exports(library, sorted(needed)) == []


def test_without_a_logger_it_runs_and_after_a_discarded_step_the_statuses_are_those_of_the_native_fmu(entry):
    with entry(functions="NULL").start() as silent:
        assert silent.step(0.0, -1.0) == DISCARD  # logged to nobody
    with entry().start() as one:
        assert one.step(0.0, 0.5) == OK
        assert one.set(preload=float("nan")) == OK
        assert one.step(0.5, 0.5) == DISCARD
        assert one.messages[-1][:2] == (DISCARD, "logStatusDiscard")
        flag, time = c_int(7), c_double(0.0)
        assert one.call("GetBooleanStatus", 3, byref(flag)) == DISCARD
        assert one.call("GetRealStatus", 2, byref(time)) == OK
        assert time.value == 0.5


ILLEGAL = {  # call and variables or references; None: an array that is NULL
    ("GetReal", "speed", 0): "no Real variable has value reference 0",
    ("GetReal", "speed", 999): "no Real variable has value reference 999",
    ("GetReal", None): "an array is a NULL pointer",
    **{(f"{way}{kind}", "speed", 1): f"{kind} variable has value reference 2"
       for kind in ("Integer", "String", "Boolean") for way in ("Get", "Set")},
    ("SetReal", "speed", "friction_torque"): "friction_torque cannot be set in Step Mode",
    ("SetReal", "speed", "presliding_side"): "presliding_side cannot be set in Step Mode",
    ("SetReal", "speed", "in_range"): "no settable Real variable has",
    ("SetReal", "speed", 0): "no settable Real variable has value reference 0",
    ("SetBoolean", "presliding", "in_range"): "in_range cannot be set in Step Mode",
}  # fmt: skip


def test_illegal_values_are_errors_with_the_messages_of_the_native_fmu(entry):
    """Nothing of such a call is stored; after it the instance has to be reset."""
    with entry() as one:
        for (name, *references), reason in ILLEGAL.items():
            for category, count in ((b"logAll", 1), (b"logStatusFatal", 0)):
                assert one.call("SetDebugLogging", 1, c_size_t(1), (c_char_p * 1)(category)) == OK
                one.start(presliding_side=0.25)
                one.messages.clear()
                vr = None if references == [None] else one.vr(*references)
                assert one.call(name, vr, c_size_t(len(references)), doubles(3.0, 3.0)) == ERROR, (
                    name,
                    references,
                )
                assert [m[:2] for m in one.messages] == [(ERROR, "logStatusError")] * count
                assert all(reason in m[2] and m[2].endswith(f"(fmi2{name})") for m in one.messages)
                assert one.get("speed", "presliding_side") == [0.0, 0.25]
                assert one.step(0.0, 0.5) == ERROR
                assert one.call("Reset") == OK
        for unknown in (b"logEverything", None):
            assert one.call("SetDebugLogging", 1, c_size_t(1), (c_char_p * 1)(unknown)) == ERROR


def test_it_runs_below_any_path(fmu, tmp_path):
    for name in ("a blank", "hash#", "percent%41", "plus+", "umlaut \u00fc", "is \u4e2d\u6587", "q?&;'"):
        name = writable(name)
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(tmp_path / name)
        with FmuInstance(tmp_path / name) as one:
            assert one.step(speed=30.0)
            assert one.get("friction_torque") > 0.0
            one.slave.setFMUstate(one.slave.getFMUstate())
            assert one.step(speed=1e6)
            assert [text.split()[0] for _, text in one.messages] == ["speed"]


NATIVE_HOST = """
#include <dlfcn.h>
#include <stdio.h>
#include "fmi2FunctionTypes.h"

static void logger(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String message, ...)
{ (void)e, (void)n, (void)s, (void)c, (void)puts(message); }

int main(int count, char **arguments)
{
    const fmi2CallbackFunctions functions = {logger, NULL, NULL, NULL, NULL};
    fmi2InstantiateTYPE *make;
    *(void **)&make = dlsym(dlopen(arguments[1], RTLD_NOW), "fmi2Instantiate");
    return make("one", fmi2CoSimulation, arguments[2], arguments[3], &functions, 0, 1) == NULL ? 0 : count;
}
"""


def test_in_a_host_without_python_it_says_so(library, identity, tmp_path):
    compiler = shutil.which("cc") or pytest.skip("no C compiler of the system")
    (tmp_path / "host.c").write_text(NATIVE_HOST)
    headers = Path(fmpy.__file__).parent / "c-code"
    output(f"-I{headers}", "host.c", "-o", "host", "-ldl", program=compiler, folder=tmp_path)
    printed = output(library, identity["token"], identity["resources"], program=str(tmp_path / "host"))
    assert "needs a host that runs Python" in printed

"""The entry library of the FMU for Python hosts: what it refuses before pythonfmu is called, and what it passes on."""

import ctypes
import shutil
import subprocess
import sys
import zipfile
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_void_p
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmu_checks import exports, fmi_functions
from paths import writable

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.python_fmu.entry_library import PLATFORMS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="calls the library for Linux"),
]
FOLDER, _, SUFFIX = PLATFORMS["x86_64-linux"]
CO_SIMULATION, MODEL_EXCHANGE = 1, 0
EXCHANGE = ("Mode", "DiscreteStates", "IntegratorStep", "SetTime", "States", "GetDerivatives", "Indicators")


class Called:
    """fmi2Instantiate of an unpacked FMU, called directly.

    Attributes   handle : None if it was refused;  messages : (status, category, text)
    """

    def __init__(self, folder, name=b"one", kind=CO_SIMULATION, guid=None, resources=None, functions=True):
        guid = fmpy.read_model_description(folder).guid.encode() if guid is None else guid
        resources = Path(folder, "resources").as_uri().encode() if resources is None else resources
        self.messages = []
        self.library = ctypes.CDLL(str(unpacked_library(folder)))
        self._functions = fmi2CallbackFunctions()
        self._functions.logger = fmi2CallbackLoggerTYPE(
            lambda _, name, status, category, text: self.messages.append((status, category, text.decode()))
        )
        address = byref(self._functions) if functions else None
        make, self.free = self.library.fmi2Instantiate, self.library.fmi2FreeInstance
        make.restype = c_void_p
        make.argtypes = [c_char_p, c_int, c_char_p, c_char_p, c_void_p, c_int, c_int]
        self.free.argtypes = [c_void_p]
        self.handle = make(name, kind, guid, resources, address, 0, 1)

    def call(self, name, *arguments):
        return getattr(self.library, f"fmi2{name}")(c_void_p(self.handle), *arguments)


def unpacked_library(folder):
    return Path(folder, "binaries", FOLDER, f"BallScrewFriction{SUFFIX}")


REFUSED = [
    ({"guid": b"{another}"}, "GUID is {another}, the resources have "),
    ({"kind": MODEL_EXCHANGE}, "co-simulation only"),
    ({"name": b" "}, "instance name is empty"),
    ({"resources": b"file:///no/such/folder"}, "no resources of this FMU in file:///no/such/folder"),
    ({"resources": b"file:///with%2520in/it"}, "without %%20"),  # pythonfmu would read it as a blank
    ({"resources": b"file:///latin%FC"}, "UTF-8"),
    ({"resources": b"file:///" + b"x" * 5000}, "no resources of this FMU in "),
]


def test_what_would_end_the_host_or_belongs_to_another_fmu_is_refused(unpacked):
    for arguments, reason in REFUSED:
        one = Called(unpacked, **arguments)
        assert one.handle is None
        ((status, category, text),) = one.messages
        assert (status, category) == (3, b"logStatusError")
        assert reason in text
        assert Called(unpacked, functions=False, **arguments).handle is None
    library = one.library
    library.fmi2Instantiate.argtypes = None
    assert library.fmi2Instantiate(b"one", CO_SIMULATION, None, None, None, 0, 0) is None
    needed = {name for name in fmi_functions(2) if not name.endswith(EXCHANGE)}
    assert len(needed) > 25
    assert exports(unpacked_library(unpacked), sorted(needed)) == []


def initialized(one):
    assert one.call("SetupExperiment", 0, c_double(0.0), c_double(0.0), 0, c_double(0.0)) == 0
    assert one.call("EnterInitializationMode") == one.call("ExitInitializationMode") == 0
    return one


def test_without_a_logger_it_runs_and_after_a_discarded_step_the_statuses_are_those_of_the_native_fmu(
    unpacked,
):
    silent = initialized(Called(unpacked, functions=False))
    assert silent.call("DoStep", c_double(0.0), c_double(-1.0), 1) == 2  # logged to nobody
    silent.free(silent.handle)
    one = initialized(Called(unpacked))
    assert one.call("DoStep", c_double(0.0), c_double(0.5), 1) == 0
    value, reference = (c_double * 1)(float("nan")), (ctypes.c_uint * 1)(1)
    assert one.call("SetReal", reference, c_size_t(1), value) == 0
    assert one.call("DoStep", c_double(0.5), c_double(0.5), 1) == 2
    assert one.messages[-1][:2] == (2, b"logStatusDiscard")
    flag, time = c_int(7), c_double(0.0)
    assert one.call("GetBooleanStatus", 3, byref(flag)) == 2
    assert one.call("GetRealStatus", 2, byref(time)) == 0
    assert time.value == 0.5
    one.free(one.handle)


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


def test_illegal_values_are_errors_with_the_messages_of_the_native_fmu(unpacked):
    """Nothing of such a call is stored; after it the instance has to be reset."""
    place = {v.name: v.valueReference for v in fmpy.read_model_description(unpacked).modelVariables}
    one = Called(unpacked)

    def call(name, references, *values):
        given = None if references == [None] else [place.get(r, r) for r in references]
        vr = None if given is None else (ctypes.c_uint * len(given))(*given)
        room = (c_double * 2)(*values)
        return one.call(name, vr, c_size_t(len(references)), room), list(room)

    for (name, *references), reason in ILLEGAL.items():
        for category, count in ((b"logAll", 1), (b"logStatusFatal", 0)):
            assert call("SetReal", ["presliding_side"], 0.25)[0] == 0
            assert one.call("SetDebugLogging", 1, c_size_t(1), (c_char_p * 1)(category)) == 0
            initialized(one)
            one.messages.clear()
            assert call(name, references, 3.0, 3.0)[0] == 3, (name, references)
            assert [m[:2] for m in one.messages] == [(3, b"logStatusError")] * count
            assert all(reason in m[2] and m[2].endswith(f"(fmi2{name})") for m in one.messages)
            assert call("GetReal", ["speed", "presliding_side"]) == (0, [0.0, 0.25])
            assert one.call("DoStep", c_double(0.0), c_double(0.5), 1) == 3
            assert one.call("Reset") == 0
    for unknown in (b"logEverything", None):
        assert one.call("SetDebugLogging", 1, c_size_t(1), (c_char_p * 1)(unknown)) == 3
    one.free(one.handle)


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


def test_in_a_host_without_python_it_says_so(unpacked, tmp_path):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler of the system")
    (tmp_path / "host.c").write_text(NATIVE_HOST)
    headers = Path(fmpy.__file__).parent / "c-code"
    subprocess.run([compiler, f"-I{headers}", "host.c", "-o", "host", "-ldl"], cwd=tmp_path, check=True)
    guid, resources = fmpy.read_model_description(unpacked).guid, Path(unpacked, "resources").as_uri()
    command = [str(tmp_path / "host"), str(unpacked_library(unpacked)), guid, resources]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert "needs a host that runs Python" in run.stdout

"""The entry library of the FMU for Python hosts: what it refuses before pythonfmu is called, and what it passes on."""

import math
import shutil
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmu_checks import exports, fmi_functions
from native_library import DISCARD, ERROR, ME, OK
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


def test_impossible_steps_are_discarded_also_without_a_logger(opened):
    with opened("python", functions="NULL").start() as silent, opened("python") as one:
        for size in (-1e-3, math.nan, math.inf):
            assert silent.step(0.0, size) == DISCARD  # logged to nobody
        assert silent.step(0.0, 1e-3) == OK
        one.initialize()
        assert one.step(0.0, 1e-3) == DISCARD
        assert "exitInitializationMode" in one.last


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


def test_in_a_host_without_python_it_says_so(library, unpacked, tmp_path):
    compiler = shutil.which("cc") or pytest.skip("no C compiler of the system")
    (tmp_path / "host.c").write_text(NATIVE_HOST)
    headers = Path(fmpy.__file__).parent / "c-code"
    output(f"-I{headers}", "host.c", "-o", "host", "-ldl", program=compiler, folder=tmp_path)
    token, resources = fmpy.read_model_description(unpacked).guid, Path(unpacked, "resources").as_uri()
    printed = output(library, token, resources, program=str(tmp_path / "host"))
    assert "needs a host that runs Python" in printed

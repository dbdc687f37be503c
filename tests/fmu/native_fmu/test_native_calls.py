"""The native FMUs call by call: legal order, refusals, values, messages; FMI 2.0 and 3.0, both kinds."""

import ctypes
import math
import re
from ctypes import byref, c_double, c_size_t, c_uint, c_void_p
from pathlib import Path
from urllib.parse import quote

import fmpy
import pytest
from native_library import (
    CS,
    DISCARD,
    ERROR,
    INPUTS,
    ME,
    NUT_MAP,
    OK,
    OUTPUTS,
    REAL_PARAMETERS,
    REALS,
    REFERENCES,
    TIME_REFERENCE,
    TOKEN,
    WARNING,
    NativeInstance,
    compiled,
    counting_functions,
    doubles,
    references,
)

BAD = (math.nan, math.inf, -math.inf, 1e30, -1e31)
STATES = {CS: "instx", ME: "inectx"}
both_versions = pytest.mark.parametrize("version", [2, 3])
both_kinds = pytest.mark.parametrize("kind", [CS, ME])

# States in which a call is legal: i instantiated, n initialization mode, s step mode, e event mode,
# c continuous-time mode, t terminated, x error. Read from the standards, independently of the tables in C. The only
# addition is SetTime in event mode.
LEGAL = {
    2: {
        "SetDebugLogging": "inscetx", "SetupExperiment": "i", "EnterInitializationMode": "i",
        "ExitInitializationMode": "n", "Terminate": "sec", "Reset": "inscetx", "GetReal": "nsectx",
        "GetInteger": "nsectx", "GetBoolean": "nsectx", "GetString": "nsectx", "SetReal": "insec",
        "SetInteger": "inse", "SetBoolean": "inse", "SetString": "inse", "GetFMUstate": "insectx",
        "SetFMUstate": "insectx", "FreeFMUstate": "insectx", "SerializedFMUstateSize": "insectx",
        "SerializeFMUstate": "insectx", "DeSerializeFMUstate": "insectx",
        "GetDirectionalDerivative": "nsectx",
        "EnterEventMode": "ec", "NewDiscreteStates": "e", "EnterContinuousTimeMode": "e",
        "CompletedIntegratorStep": "c", "SetTime": "ec", "SetContinuousStates": "c",
        "GetEventIndicators": "nectx", "GetContinuousStates": "nectx", "GetDerivatives": "nectx",
        "GetNominalsOfContinuousStates": "inectx",
        "SetRealInputDerivatives": "ins", "GetRealOutputDerivatives": "stx", "DoStep": "s", "CancelStep": "",
        "GetStatus": "st", "GetRealStatus": "st", "GetIntegerStatus": "st", "GetBooleanStatus": "st",
        "GetStringStatus": "st",
    },
    3: {
        "SetDebugLogging": "insectx", "EnterInitializationMode": "i", "ExitInitializationMode": "n",
        "EnterEventMode": "c", "Terminate": "sec", "Reset": "insectx",
        **{f"Get{t}": "nsectx" for t in ("Float32", "Float64", "Int8", "UInt8", "Int16", "UInt16", "Int32",
                                         "UInt32", "Int64", "UInt64", "Boolean", "String", "Binary")},
        **{f"Set{t}": "insec" for t in ("Float32", "Float64")},
        **{f"Set{t}": "inse" for t in ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64",
                                       "UInt64", "Boolean", "String", "Binary")},
        **{name: "ne" for name in ("GetClock", "SetClock", "GetIntervalDecimal", "GetIntervalFraction",
                                   "GetShiftDecimal", "GetShiftFraction", "SetIntervalDecimal",
                                   "SetIntervalFraction", "SetShiftDecimal", "SetShiftFraction",
                                   "EvaluateDiscreteStates")},
        "GetNumberOfVariableDependencies": "insectx", "GetVariableDependencies": "insectx",
        "GetFMUState": "insectx", "SetFMUState": "insectx", "FreeFMUState": "insectx",
        "SerializedFMUStateSize": "insectx", "SerializeFMUState": "insectx", "DeserializeFMUState": "insectx",
        "GetDirectionalDerivative": "nsectx", "GetAdjointDerivative": "nsectx",
        "EnterConfigurationMode": "ise", "ExitConfigurationMode": "", "UpdateDiscreteStates": "e",
        "EnterContinuousTimeMode": "e", "CompletedIntegratorStep": "c", "SetTime": "ec",
        "SetContinuousStates": "c", "GetContinuousStateDerivatives": "nectx", "GetEventIndicators": "nectx",
        "GetContinuousStates": "nectx", "GetNominalsOfContinuousStates": "nectx",
        "GetNumberOfEventIndicators": "inectx", "GetNumberOfContinuousStates": "inectx",
        "EnterStepMode": "e", "GetOutputDerivatives": "stx", "DoStep": "s", "ActivateModelPartition": "",
    },
}  # fmt: skip
CS_ONLY = {
    "SetRealInputDerivatives", "GetRealOutputDerivatives", "DoStep", "GetStatus", "GetRealStatus",
    "GetIntegerStatus", "GetBooleanStatus", "GetStringStatus", "GetOutputDerivatives", "EnterStepMode",
}  # fmt: skip
ME_ONLY = {
    "EnterEventMode", "NewDiscreteStates", "UpdateDiscreteStates", "EnterContinuousTimeMode",
    "CompletedIntegratorStep", "SetTime", "SetContinuousStates", "GetEventIndicators", "GetContinuousStates",
    "GetDerivatives", "GetContinuousStateDerivatives", "GetNominalsOfContinuousStates",
    "GetNumberOfEventIndicators", "GetNumberOfContinuousStates",
}  # fmt: skip
# legal calls that the FMU does not support
UNSUPPORTED = {
    "SetRealInputDerivatives": ERROR, "GetRealOutputDerivatives": ERROR, "GetOutputDerivatives": ERROR,
    "GetNumberOfVariableDependencies": ERROR, "GetVariableDependencies": ERROR,
    "EnterConfigurationMode": ERROR, "EvaluateDiscreteStates": ERROR, "GetStatus": DISCARD,
    "GetIntegerStatus": DISCARD, "GetBooleanStatus": DISCARD, "GetStringStatus": DISCARD,
}  # fmt: skip
NO_ARGUMENTS = {
    "EnterInitializationMode", "ExitInitializationMode", "Terminate", "Reset", "EnterEventMode",
    "EnterContinuousTimeMode", "CancelStep", "EnterConfigurationMode", "ExitConfigurationMode",
    "EnterStepMode", "EvaluateDiscreteStates",
}  # fmt: skip


# co-simulation with event mode: states, and the calls that differ
STATES_WITH_EVENTS = "inestx"
LEGAL_WITH_EVENTS = {"EnterEventMode": "s", "UpdateDiscreteStates": "e"}


def is_legal(version, name, kind, state, event_mode=False):
    if event_mode and name in LEGAL_WITH_EVENTS:
        return state in LEGAL_WITH_EVENTS[name]
    other = CS_ONLY if kind == ME else ME_ONLY
    return state in LEGAL[version][name] and name not in other


def arguments(one, name):
    """Valid arguments of a call, without the instance."""
    room, zero = ctypes.create_string_buffer(4096), c_size_t(0)
    experiment = (0, c_double(0.0), c_double(0.0), 0, c_double(0.0))
    if name == "SetupExperiment" or (name == "EnterInitializationMode" and one.version == 3):
        return experiment
    if name in NO_ARGUMENTS:
        return ()
    if name == "SetDebugLogging":
        return 1, zero, None
    if name in ("GetReal", "SetReal"):
        return references("speed"), c_size_t(1), doubles(3.0)
    if name in ("GetFloat64", "SetFloat64"):
        return references("speed"), c_size_t(1), doubles(3.0), c_size_t(1)
    if name == "GetBoolean":
        return references("in_range"), c_size_t(1), room, c_size_t(1)
    if name in ("SetContinuousStates", "GetContinuousStates", "GetDerivatives",
                "GetContinuousStateDerivatives", "GetNominalsOfContinuousStates"):  # fmt: skip
        return doubles(0.0), c_size_t(1)
    if name == "GetEventIndicators":
        return doubles(0.0, 0.0), c_size_t(2)
    if name == "SetTime":
        return (c_double(0.0),)
    if name == "DoStep":
        return c_double(0.0), c_double(1e-3), 0, None, None, None, None
    if name.endswith("Status"):
        return 2, room  # last successful time
    if name in ("GetDirectionalDerivative", "GetAdjointDerivative"):
        unknowns, knowns = references("friction_torque"), references("speed")
        if one.version == 2:
            return unknowns, c_size_t(1), knowns, c_size_t(1), doubles(1.0), doubles(0.0)
        one_each = c_size_t(1)
        return unknowns, one_each, knowns, one_each, doubles(1.0), one_each, doubles(0.0), one_each
    if name.startswith("GetFMU") or name.startswith("FreeFMU"):
        return (byref(c_void_p()),)
    if name.startswith("SetFMU"):
        return (one.save(),)
    if name.startswith("SerializedFMU"):
        return one.save(), byref(c_size_t())
    if name.startswith("SerializeFMU"):
        state = one.save()
        size = len(one.serialize(state))
        return state, ctypes.create_string_buffer(size), c_size_t(size)
    if name.lower().startswith("deserialize"):
        content = one.serialize(one.save())
        return content, c_size_t(len(content)), byref(c_void_p())
    if name in ("NewDiscreteStates", "CompletedIntegratorStep", "UpdateDiscreteStates"):
        first = (room,) if name == "NewDiscreteStates" else (0, None, None)
        return (None,) * 6 if name == "UpdateDiscreteStates" else first
    if name.startswith("GetNumberOf") and name != "GetNumberOfVariableDependencies":
        return (byref(c_size_t()),)
    if name == "GetNumberOfVariableDependencies":
        return c_uint(4), byref(c_size_t())
    if name == "GetVariableDependencies":
        return c_uint(4), None, None, None, None, zero
    if name == "ActivateModelPartition":
        return c_uint(0), c_double(0.0)
    return None, zero, None, zero, zero  # no variable of this type


@pytest.mark.slow
@pytest.mark.parametrize(("version", "name"), [(v, name) for v in LEGAL for name in LEGAL[v]])
def test_a_call_is_accepted_where_it_is_legal_and_refused_elsewhere(version, name):
    for kind, states in STATES.items():
        for state in states:
            with NativeInstance(version, kind) as one:
                check_call(one, name, state, is_legal(version, name, kind, state))


@pytest.mark.slow
@pytest.mark.parametrize("name", LEGAL[3])
def test_the_same_in_co_simulation_with_event_mode(name):
    for state in STATES_WITH_EVENTS:
        with NativeInstance(3, CS, event_mode=True) as one:
            check_call(one, name, state, is_legal(3, name, CS, state, event_mode=True))


def check_call(one, name, state, legal):
    given = arguments(one, name)
    one.go_to(state)
    status = one.call(name, *given)
    if legal:
        assert status == UNSUPPORTED.get(name, OK), (state, one.last)
        assert not one.last.startswith("called in"), state
        return
    assert status == ERROR, state
    message = one.messages[-1]
    assert (message.status, message.category) == (ERROR, "logStatusError")
    assert re.fullmatch(rf"called in .+; legal in .+ \(fmi{one.version}{name}\)", message.text)
    # after an error: start again, restore or free
    assert one.set(speed=1.0) == ERROR
    assert one.call("Reset") == OK
    assert one.initialize() == OK


def test_the_message_names_state_and_legal_states():
    with NativeInstance(2) as one:
        one.step(0.0, 1e-3)
        assert one.last == "called in Instantiated; legal in Step Mode (fmi2DoStep)"
    with NativeInstance(3, ME).start() as one:
        one.step(0.0, 1e-3)
        assert one.last == "called in model exchange; legal in co-simulation only (fmi3DoStep)"
        one.call("Terminate")
        assert one.last.startswith("called in Error; legal in Event Mode, Continuous-Time Mode, Step Mode")


@both_versions
def test_the_library_shows_all_functions_of_the_standard_and_nothing_else(version):
    header = Path(fmpy.__file__).parent / "c-code" / f"fmi{version}Functions.h"
    expected = set(
        re.findall(rf"^\s*FMI{version}_Export fmi{version}\w+TYPE\s+(\w+);", header.read_text(), re.M)
    )
    assert len(expected) == {2: 44, 3: 75}[version]
    apart = {"GetVersion", "GetTypesPlatform", "FreeInstance", "Instantiate", "InstantiateCoSimulation",
             "InstantiateModelExchange", "InstantiateScheduledExecution"}  # fmt: skip
    assert expected - {f"fmi{version}{name}" for name in apart} == {
        f"fmi{version}{name}" for name in LEGAL[version]
    }
    library = ctypes.CDLL(str(compiled(version)))
    assert all(hasattr(library, name) for name in expected)
    assert not any(hasattr(library, name) for name in ("instance_begin", "model_step", "map_read"))
    get_version = library[f"fmi{version}GetVersion"]
    get_version.restype = ctypes.c_char_p
    assert get_version() == {2: b"2.0", 3: b"3.0"}[version]


def test_types_platform():
    library = ctypes.CDLL(str(compiled(2)))
    library.fmi2GetTypesPlatform.restype = ctypes.c_char_p
    assert library.fmi2GetTypesPlatform() == b"default"


@both_versions
def test_no_call_crashes_without_an_instance(version):
    with NativeInstance(version) as one:
        given = {name: arguments(one, name) for name in LEGAL[version]}
    assert one.handle is None
    for name in LEGAL[version]:
        assert one.call(name, *given[name]) == ERROR
    one.call("FreeInstance")  # does nothing


# instantiation


@both_versions
@both_kinds
@pytest.mark.parametrize("logging", [True, False])
@pytest.mark.parametrize(
    ("wrong", "found"),
    [
        ({"token": "{other}"}, rf"\{{other\}}.*{re.escape(TOKEN)}"),
        ({"token": None}, "NULL.*" + re.escape(TOKEN)),
        ({"name": None}, "name is empty"),
        ({"name": b""}, "name is empty"),
        ({"name": b" \t"}, "name is empty"),
        ({"resources": None}, "resources"),
        ({"resources": "/no/such/folder"}, "/no/such/folder/nut_map.bin"),
    ],
)
def test_refused_instances_report_the_reason(version, kind, logging, wrong, found):
    with NativeInstance(version, kind, logging=logging, **wrong) as one:
        assert one.handle is None
        assert [m.status for m in one.messages] == [ERROR]
        assert re.search(found, one.last)
    with NativeInstance(version, kind, logger=False, **wrong) as one:
        assert one.handle is None


@both_versions
def test_unknown_kinds(version):
    with NativeInstance(version, "scheduled execution") as one:
        assert one.handle is None
        assert "co-simulation or model exchange" in one.last


@pytest.mark.parametrize("reference", [REAL_PARAMETERS[0], "presliding_deflection", "time", 0, 4000])
def test_an_intermediate_variable_is_an_input_or_an_output(reference):
    wanted = REFERENCES.get(reference, TIME_REFERENCE if reference == "time" else reference)
    with NativeInstance(3, CS, intermediate=(REFERENCES["speed"], wanted)) as one:
        assert one.handle is None
        assert "required intermediate variable 1 is not an input or an output" in one.last
    with NativeInstance(3, CS, intermediate=(REFERENCES["speed"], REFERENCES["in_range"])) as one:
        assert one.handle is not None


@both_kinds
def test_fmi2_without_callbacks(kind):
    with NativeInstance(2, kind, functions="NULL").start() as one:
        assert one.set_raw(references(999), doubles(1.0)) == ERROR


def test_a_damaged_map_is_refused(tmp_path):
    content = (compiled(2).parent / "nut_map.bin").read_bytes()
    (tmp_path / "nut_map.bin").write_bytes(content[:-8])
    with NativeInstance(2, resources=tmp_path.as_uri()) as one:
        assert one.handle is None
        assert "truncated" in one.last


FOLDER_NAME = "with space, plus+, hash#, percent%41, \u00fc and (brackets)"


@pytest.mark.parametrize("form", ["file://{}", "file:{}", "file://localhost{}", "FILE://{}", "file://{}/"])
def test_resource_uris(tmp_path, form):
    folder = tmp_path / FOLDER_NAME
    folder.mkdir()
    (folder / "nut_map.bin").write_bytes((compiled(2).parent / "nut_map.bin").read_bytes())
    with NativeInstance(2, resources=form.format(quote(str(folder)))) as one:
        assert one.handle, one.last
        one.start()


@both_versions
@pytest.mark.parametrize("ending", ["", "/"])
def test_resource_paths(tmp_path, version, ending):
    folder = tmp_path / FOLDER_NAME
    folder.mkdir()
    (folder / "nut_map.bin").write_bytes((compiled(2).parent / "nut_map.bin").read_bytes())
    with NativeInstance(version, resources=f"{folder}{ending}") as one:
        assert one.handle, one.last


def test_memory_comes_from_the_importer_and_never_in_a_step():
    functions, given, taken = counting_functions()
    with NativeInstance(2, functions=functions).start(speed=1.0, presliding_stiffness=400.0) as one:
        before = len(given)
        for _ in range(3):
            one.go(axial_load=500.0)
        one.get(*REALS)
        assert len(given) == before > 0
        one.save()  # freed by freeInstance
        one.forget(one.save())
        assert len(given) == before + 2
    assert sorted(given) == sorted(taken)


# co-simulation: outputs and steps


def expected_torque(preload=2000.0, speed=0.0, temperature=303.15, axial_load=0.0):
    state = NUT_MAP.evaluate(preload, speed, temperature, axial_load)
    return math.copysign(state.viscous_torque + state.coulomb_torque, speed)


@both_versions
def test_outputs_are_those_of_the_last_step(version):
    with NativeInstance(version).start(speed=10.0) as one:
        assert one.get("friction_torque")[0] == pytest.approx(expected_torque(speed=10.0), rel=1e-12)
        one.set(speed=-30.0, preload=900.0)  # in a step, farther than the bristle turns over
        assert one.get("friction_torque")[0] == pytest.approx(expected_torque(speed=10.0), rel=1e-12)
        assert one.get("speed") == [-30.0]
        one.go(0.1)
        new = expected_torque(speed=-30.0, preload=900.0)
        assert one.get("friction_torque")[0] == pytest.approx(new, rel=1e-12)
        one.set(speed=5.0)
        one.call("Terminate")
        assert one.get("friction_torque")[0] == pytest.approx(new, rel=1e-12)


@both_versions
@both_kinds
def test_outputs_follow_inputs_in_initialization_mode(version, kind):
    with NativeInstance(version, kind) as one:
        one.initialize()
        for speed in (10.0, 20.0):
            one.set(speed=speed)
            assert one.get("friction_torque")[0] == pytest.approx(expected_torque(speed=speed), rel=1e-12)
        one.set(speed=7.0)  # latched when the mode is left, without a get
        one.call("ExitInitializationMode")
        assert one.get("friction_torque")[0] == pytest.approx(expected_torque(speed=7.0), rel=1e-12)


def test_fmi2_step_of_zero_length_is_a_latch():
    with NativeInstance(2).start(presliding_stiffness=400.0) as one:
        one.go(1e-3, speed=0.01)
        wound = one.get("presliding_deflection")
        assert one.set(speed=-20.0) == OK
        assert one.step(one.time, 0.0) == OK
        assert one.get("presliding_deflection") == wound
        assert one.get("viscous_torque")[0] < 0.0
        time = doubles(0.0)
        assert one.call("GetRealStatus", 2, time) == OK
        assert time[0] == 1e-3


@both_versions
@pytest.mark.parametrize("size", [-1e-9, math.nan, math.inf, 1e30])
def test_impossible_step_sizes(version, size):
    with NativeInstance(version).start() as one:
        assert one.step(0.0, size) == ERROR
        assert "step size" in one.last
        assert one.step(0.0, 1e-3) == ERROR  # the state is error


def test_fmi3_refuses_steps_of_zero_length():
    with NativeInstance(3).start() as one:
        assert one.step(0.0, 0.0) == ERROR


@both_versions
@pytest.mark.parametrize("time", [math.nan, math.inf])
def test_impossible_communication_points(version, time):
    with NativeInstance(version).start() as one:
        assert one.step(time, 1e-3) == ERROR


@both_versions
def test_communication_points_may_drift_and_jump(version):
    with NativeInstance(version).start() as one:
        time = 0.0
        for _ in range(1000):  # the rounding of the importer
            assert one.step(time, 1e-6) == OK
            time += 1e-6 * (1.0 + 1e-9)
        assert one.messages == []
        for jump in (5.0, 1.0):
            assert one.step(jump, 1e-3) == OK
        reached = doubles(0.0)
        if version == 2:
            assert one.call("GetRealStatus", 2, reached) == OK
        else:
            assert one.get_raw(references(TIME_REFERENCE), reached) == OK
        assert reached[0] == 1.001  # the time given by the importer is used
        texts = [m.text for m in one.messages]
        assert len(texts) == (0 if version == 2 else 1)
        assert all(text.startswith("communication point = 5 s") for text in texts)


@both_versions
def test_no_step_beyond_the_stop_time(version):
    with NativeInstance(version).start(stop=0.3) as one:
        time = 0.0
        for _ in range(3):
            assert one.step(time, 0.1) == OK  # the last one ends beyond 0.3 by rounding
            time += 0.1
        assert one.step(time, 0.1) == ERROR
        assert "stop time 0.3 s" in one.last


@both_versions
@pytest.mark.parametrize(("start", "stop"), [(math.nan, None), (math.inf, None), (1.0, 0.5), (0.0, math.nan)])
def test_impossible_experiments(version, start, stop):
    with NativeInstance(version) as one:
        assert one.initialize(start, stop) == ERROR


def test_output_arguments_of_an_fmi3_step():
    with NativeInstance(3).start(start=2.0) as one:
        flags = [ctypes.c_bool(True) for _ in range(3)]
        last = c_double()
        status = one.call("DoStep", c_double(2.0), c_double(0.25), True, *map(byref, flags), byref(last))
        assert (status, last.value, [f.value for f in flags]) == (OK, 2.25, [False] * 3)
        assert one.get(TIME_REFERENCE) == [2.25]  # time


@both_versions
def test_time_is_a_variable_in_fmi3_only(version):
    time = references(TIME_REFERENCE)
    with NativeInstance(version, ME).start(start=1.5) as one:
        value = doubles(0.0)
        if version == 2:
            assert one.get_raw(time, value) == ERROR
            return
        assert one.get(TIME_REFERENCE) == [1.5]
        one.call("EnterContinuousTimeMode")
        assert one.call("SetTime", c_double(1.75)) == OK
        assert one.get(TIME_REFERENCE) == [1.75]
        assert one.call("SetTime", c_double(math.nan)) == DISCARD
        assert one.get(TIME_REFERENCE) == [1.75]
        assert one.set_raw(time, value) == ERROR


# values that cannot be used


@both_versions
@pytest.mark.parametrize("name", [*INPUTS, *REAL_PARAMETERS])
@pytest.mark.parametrize("bad", BAD)
def test_a_bad_value_in_co_simulation_discards_the_step(version, name, bad):
    with NativeInstance(version).start(speed=3.0) as one, NativeInstance(version).start(speed=3.0) as other:
        one.go(), other.go()
        good = one.get(name)[0]
        assert one.set(**{name: bad}) == OK
        before = one.outputs()
        for _ in range(2):
            assert one.step(one.time, 1e-3) == DISCARD
            assert one.messages[-1][:2] == (DISCARD, "logStatusDiscard")
            assert one.last.startswith(f"{name} = ")
            assert re.search(r"needs a finite number >= \S+ and < 1e\+30", one.last)
            assert one.outputs() == before  # those of the last good step
        assert one.go(**{name: good}) == other.go()  # nothing else has changed


@both_versions
def test_the_first_of_several_bad_values_is_named_until_all_are_replaced(version):
    with NativeInstance(version).start() as one:
        assert one.set(preload=math.nan, temperature=math.inf, roughness_height=-1.0) == OK
        for name, good in (("preload", 900.0), ("temperature", 300.0), ("roughness_height", 1e-7)):
            assert one.step(0.0, 1e-3) == DISCARD
            assert one.last.startswith(f"{name} = ")
            assert one.set(**{name: good}) == OK
        one.go()


@both_versions
def test_a_bad_start_value_leaves_the_outputs_of_the_start_values(version):
    with NativeInstance(version) as one, NativeInstance(version) as other:
        assert one.set(speed=math.nan) == OK
        assert one.initialize() == other.initialize() == OK
        assert one.outputs() == other.outputs()
        assert one.call("ExitInitializationMode") == OK
        assert one.step(0.0, 1e-3) == DISCARD
        assert [m.text.split()[0] for m in one.messages] == ["speed", "speed"]


@both_versions
@pytest.mark.parametrize("restored", [False, True])
def test_after_a_bad_start_value_the_bristle_begins_with_the_good_one(version, restored):
    """It slides in the direction of the speed, as if the good value had been there at once; from a state too."""
    with (
        NativeInstance(version).start(speed=math.nan) as one,
        NativeInstance(version).start(speed=0.01) as good,
    ):
        assert one.step(0.0, 1e-3) == DISCARD
        if restored:
            content = one.serialize(one.save())
            one.go(speed=-2.0)
            _, state = one.deserialize(content)
            assert one.restore(state) == OK
            one.time = 0.0
        for _ in range(3):
            assert one.go(speed=0.01) == good.go()
        coulomb = sum(one.get("hysteresis_torque", "sliding_torque"))
        assert coulomb * 0.01 <= one.get("power_loss")[0]  # it slides: nothing is stored


@both_versions
def test_a_discarded_step_tells_the_last_good_time(version):
    with NativeInstance(version).start(start=1.0) as one:
        one.go(0.5, speed=2.0)
        one.set(speed=math.nan)
        time, flags = doubles(0.0), [ctypes.c_bool(True) for _ in range(3)]
        if version == 2:
            assert one.step(1.5, 0.5) == DISCARD
            assert one.call("GetRealStatus", 2, time) == OK
            flag = (ctypes.c_int * 1)()
            assert one.call("GetBooleanStatus", 3, flag) == DISCARD  # so that FMPy does not go on silently
        else:
            last = c_double()
            status = one.call("DoStep", c_double(1.5), c_double(0.5), True, *map(byref, flags), byref(last))
            assert (status, [f.value for f in flags]) == (DISCARD, [False] * 3)
            time[0] = last.value
        assert time[0] == 1.5


@both_versions
def test_a_state_with_a_bad_value_can_be_saved(version):
    with NativeInstance(version).start() as one, NativeInstance(version) as other:
        one.go(speed=7.0)
        one.set(preload=math.nan)
        _, state = other.deserialize(one.serialize(one.save()))
        assert other.restore(state) == OK
        assert other.step(one.time, 1e-3) == DISCARD
        other.time = one.time
        assert other.go(preload=1500.0) == one.go(preload=1500.0)


@both_versions
@pytest.mark.parametrize("name", [*INPUTS, *REAL_PARAMETERS])
@pytest.mark.parametrize("bad", BAD)
def test_a_bad_value_in_model_exchange_is_discarded_and_nothing_is_stored(version, name, bad):
    first = "temperature" if name != "temperature" else "speed"
    with NativeInstance(version, ME).start(speed=3.0) as one:
        before = one.get(*REALS)
        assert one.set(**{first: 300.0, name: bad}) == DISCARD
        assert one.last.startswith(f"{name} = ")
        assert one.messages[-1][:2] == (DISCARD, "logStatusDiscard")
        assert one.get(*REALS) == before
        assert one.set(speed=4.0) == OK


@both_versions
@pytest.mark.parametrize("name", REAL_PARAMETERS)
def test_negative_parameters(version, name):
    with NativeInstance(version).start() as one:
        least = -1.0 if name == "presliding_side" else 0.0
        assert one.set(**{name: least - 1e-9}) == OK
        assert one.step(0.0, 1e-3) == DISCARD
        assert one.last.startswith(f"{name} = {least - 1e-9:.6g}") or least
        assert f"needs a finite number >= {least:g} " in one.last
    with NativeInstance(version).start() as one:
        assert one.set(**{name: 0.0}) == OK


@both_versions
@both_kinds
@pytest.mark.parametrize("name", [*OUTPUTS, "in_range", "presliding_deflection_rate", "slip_indicator", 999])
def test_only_inputs_and_parameters_can_be_set(version, kind, name):
    with NativeInstance(version, kind).start(speed=3.0) as one:
        assert one.set_raw(references("speed", name), doubles(5.0, 1.0)) == ERROR
        assert one.get("speed") == [3.0]


@both_versions
@both_kinds
def test_variables_of_another_type_are_refused(version, kind):
    with NativeInstance(version, kind).start() as one:
        assert one.set_raw(references("in_range"), doubles(0.0)) == ERROR
        assert str(REFERENCES["in_range"]) in one.last
    room = ctypes.create_string_buffer(64)
    for reference in ("speed", "in_range"):
        types = ("Integer", "String") if version == 2 else ("Float32", "Int32", "UInt64", "String")
        for type_ in types:
            for way in ("Get", "Set"):
                with NativeInstance(version, kind).start() as one:
                    assert (
                        one.call(f"{way}{type_}", references(reference), c_size_t(1), room, c_size_t(1))
                        == ERROR
                    )
                    assert type_ in one.last
    for way, reference in (("Get", "speed"), ("Set", "speed"), ("Set", "in_range")):
        with NativeInstance(version, kind).start() as one:
            assert one.call(f"{way}Boolean", references(reference), c_size_t(1), room, c_size_t(1)) == ERROR


@both_versions
@both_kinds
def test_a_boolean_answers_a_read_as_real_as_0_or_1(version, kind):
    """pathsim-fmi and CoFMPy read all outputs as Real."""
    for speed, inside in ((3.0, 1.0), (1e6, 0.0)):
        with NativeInstance(version, kind).start(speed=speed) as one:
            if kind == CS:
                one.go()
            assert one.get("in_range", "speed") == [inside, speed]
            assert one.in_range() is bool(inside)
            assert one.get("in_range") == [inside]  # in a call of its own, too


@both_versions
@both_kinds
def test_there_is_no_value_reference_0(version, kind):
    for way in ("get_raw", "set_raw"):
        with NativeInstance(version, kind).start() as one:
            assert getattr(one, way)(references(0), doubles(1.0)) == ERROR
            assert "value reference 0" in one.last
    with NativeInstance(version, kind).start() as one:
        assert one.call("GetBoolean", references(0), c_size_t(1), doubles(0.0), c_size_t(1)) == ERROR


@both_versions
@both_kinds
def test_null_arrays_and_no_variables(version, kind):
    names = (
        ("GetReal", "SetReal", "GetBoolean") if version == 2 else ("GetFloat64", "SetFloat64", "GetBoolean")
    )
    for name in names:
        with NativeInstance(version, kind).start() as one:
            assert one.call(name, None, c_size_t(0), None, c_size_t(0)) == OK
            assert one.call(name, references("in_range"), c_size_t(1), None, c_size_t(1)) == ERROR


def test_fmi3_counts_of_references_and_values_must_agree():
    for name in ("GetFloat64", "SetFloat64", "GetBoolean"):
        with NativeInstance(3).start() as one:
            assert one.call(name, references("speed"), c_size_t(1), doubles(0.0, 0.0), c_size_t(2)) == ERROR
            assert "2 values for 1" in one.last


@both_versions
def test_parameters_are_tunable_between_steps_and_at_events(version):
    with NativeInstance(version).start(speed=30.0) as one:
        viscous = one.get("viscous_torque")[0]
        one.go(apparent_viscosity_ratio=15.2)
        assert one.get("viscous_torque")[0] == pytest.approx(2.0 * viscous)
        assert one.set(presliding_deflection=1e-4) == ERROR  # a start value only
    with NativeInstance(version, ME).start(speed=30.0) as one:
        assert one.set(apparent_viscosity_ratio=15.2) == OK
        assert one.get("viscous_torque")[0] == pytest.approx(2.0 * viscous)
        one.call("EnterContinuousTimeMode")
        assert one.set(speed=31.0, presliding_deflection=1e-4) == OK
        assert one.set(apparent_viscosity_ratio=7.6) == ERROR
        assert "Continuous-Time Mode" in one.last


# model exchange


@both_versions
def test_model_exchange_follows_inputs_and_state_at_once(version):
    with NativeInstance(version, ME).start(presliding_stiffness=400.0, presliding_damping=1e-9) as one:
        one.update()
        assert one.call("EnterContinuousTimeMode") == OK
        for deflection in (1e-5, -2e-5):
            assert one.call("SetContinuousStates", doubles(deflection), c_size_t(1)) == OK
            assert one.vector("GetContinuousStates") == [deflection] == one.get("presliding_deflection")
            parts = sum(one.get("hysteresis_torque", "sliding_torque"))
            assert parts == pytest.approx(400.0 * deflection, rel=1e-9)
        one.set(speed=0.02)
        assert one.rates() == one.get("presliding_deflection_rate")
        assert one.rates()[0] == pytest.approx(0.02, rel=1e-6)
        assert one.vector("GetEventIndicators", 2) == one.get("in_range_indicator", "slip_indicator")
        assert one.vector("GetNominalsOfContinuousStates") == [1e-3]
        flags = [ctypes.c_int(1), ctypes.c_int(1)] if version == 2 else [ctypes.c_bool(1), ctypes.c_bool(1)]
        assert one.call("CompletedIntegratorStep", 1, *map(byref, flags)) == OK
        assert [flag.value for flag in flags] == [0, 0]


@both_versions
def test_modes_change_at_events_only(version):
    start = {"presliding_stiffness": 400.0, "presliding_side": 1e-9, "speed": 0.5}
    with NativeInstance(version, ME).start(**start) as one:
        assert one.update() == (OK, True)  # the deflection of the start
        assert one.update() == (OK, False)
        one.call("EnterContinuousTimeMode")
        assert one.set(temperature=200.0) == OK  # beyond the map
        assert one.vector("GetEventIndicators", 2)[0] < 0.0
        assert one.in_range()
        one.call("EnterEventMode")
        assert one.update() == (OK, False)
        assert not one.in_range()
        one.set(temperature=303.15)
        one.update()
        assert one.in_range()
        one.call("EnterContinuousTimeMode")
        assert one.call("SetContinuousStates", doubles(1.0), c_size_t(1)) == OK  # far beyond sliding
        assert one.vector("GetEventIndicators", 2)[1] < 0.0
        one.call("EnterEventMode")
        assert one.update() == (OK, True)  # not beyond the sliding deflection
        assert 0.0 < one.vector("GetContinuousStates")[0] < 1e-2
        assert one.rates() == [0.0]  # slips
        one.set(speed=-0.5)
        assert one.vector("GetEventIndicators", 2)[1] < 0.0
        assert one.update() == (OK, True)  # sticks again, from the sliding deflection
        assert 0.0 < one.vector("GetContinuousStates")[0] < 1e-2


@both_versions
@pytest.mark.parametrize(
    "name", ["SetContinuousStates", "GetContinuousStates", "GetNominalsOfContinuousStates"]
)
@pytest.mark.parametrize("wrong", [0, 2])
def test_wrong_lengths(version, name, wrong):
    with NativeInstance(version, ME).go_to("c") as one:
        assert one.call(name, doubles(0.0, 0.0), c_size_t(wrong)) == ERROR
        assert "needs 1" in one.last
    with NativeInstance(version, ME).go_to("c") as one:
        assert one.call(name, None, c_size_t(1)) == ERROR
    with NativeInstance(version, ME).go_to("c") as one:
        assert one.call("GetEventIndicators", doubles(0.0), c_size_t(1)) == ERROR


@both_versions
@pytest.mark.parametrize("bad", [math.nan, math.inf, -1e31])
def test_a_bad_state_is_discarded(version, bad):
    with NativeInstance(version, ME).go_to("c") as one:
        one.call("SetContinuousStates", doubles(2e-4), c_size_t(1))
        assert one.call("SetContinuousStates", doubles(bad), c_size_t(1)) == DISCARD
        assert one.last.startswith("presliding_deflection = ")
        assert one.vector("GetContinuousStates") == [2e-4]


def test_fmi3_reports_its_sizes():
    with NativeInstance(3, ME) as one:
        for name, size in (("GetNumberOfContinuousStates", 1), ("GetNumberOfEventIndicators", 2)):
            found = c_size_t()
            assert one.call(name, byref(found)) == OK
            assert found.value == size
        assert one.call("GetNumberOfContinuousStates", None) == ERROR


# derivatives

KNOWNS = (*INPUTS, "presliding_deflection")
UNKNOWNS = (*OUTPUTS, "presliding_deflection_rate")


def forward(one, unknowns, knowns, seed):
    found = doubles(*[0.0] * len(unknowns))
    vr_u, vr_k = references(*unknowns), references(*knowns)
    u, k = c_size_t(len(unknowns)), c_size_t(len(knowns))
    if one.version == 2:
        status = one.call("GetDirectionalDerivative", vr_u, u, vr_k, k, doubles(*seed), found)
    else:
        status = one.call("GetDirectionalDerivative", vr_u, u, vr_k, k, doubles(*seed), k, found, u)
    return list(found) if status == OK else status


@both_versions
@both_kinds
def test_directional_derivative_against_differences(version, kind):
    point = {"speed": 12.0, "preload": 1500.0, "axial_load": 300.0, "temperature": 310.0}

    def outputs(speed):
        with NativeInstance(version, kind).start(**(point | {"speed": speed})) as one:
            return one.get(*OUTPUTS)

    with NativeInstance(version, kind).start(**point) as one:
        slopes = forward(one, OUTPUTS, ["speed"], [1.0])
    h = 1e-4
    differences = [(b - a) / (2.0 * h) for a, b in zip(outputs(12.0 - h), outputs(12.0 + h), strict=True)]
    assert slopes == pytest.approx(differences, rel=1e-6, abs=1e-12)


@both_versions
@both_kinds
def test_directional_derivatives_are_linear_in_the_seed(version, kind):
    with NativeInstance(version, kind).start(speed=0.05, presliding_stiffness=400.0, axial_load=100.0) as one:
        single = {known: forward(one, UNKNOWNS, [known], [1.0]) for known in KNOWNS}
        seed = [1.0, -2.0, 0.5, 3.0, 1e-3]
        total = [
            sum(s * single[k][i] for s, k in zip(seed, KNOWNS, strict=True)) for i in range(len(UNKNOWNS))
        ]
        assert forward(one, UNKNOWNS, KNOWNS, seed) == pytest.approx(total, rel=1e-9, abs=1e-12)
        # named twice: both seeds count; more unknowns than there are variables
        twice = forward(one, UNKNOWNS * 5, ["speed", "speed"], [0.25, 0.75])
        assert twice == pytest.approx(single["speed"] * 5)
        assert forward(one, [], KNOWNS, seed) == []
        assert forward(one, ["friction_torque"], [], []) == [0.0]


@both_kinds
def test_adjoint_is_the_transpose(kind):
    with NativeInstance(3, kind).start(speed=0.05, presliding_stiffness=400.0, axial_load=100.0) as one:
        columns = [forward(one, UNKNOWNS, [known], [1.0]) for known in KNOWNS]
        seed = [(-1.0) ** i * (i + 1.0) for i in range(len(UNKNOWNS))]
        found, u, k = doubles(*[0.0] * len(KNOWNS)), c_size_t(len(UNKNOWNS)), c_size_t(len(KNOWNS))
        status = one.call(
            "GetAdjointDerivative",
            references(*UNKNOWNS),
            u,
            references(*KNOWNS),
            k,
            doubles(*seed),
            u,
            found,
            k,
        )
        assert status == OK
        assert list(found) == pytest.approx([sum(map(float.__mul__, seed, column)) for column in columns])
        status = one.call(
            "GetAdjointDerivative",
            references(*UNKNOWNS),
            u,
            references(*KNOWNS),
            k,
            doubles(*seed),
            k,
            found,
            k,
        )
        assert status == ERROR


@both_versions
@both_kinds
@pytest.mark.parametrize(
    ("unknown", "known"),
    [
        ("speed", "speed"), ("in_range", "speed"), ("friction_torque", "viscous_torque"), (999, "speed"),
        ("friction_torque", 999), ("friction_torque", "presliding_stiffness"), ("slip_indicator", "speed"),
        ("friction_torque", "in_range"), ("friction_torque", TIME_REFERENCE),
    ],
)  # fmt: skip
def test_variables_without_derivative(version, kind, unknown, known):
    with NativeInstance(version, kind).start() as one:
        assert forward(one, [unknown], [known], [1.0]) == ERROR
        assert (
            str(REFERENCES.get(unknown, unknown)) in one.last or str(REFERENCES.get(known, known)) in one.last
        )


@both_versions
def test_parameters_are_knowns_while_initializing(version):
    with NativeInstance(version) as one:
        one.set(speed=30.0)
        one.initialize()
        viscous, slope = (
            one.get("viscous_torque"),
            forward(one, ["viscous_torque"], ["apparent_viscosity_ratio"], [1.0]),
        )
        assert slope[0] == pytest.approx(viscous[0] / one.get("apparent_viscosity_ratio")[0], rel=1e-9)


# messages


@both_versions
@both_kinds
def test_clamped_inputs_are_reported_once(version, kind):
    with NativeInstance(version, kind).start(preload=0.0, temperature=0.0) as one:
        assert [m.text.split()[0] for m in one.messages] == ["preload", "temperature"]
        assert {m[:2] for m in one.messages} == {(WARNING, "logStatusWarning")}
        assert one.last == "temperature = 0 is outside the map and is clamped (logged once)"
        one.messages.clear()
        for speed in (1e4, 2e4):
            if kind == CS:
                one.go(speed=speed)
            else:
                one.set(speed=speed)
                one.update()
        assert [m.text.split()[0] for m in one.messages] == ["speed"]
        one.call("Reset")
        one.start(preload=0.0)
        assert [m.text.split()[0] for m in one.messages] == ["speed", "preload"]


@both_versions
def test_without_logging_there_are_no_messages(version):
    with NativeInstance(version, logging=False).start(preload=0.0) as one:
        assert one.set(friction_torque=1.0) == ERROR
        assert one.messages == []
        one.call("Reset")
        assert one.call("SetDebugLogging", 1, c_size_t(0), None) == OK
        one.start(preload=0.0)
        assert [m.status for m in one.messages] == [WARNING]
        assert one.call("SetDebugLogging", 0, c_size_t(0), None) == OK
        assert one.set(friction_torque=1.0) == ERROR
        assert len(one.messages) == 1


def categories(*names):
    return c_size_t(len(names)), (ctypes.c_char_p * len(names))(*names)


@pytest.mark.slow
@both_versions
@pytest.mark.parametrize(
    ("chosen", "heard"),
    [
        ([b"logStatusWarning"], [WARNING]),
        ([b"logStatusDiscard", b"logStatusError"], [DISCARD, ERROR]),
        ([b"logAll"], [WARNING, DISCARD, ERROR]),
        ([b"logStatusFatal"], []),
        ([], [WARNING, DISCARD, ERROR]),
    ],
)
def test_log_categories(version, chosen, heard):
    with NativeInstance(version, ME) as one:
        assert one.call("SetDebugLogging", 1, *categories(*chosen)) == OK
        one.start(preload=0.0)
        one.set(speed=math.nan)
        one.set_raw(references(999), doubles(0.0))
        assert [m.status for m in one.messages] == heard


@both_versions
@pytest.mark.parametrize("unknown", [b"logEverything", b"", None])
def test_unknown_log_categories(version, unknown):
    with NativeInstance(version) as one:
        assert one.call("SetDebugLogging", 1, *categories(b"logAll", unknown)) == ERROR
        assert "logStatusDiscard" in one.last
    with NativeInstance(version) as one:
        assert one.call("SetDebugLogging", 1, c_size_t(1), None) == ERROR


def test_fmi2_messages_are_safe_as_formats():
    with NativeInstance(2, token="%s%n#1#") as one:
        assert "%%s%%n##1##" in one.last  # a printf of the importer turns it into %s%n#1#


@both_versions
def test_long_texts_are_cut(version):
    with NativeInstance(version, token="x" * 5000) as one:
        assert len(one.last) < 700
    with NativeInstance(version, resources="/" + "y" * 5000) as one:
        assert one.handle is None
        assert len(one.last) < 700


# FMI 2 only


def test_fmi2_status_of_steps():
    with NativeInstance(2).start(start=1.0) as one:
        one.go(0.5)
        time = doubles(0.0)
        assert one.call("GetRealStatus", 2, time) == OK
        assert time[0] == 1.5
        assert one.call("GetRealStatus", 0, time) == DISCARD
        assert one.call("GetRealStatus", 2, None) == DISCARD
        assert one.go() is not None  # discarded: nothing changed

"""The native FMUs call by call: legal order, refusals, values, messages, location of the map."""

import ctypes
import math
import os
import re
from ctypes import byref, c_double, c_size_t
from pathlib import Path
from urllib.parse import quote

import native_library as native
import numpy as np
import pytest
from fmu_checks import fmi_functions
from native_calls import LEGAL, STATES, UNSUPPORTED, arguments, is_legal
from native_library import CS, DISCARD, ERROR, INPUTS, ME, NUT_MAP, OK, OUTPUTS, NativeInstance, doubles
from native_model import put_resources
from synthetic_map import make_map

from ballscrew_fmu.models import FRICTION, MODELS, MONITOR, TRANSMISSION
from ballscrew_fmu.native_fmu.resource_files import map_bytes
from ballscrew_fmu.variables.friction import ELEMENT_STATES, fmu_variables
from ballscrew_tehl.runtime.constants import DAMPING_TIME, ELEMENTS
from ballscrew_tehl.runtime.packed import FrictionParameters

pytestmark = pytest.mark.slow
BAD = (math.nan, math.inf, -math.inf, 1e30, -1e31)
both_versions = pytest.mark.parametrize("version", [2, 3])
both_kinds = pytest.mark.parametrize("kind", [CS, ME])
hosts = pytest.mark.parametrize("version", [2, 3, "python"])  # python: the FMU for Python hosts
hosts_and_kinds = pytest.mark.parametrize(
    ("version", "kind"), [*((v, kind) for v in (2, 3) for kind in (CS, ME)), ("python", CS)]
)


@both_versions
def test_a_call_is_accepted_where_it_is_legal_and_refused_elsewhere(version):
    """Every call in every state of both kinds. After an error: start again, restore or free."""
    for name in LEGAL[version]:
        for kind, state in ((kind, state) for kind, states in STATES.items() for state in states):
            with NativeInstance(version, kind) as one:
                given, where = arguments(one, name), (name, kind, state)
                status = one.go_to(state).call(name, *given)
                if is_legal(version, name, kind, state):
                    assert status == UNSUPPORTED.get(name, OK), (*where, one.last)
                    assert not one.last.startswith("called in"), where
                    continue
                assert status == ERROR, where
                message = one.messages[-1]
                assert (message.status, message.category) == (ERROR, "logStatusError")
                assert re.fullmatch(rf"called in .+; legal in .+ \(fmi{version}{name}\)", message.text)
                assert one.set(speed=1.0) == ERROR
                assert one.call("Reset") == OK
                assert one.initialize() == OK


@both_versions
def test_the_table_has_all_functions_of_the_standard_and_none_crashes_without_an_instance(version):
    found = {name.removeprefix(f"fmi{version}") for name in fmi_functions(version)}
    apart = {"GetVersion", "GetTypesPlatform", "FreeInstance"}
    assert {n for n in found - apart if not n.startswith("Instantiate")} == set(LEGAL[version])
    with NativeInstance(version) as one:
        get_version = one.library[f"fmi{version}GetVersion"]
        get_version.restype = ctypes.c_char_p
        assert get_version() == {2: b"2.0", 3: b"3.0"}[version]
    for name in LEGAL[version]:
        assert one.call(name, *(None,) * 6) == ERROR
    one.call("FreeInstance")  # does nothing


def test_refused_instances_report_the_reason():
    token = re.escape(native.TOKEN)
    for version, kind in ((2, CS), (2, ME), (3, CS), (3, ME)):
        for wrong, found in (
            ({"token": "{other}"}, rf"\{{other\}}.*{token}"), ({"token": None}, "NULL.*" + token),
            ({"name": None}, "name is empty"), ({"name": b" \t"}, "name is empty"), ({"resources": None}, "resources"),
            ({"resources": "/no/such/folder"}, "/no/such/folder/screw.bin"), ({"token": "x" * 5000}, "x{50}"),
        ):  # fmt: skip
            for options in ({}, {"logging": False}, {"logger": False}):
                with NativeInstance(version, kind, **options, **wrong) as one:
                    assert one.handle is None
                    assert [m.status for m in one.messages] == ([] if "logger" in options else [ERROR])
                    assert "logger" in options or re.search(found, one.last)
                    assert len(one.last) < 700
        with NativeInstance(version, "scheduled execution") as one:
            assert one.handle is None
            assert "co-simulation or model exchange" in one.last
    for wanted, found in (
        ({"event_mode": True}, "no event mode"),
        ({"intermediate": (1,)}, "no intermediate updates"),
    ):
        with NativeInstance(3, CS, **wanted) as one:
            assert one.handle is None
            assert found in one.last
    with NativeInstance(2, functions="NULL").start() as one:  # without callbacks
        assert one.set_raw(one.vr(999), doubles(1.0)) == ERROR
    with NativeInstance(2, token="%s%n#1#") as one:
        assert "%%s%%n##1##" in one.last  # a printf of the importer turns it into %s%n#1#


def expected_torque(preload=2000.0, speed=0.0, temperature=303.15, axial_load=0.0):
    state = NUT_MAP.evaluate(preload, speed, temperature, axial_load)
    return math.copysign(state.viscous_torque + state.coulomb_torque, speed)


@hosts
def test_outputs_are_those_of_the_last_step(opened, version):
    with opened(version).start(speed=10.0) as one:
        assert one.get("friction_torque")[0] == pytest.approx(expected_torque(speed=10.0), rel=1e-12)
        one.set(speed=-30.0, preload=900.0)  # in a step, farther than the elements turn over
        assert one.get("friction_torque")[0] == pytest.approx(expected_torque(speed=10.0), rel=1e-12)
        assert one.get("speed") == [-30.0]
        one.go(0.1)
        new = expected_torque(speed=-30.0, preload=900.0)
        assert one.get("friction_torque")[0] == pytest.approx(new, rel=1e-12)
        one.set(speed=5.0)
        one.call("Terminate")
        assert one.get("friction_torque")[0] == pytest.approx(new, rel=1e-12)
        assert one.step(0.1, 0.1) == (DISCARD if version == "python" else ERROR)
    for kind in (CS, ME) if version != "python" else (CS,):  # in initialization mode they follow the inputs
        with opened(version, kind) as one:
            one.initialize()
            for speed in (10.0, 20.0, 7.0):
                one.set(speed=speed)
                if speed == 7.0:  # latched when the mode is left, without a get
                    one.call("ExitInitializationMode")
                assert one.get("friction_torque")[0] == pytest.approx(expected_torque(speed=speed), rel=1e-12)


@hosts
def test_impossible_steps(opened, version):
    for time, size, legal in (
        (0.0, -1e-9, False), (1.0, -1e-18, False), (0.0, math.nan, False), (0.0, math.inf, False), (0.0, 1e30, False),
        (math.nan, 1e-3, False), (math.inf, 1e-3, False), (0.0, 0.0, version != 3),
    ):  # fmt: skip
        with opened(version).start() as one:
            assert one.step(time, size) == (OK if legal else ERROR)
            where = f"communication point = {time:.10g} s, step size = {size:.10g} s; needs finite numbers"
            assert legal or one.messages[0].text.startswith(where)
            assert one.step(0.0, 1e-3) == (OK if legal else ERROR)  # the state is error
            assert one.call("Reset") == OK


@both_versions
def test_impossible_experiments_and_time_of_steps(version):
    """Drift by the rounding of an importer is silent, a jump is warned of in FMI 3, and the importer's time is used."""
    for start, stop in ((math.nan, None), (math.inf, None), (1.0, 0.5), (0.0, math.nan)):
        with NativeInstance(version) as one:
            assert one.initialize(start, stop) == ERROR
    with NativeInstance(version).start(stop=0.3) as one:
        time = 0.0
        for _ in range(3):
            assert one.step(time, 0.1) == OK  # the last one ends beyond 0.3 by rounding
            time += 0.1
    with NativeInstance(version).start() as one:
        time, reached = 0.0, doubles(0.0)
        for _ in range(1000):
            assert one.step(time, 1e-6) == OK
            time += 1e-6 * (1.0 + 1e-9)
        assert one.messages == []
        for jump in (5.0, 1.0):
            assert one.step(jump, 1e-3) == OK
        if version == 2:
            assert one.call("GetRealStatus", 2, reached) == OK
        else:
            assert one.get_raw(one.vr(native.TIME_REFERENCE), reached) == OK
        assert reached[0] == pytest.approx(1.001, rel=1e-15)
        assert [m.text[:29] for m in one.messages] == ["communication point = 5 s, en"][: version - 2]


@hosts
def test_a_step_past_the_stop_time_is_an_error_and_the_instance_goes_on(opened, version):
    """The standards require the error; the last successful time is that of the step before."""
    with opened(version).start(stop=0.3, speed=5.0) as one:
        one.go(0.2)
        before, time = one.outputs(), doubles(0.0)
        if version == 3:
            given = (c_double(0.2), c_double(0.2), True, *(byref(ctypes.c_bool()) for _ in range(3)), time)
            assert one.call("DoStep", *given) == ERROR
        else:
            assert one.step(0.2, 0.2) == ERROR
            assert one.call("GetRealStatus", 2, time) == OK
        assert "stop time 0.3 s" in one.last
        assert time[0] == pytest.approx(0.2)
        assert one.outputs() == before
        assert one.step(0.2, 0.1) == OK


@hosts
def test_a_bad_value_in_co_simulation_discards_the_step(opened, version):
    """Outputs and time are those of the last good step; the bad value is named until it is replaced."""
    start = {"speed": 3.0, "start": 1.0}
    for name in (*INPUTS, *native.REAL_PARAMETERS):
        with opened(version).start(**start) as one, opened(version).start(**start) as other:
            one.go(), other.go()
            good, before, time = one.get(name)[0], one.outputs(), doubles(0.0)
            for bad in (*BAD, *(() if name in INPUTS else (-1e-9,))):
                assert one.set(**{name: bad}) == OK
                assert one.step(one.time, 1e-3) == DISCARD
                assert one.messages[-1][:2] == (DISCARD, "logStatusDiscard")
                limits = "" if version == "python" else r" >= \S+ and < 1e\+30"
                assert re.match(rf"{name} = .+ needs a finite number{limits}", one.last)
                assert name in INPUTS or ">= 0" in one.last
                assert one.outputs() == before
            if version == 3:
                flags = [ctypes.c_bool(True) for _ in range(3)]
                given = c_double(one.time), c_double(0.5), True, *map(byref, flags), time
                assert one.call("DoStep", *given) == DISCARD
                assert not any(flag.value for flag in flags)
            else:
                assert one.call("GetRealStatus", 2, time) == OK
                # FMPy would go on silently
                assert one.call("GetBooleanStatus", 3, (ctypes.c_int * 1)()) == DISCARD
            assert time[0] == one.time
            assert one.go(**{name: good}) == other.go()  # nothing else has changed


@both_versions
def test_a_bad_value_in_model_exchange_is_discarded_and_nothing_is_stored(version):
    with NativeInstance(version, ME).start(speed=3.0) as one:
        before = one.get(*native.REALS)
        for name in (*INPUTS, *native.REAL_PARAMETERS):
            for bad in BAD:
                first = "temperature" if name != "temperature" else "speed"
                assert one.set(**{first: 300.0, name: bad}) == DISCARD
                assert one.last.startswith(f"{name} = ")
                assert one.get(*native.REALS) == before
        one.call("EnterContinuousTimeMode")
        good = [2e-4] * ELEMENTS
        one.call("SetContinuousStates", doubles(*good), c_size_t(ELEMENTS))
        for bad in BAD[:2]:
            states = doubles(*good[1:], bad)
            assert one.call("SetContinuousStates", states, c_size_t(ELEMENTS)) == DISCARD
            assert one.last.startswith(f"{ELEMENT_STATES[-1]} = ")
            assert one.vector("GetContinuousStates") == good


@hosts_and_kinds
def test_variables_that_cannot_be_set_or_read_are_refused(opened, version, kind):
    """Nothing of such a call is stored; after it the instance has to be reset."""
    room = ctypes.create_string_buffer(64)
    real, *types = ("Float64 Float32 UInt64 String" if version == 3 else "Real Integer String").split()
    hidden = () if version == "python" else ("presliding_element_1_rate", "slip_indicator_1")
    cases = [
        (f"Set{real}", ("speed", name), doubles(5.0, 1.0), name if name in OUTPUTS and kind == CS else "")
        for name in (*OUTPUTS, "in_range", *hidden, 999, 0)
    ]
    cases += [(f"Get{real}", (number,), doubles(1.0), f"value reference {number}") for number in (999, 0)]
    cases += [(f"{way}{kind_}", ("speed",), room, kind_) for kind_ in types for way in ("Get", "Set")]
    cases += [
        (f"{way}Boolean", (name,), room, "")
        for way, name in (("Get", "speed"), ("Set", "speed"), ("Set", "in_range"), ("Get", 0))
    ]
    cases += [(name, ("in_range",), None, "") for name in (f"Get{real}", f"Set{real}", "GetBoolean")]
    with opened(version, kind) as one:
        for name, variables, values, found in cases:
            one.start(speed=3.0)
            assert one.call(name, None, c_size_t(0), None, c_size_t(0)) == OK
            count = c_size_t(len(variables))
            assert one.call(name, one.vr(*variables), count, values, count) == ERROR, (name, variables)
            assert found in one.last
            assert one.last.endswith(f"(fmi{one.version}{name})")
            assert one.get("speed") == [3.0]
            assert one.set(speed=1.0) == ERROR
            assert one.call("Reset") == OK


@hosts_and_kinds
def test_parameters_are_accepted_with_the_values_that_they_have(opened, version, kind):
    """OpenModelica writes all of them after the initialization, fixed ones too: without effect."""
    for model in (FRICTION,) if version == "python" else MODELS:
        table = (fmu_variables if version == "python" else model.variables)(NUT_MAP.header)
        start = {v.name: float(v.start) for v in table if v.causality == "parameter" and v.unit is not None}
        fixed = {v.name: start[v.name] for v in table if v.fixed}
        assert fixed
        with opened(version, kind, model).start() as one, opened(version, kind, model).start() as other:
            assert one.set(**start) == OK, one.last
            assert one.get(*start) == list(start.values())
            if kind == CS:
                assert one.go(temperature=310.0) == other.go(temperature=310.0)
                assert one.set(**fixed, temperature=320.0) == OK
                assert one.get("temperature") == [320.0]
                assert one.go(temperature=310.0) == other.go(temperature=310.0)
            else:
                one.call("EnterContinuousTimeMode")
                assert one.set(**fixed, temperature=320.0) == OK
            name, value = next(iter(fixed.items()))
            assert one.set(**{name: value + 0.25}) == ERROR
            assert f"{name} cannot be set in" in one.last


@hosts_and_kinds
def test_a_boolean_answers_a_read_as_real_and_parameters_are_tunable(opened, version, kind):
    """pathsim-fmi and CoFMPy read all outputs as Real. Parameters: between steps and at events."""
    for speed, inside in ((3.0, 1.0), (1e6, 0.0)):
        with opened(version, kind).start(speed=speed) as one:
            if kind == CS:
                one.go()
            assert one.get("in_range", "speed") == [inside, speed]
            assert one.in_range() is bool(inside)
    with opened(version, kind).start(speed=30.0) as one:
        viscous = one.get("viscous_torque")[0]
        assert one.set(apparent_viscosity_ratio=15.2) == OK
        if kind == CS:
            one.go()
        assert one.get("viscous_torque")[0] == pytest.approx(2.0 * viscous)
        if kind == CS:
            # a start value only
            assert version == "python" or one.set(presliding_element_1=1e-4) == ERROR
            return
        one.call("EnterContinuousTimeMode")
        assert one.set(speed=31.0, presliding_element_1=1e-4) == OK
        assert one.set(apparent_viscosity_ratio=7.6) == ERROR
        assert "Continuous-Time Mode" in one.last


@both_versions
def test_model_exchange_follows_inputs_and_state_at_once(version):
    with NativeInstance(version, ME).start(presliding_stiffness=400.0, presliding_damping=1e-9) as one:
        one.update()
        assert one.call("EnterContinuousTimeMode") == OK
        root = math.sqrt(400.0 / ELEMENTS)
        for deflection in (1e-5, -2e-5):
            states = [root * deflection] * ELEMENTS
            assert one.call("SetContinuousStates", doubles(*states), c_size_t(ELEMENTS)) == OK
            assert one.vector("GetContinuousStates") == states == one.get(*ELEMENT_STATES)
            parts = sum(one.get("hysteresis_torque", "sliding_torque"))
            assert parts == pytest.approx(400.0 * deflection, rel=1e-9)
        one.set(speed=0.02)
        rates = one.get(*(f"{name}_rate" for name in ELEMENT_STATES))
        assert one.rates() == rates == pytest.approx([0.02 * root] * ELEMENTS, rel=1e-9)
        assert one.vector("GetEventIndicators", len(native.INDICATORS)) == one.get(*native.INDICATORS)
        assert one.vector("GetNominalsOfContinuousStates") == [1e-2] * ELEMENTS
        flags = [ctypes.c_int(1), ctypes.c_int(1)] if version == 2 else [ctypes.c_bool(1), ctypes.c_bool(1)]
        assert one.call("CompletedIntegratorStep", 1, *map(byref, flags)) == OK
        assert [flag.value for flag in flags] == [0, 0]
    for name, size in (
        ("SetContinuousStates", ELEMENTS), ("GetContinuousStates", ELEMENTS),
        ("GetNominalsOfContinuousStates", ELEMENTS), ("GetEventIndicators", len(native.INDICATORS)),
    ):  # fmt: skip
        for array, wrong in ((doubles(0.0, 0.0, 0.0), 0), (doubles(0.0, 0.0, 0.0), 3), (None, size)):
            with NativeInstance(version, ME).go_to("c") as one:
                # fmi4c asks for nominals without an array
                asked = array is None and "Nominals" in name
                assert one.call(name, array, c_size_t(wrong)) == (OK if asked else ERROR)
    if version == 3:
        with NativeInstance(3, ME) as one:
            for name, size in (
                ("GetNumberOfContinuousStates", ELEMENTS), ("GetNumberOfEventIndicators", len(native.INDICATORS)),
            ):  # fmt: skip
                found = c_size_t()
                assert (one.call(name, byref(found)), found.value) == (OK, size)


KNOWNS, UNKNOWNS = (*INPUTS, "presliding_element_2"), (*OUTPUTS, "presliding_element_2_rate")


def derivative(one, unknowns, knowns, seed, adjoint=False):
    found = doubles(*[0.0] * len(knowns if adjoint else unknowns))
    u, k, s, f = (c_size_t(len(x)) for x in (unknowns, knowns, seed, found))
    name = "GetAdjointDerivative" if adjoint else "GetDirectionalDerivative"
    given = (one.vr(*unknowns), u, one.vr(*knowns), k, doubles(*seed))
    status = one.call(name, *given, found) if one.version == 2 else one.call(name, *given, s, found, f)
    return list(found) if status == OK else status


@both_versions
@both_kinds
def test_derivatives_through_fmi(version, kind):
    """Linear in the seed, adjoint = transpose; refusals. All others: test_native_equivalence."""
    point = {"speed": 0.05, "presliding_stiffness": 400.0, "axial_load": 100.0}
    seed = [1.0, -2.0, 0.5, 3.0, -0.2, 1e-3]
    with NativeInstance(version, kind).start(**point) as one:
        matrix = np.array([derivative(one, UNKNOWNS, [known], [1.0]) for known in KNOWNS])
        assert derivative(one, UNKNOWNS, KNOWNS, seed) == pytest.approx(seed @ matrix, rel=1e-9, abs=1e-12)
        # named twice: both seeds count; more unknowns than there are variables
        twice = derivative(one, UNKNOWNS * 5, ["speed", "speed"], [0.25, 0.75])
        assert twice == pytest.approx([*matrix[KNOWNS.index("speed")]] * 5)
        assert derivative(one, [], KNOWNS, seed) == []
        assert derivative(one, ["friction_torque"], [], []) == [0.0]
        assert derivative(one, ["in_range"], ["speed"], [1.0]) == [0.0]
        if version == 3:
            seed = [(-1.0) ** i * (i + 1.0) for i in range(len(UNKNOWNS))]
            assert derivative(one, UNKNOWNS, KNOWNS, seed, adjoint=True) == pytest.approx(matrix @ seed)
    for unknown, known in (
        ("speed", "speed"), ("friction_torque", "viscous_torque"), (999, "speed"),
        ("friction_torque", 999), ("friction_torque", "presliding_stiffness"), ("slip_indicator_1", "speed"),
        ("friction_torque", "in_range"), ("friction_torque", native.TIME_REFERENCE),
    ):  # fmt: skip
        with NativeInstance(version, kind).start() as one:
            assert derivative(one, [unknown], [known], [1.0]) == ERROR
            assert any(str(one.names.get(name, name)) in one.last for name in (unknown, known))
    with NativeInstance(version, kind) as one:  # parameters are knowns while initializing
        one.set(speed=30.0)
        one.initialize()
        (slope,) = derivative(one, ["viscous_torque"], ["apparent_viscosity_ratio"], [1.0])
        viscous, ratio = one.get("viscous_torque", "apparent_viscosity_ratio")
        assert slope == pytest.approx(viscous / ratio, rel=1e-9)


@pytest.mark.parametrize(("version", "model"), [(2, FRICTION), (2, TRANSMISSION), ("python", FRICTION)])
def test_the_warning_of_long_steps_is_not_given_at_rest(opened, version, model):
    """Longer than damping over stiffness, of the screw, while elements stick and the shaft moves."""
    for share, speed, side, count in (
        (1.02, 0.0, 1e-20, 0), (1.02, 0.1, 1e-20, 1), (0.98, 0.1, 1e-20, 0), (1.02, 50.0, 1.0, 0),
    ):  # fmt: skip
        with opened(version, model=model).start(presliding_side=side, speed=speed) as one:
            for n in range(2):
                assert one.step(n * share * DAMPING_TIME, share * DAMPING_TIME) == OK
            texts = [m.text for m in one.messages if m.text.startswith("step")]
            assert len(texts) == count
            assert all(text.startswith(f"step = {share * DAMPING_TIME:g} s") for text in texts)


@hosts_and_kinds
def test_clamped_inputs_are_reported_once(opened, version, kind):
    with opened(version, kind).start(preload=0.0, temperature=0.0) as one:
        one.go() if kind == CS else one.update()
        assert [m.text.split()[0] for m in one.messages] == ["preload", "temperature"]
        assert {m[:2] for m in one.messages} == {(native.WARNING, "logStatusWarning")}
        assert one.last.startswith("temperature = 0")
        assert one.last.endswith("is outside the map and is clamped; is the input connected? (logged once)")
        for speed in (1e4, 2e4):
            one.set(speed=speed, axial_load=-1e6)
            one.go() if kind == CS else one.update()
        one.call("Reset")
        one.start(preload=0.0)
        assert [m.text.split()[0] for m in one.messages][2:] == ["speed", "axial_load", "preload"]


@hosts
def test_problems_have_a_text_without_debug_logging_and_categories_select(opened, version):
    """A discarded step, an error and an input that is not connected; a category that is unknown costs a warning."""

    def texts(one):
        one.set(temperature=0.0, speed=1e6)
        one.go()
        assert one.set(speed=math.nan) == OK
        assert one.step(one.time, 1e-3) == DISCARD
        assert one.set_raw(one.vr(999), doubles(1.0)) == ERROR
        found = [(m.category, m.text.split()[0]) for m in one.messages]
        assert one.call("Reset") == OK
        one.messages.clear()
        return found

    absent, discard = ("logStatusWarning", "temperature"), ("logStatusDiscard", "speed")
    clamped, error = ("logStatusWarning", "speed"), ("logStatusError", "no")
    with opened(version, logging=False).start() as one:
        assert texts(one) == [absent, discard, error]
        for on, names, status, expected in (
            (1, (), OK, [absent, clamped, discard, error]),
            (1, ("logStatusDiscard",), OK, [absent, discard]),
            (1, ("logStatusError", "noise"), native.WARNING, [("logStatusWarning", "log"), absent, error]),
            (1, ("logStatusWarning",), OK, [absent, clamped]),
            (1, ("logAll",), OK, [absent, clamped, discard, error]),
            (0, ("logAll",), OK, [absent, discard, error]),
        ):  # fmt: skip
            chosen = (ctypes.c_char_p * len(names))(*(name.encode() for name in names))
            assert one.call("SetDebugLogging", on, c_size_t(len(names)), chosen) == status
            found = [(m.category, m.text.split()[0]) for m in one.messages]
            one.start(), one.messages.clear()
            assert sorted(found + texts(one)) == sorted(expected)


@pytest.mark.parametrize("version", [2, "python"])
@pytest.mark.parametrize("speed", [0.0, 20.0])
def test_the_warning_of_each_model_names_what_is_beyond_the_map(opened, version, speed):
    """At rest too, with the value; of the transmission the force of the loaded nut, which no input states."""
    both = {"speed": 400.0, "temperature": 400.0}
    beyond = [(FRICTION, n, {n: x}) for n, x in (both | {"preload": 40.0, "axial_load": 2e4}).items()]
    torque = {"torque": 1e3} if speed else {}  # not estimated at rest
    if version == 2:
        beyond += [(MONITOR, name, {name: x}) for name, x in (both | torque | {"axial_load": 2e4}).items()]
        beyond += [(TRANSMISSION, name, {name: x}) for name, x in (both | {"preload": 40.0}).items()]
        beyond += [(TRANSMISSION, f"force_nut_{n}", {"position": x}) for n, x in (("a", -2e-5), ("b", 2e-5))]
    for model, name, values in beyond:
        at = {"torque": 0.8} if model is MONITOR else {}
        with opened(version, model=model).start(**at | {"speed": speed} | values) as one:
            for n in range(2 if version == "python" else 0):
                assert one.step(n * 1e-6, 1e-6) == OK
            # the last one: a load that parts the nuts names the torque of the monitor too
            named, _, value, *rest = one.last.split()
            assert (named, " ".join(rest)) == (name, "is outside the map and is clamped (logged once)")
            assert float(value) == pytest.approx(one.get(name)[0], rel=1e-9)
            assert len(one.messages) == len({m.text for m in one.messages})
            assert not one.in_range()


FOLDERS = ("with space, plus+, hash#, percent%41, \u00fc and [brackets]", "%zz", "a&b;c=d'\"\\?x", "\u6ede\U0001f529",
           "n" * 255)  # fmt: skip


def loads(version, resources):
    with NativeInstance(version, resources=resources) as one:
        assert one.handle or [message.status for message in one.messages] == [ERROR]
        return one.handle is not None


def test_uris_and_paths_of_odd_folders(tmp_path):
    """A URI is decoded once, a path never; both versions take both."""
    for name in FOLDERS:
        folder = put_resources(Path(os.fsdecode(os.fsencode(str(tmp_path)) + b"/" + name.encode())), NUT_MAP)
        place = os.fsencode(folder).decode()
        for form in ("file://{}", "file:{}", "file://localhost{}", "FILE://LOCALHOST{}", "file://{}/"):
            assert all(loads(version, form.format(quote(place))) for version in (2, 3)), (form, name)
        assert loads(2, "file://" + "".join("/" if c == 47 else f"%{c:02X}" for c in place.encode()))
        assert all((loads(3, f"{place}/"), loads(3, place), loads(2, place)))
    put_resources(tmp_path / "a b", NUT_MAP)
    damaged = put_resources(tmp_path / "a%20b", NUT_MAP, nut_map=b"nothing")
    for version, place in ((3, f"file://{tmp_path}/none%25"), (3, damaged), (2, "file://" + quote(damaged)),
                           (3, "/" + "y" * 1_000_000)):  # fmt: skip
        assert not loads(version, place)
    assert loads(2, f"file://{tmp_path}/a%20b")
    for nothing in ("file:", "file://", "file:///", "/", ".", "%", str(tmp_path / "none")):
        for version in (2, 3):
            assert not loads(version, nothing)


@both_versions
@both_kinds
def test_a_map_of_another_screw_replaces_that_in_the_resources(tmp_path, version, kind):
    """Results are those of the new map with the parameters of the model description, and a warning says so."""
    other = make_map(viscous_scale=2.0)
    folder = put_resources(tmp_path / "other", NUT_MAP, nut_map=map_bytes(other))
    with NativeInstance(version, kind, resources=folder) as one, NativeInstance(version, kind) as built:
        new, old = (m.header["content_hash"][:12] for m in (other, NUT_MAP))
        assert [m.status for m in one.opening] == [OK, native.WARNING]
        assert f"map {new} replaces map {old}" in one.opening[1].text
        own = NUT_MAP.header["content_hash"]
        assert built.opening == [(OK, "logAll", f"map {own}, three_parameter friction law")]
        at = {"preload": 2500.0, "speed": 40.0, "temperature": 310.0, "axial_load": 500.0}
        for instance, nut_map in ((one, other), (built, NUT_MAP)):
            instance.start(**at)
            expected = nut_map.evaluate(*at.values(), *FrictionParameters(**NUT_MAP.header["defaults"]))
            assert instance.get("viscous_torque")[0] == pytest.approx(expected.viscous_torque, rel=1e-12)
        saved = one.serialize(one.save())
        assert other.header["content_hash"].encode() in saved
        assert built.deserialize(saved)[0] == ERROR
        assert f"this FMU has {native.TOKEN} and map {old}" in built.last

"""Random sequences of calls in co-simulation: equal results of all FMUs while legal, refusal and error when not.

The reference of what is legal is StateMachine, written from the state machines of FMI 2.0.5 (section 4.2.4) and
FMI 3.0.2 (sections 2.3 and 4.2), not from the C code.
"""

import math
from ctypes import c_double

import fmpy
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from native_library import (
    ERROR,
    OUTPUTS,
    REAL_PARAMETERS,
    VARIABLES,
    NativeInstance,
    c_size_t,
    doubles,
    references,
)

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.python_fmu.package import build_fmu

pytestmark = pytest.mark.slow

AGREEMENT = 1e-12  # of a value, or of a thousandth of the largest of its kind in the sequence
LEGAL_SEQUENCES, ILLEGAL_SEQUENCES = 150, 1000
QUIET = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large]

# --- legal sequences ---

VALUES = st.one_of(
    st.tuples(st.just("preload"), st.floats(0.0, 15000.0)),
    st.tuples(st.just("speed"), st.one_of(st.floats(-400.0, 400.0), st.floats(-1.0, 1.0))),
    st.tuples(st.just("temperature"), st.floats(270.0, 360.0)),
    st.tuples(st.just("axial_load"), st.one_of(st.just(0.0), st.floats(-20000.0, 20000.0))),
    st.tuples(st.just("apparent_viscosity_ratio"), st.floats(0.0, 20.0)),
    st.tuples(st.just("net_sliding_coefficient"), st.floats(0.0, 0.02)),
    st.tuples(st.just("roughness_height"), st.floats(0.0, 1e-7)),
    st.tuples(st.just("breakaway_factor"), st.floats(0.0, 3.0)),
    st.tuples(st.just("regularization_speed"), st.floats(0.0, 1.0)),
    st.tuples(st.just("presliding_stiffness"), st.sampled_from([0.0, 50.0, 400.0, 2000.0])),
    st.tuples(st.just("presliding_damping"), st.floats(0.0, 2.0)),
)
LEGAL = st.lists(
    st.one_of(
        st.tuples(st.just("set"), st.lists(VALUES, min_size=1, max_size=4)),
        st.tuples(st.just("step"), st.one_of(st.floats(1e-7, 1.0), st.just(1e-3))),
        st.tuples(st.just("step"), st.just(1e-3)),
        st.tuples(st.just("save"), st.none()),
        st.tuples(st.just("restore"), st.integers(0, 5)),
        st.tuples(st.just("serialize"), st.integers(0, 5)),
        st.tuples(st.just("forget"), st.integers(0, 5)),
        st.tuples(st.just("reset"), st.lists(VALUES, max_size=3)),
    ),
    min_size=1,
    max_size=30,
)


class Python:
    """The pythonfmu FMU through fmpy."""

    def __init__(self, folder):
        self._one = FmuInstance(folder)
        self.set, self.slave = self._one.set, self._one.slave

    def step(self, time, size):
        self.slave.doStep(currentCommunicationPoint=time, communicationStepSize=size)

    def outputs(self):
        return [*self._one.get(*OUTPUTS), self._one.get("in_range")]

    def reset(self, **values):
        self.slave.reset()
        self.slave.setupExperiment(startTime=0.0)
        self.set(**values)
        self.slave.enterInitializationMode()
        first = self.outputs()
        self.slave.exitInitializationMode()
        return first

    def save(self):
        return self.slave.getFMUState()

    def restore(self, state):
        self.slave.setFMUState(state)

    def forget(self, state):
        self.slave.freeFMUState(state)

    def through_bytes(self, state):
        return self.slave.deSerializeFMUstate(self.slave.serializeFMUState(state))

    def close(self):
        self._one.close()


class Native:
    """A native FMU of either version."""

    def __init__(self, version):
        self._one = NativeInstance(version, logging=False).start()
        self.save, self.forget = self._one.save, self._one.forget

    def set(self, **values):
        assert self._one.set(**values) == 0

    def step(self, time, size):
        assert self._one.step(time, size) == 0

    def outputs(self):
        return [*self._one.get(*OUTPUTS), self._one.in_range()]

    def reset(self, **values):
        assert self._one.call("Reset") == 0
        self.set(**values)
        assert self._one.initialize() == 0
        first = self.outputs()
        assert self._one.call("ExitInitializationMode") == 0
        return first

    def restore(self, state):
        assert self._one.restore(state) == 0

    def through_bytes(self, state):
        content = self._one.serialize(state)
        status, again = self._one.deserialize(content)
        assert status == 0
        assert self._one.serialize(again) == content
        return again

    def close(self):
        self._one.__exit__()


def played(one, sequence):
    """Outputs after each action; names of the same length for all FMUs."""
    time, states, rows = 0.0, [], [one.reset()]
    for action, argument in sequence:
        if action == "set":
            one.set(**dict(argument))
            continue  # in co-simulation the outputs are of interest after a step
        if action == "step":
            one.step(time, argument)
            time += argument
        elif action == "save":
            states.append((one.save(), time))
        elif action == "reset":
            rows.append(one.reset(**dict(argument)))
            time = 0.0
        elif states:
            place = argument % len(states)
            state, then = states[place]
            if action == "restore":
                one.restore(state)
                time = then
            elif action == "serialize":
                again = one.through_bytes(state)
                one.forget(state)
                states[place] = again, then
            else:
                one.forget(states.pop(place)[0])
        rows.append(one.outputs())
    for state, _ in states:
        one.forget(state)
    return rows


@pytest.fixture(scope="module")
def fmus(tmp_path_factory, synthetic_nut_map):
    folder = tmp_path_factory.mktemp("sequences")
    packed = build_fmu(synthetic_nut_map, folder / "BallScrewFriction.fmu").path
    all_three = [Python(fmpy.extract(str(packed), unzipdir=str(folder / "unpacked"))), Native(2), Native(3)]
    yield all_three
    for one in all_three:
        one.close()


@settings(max_examples=LEGAL_SEQUENCES, deadline=None, suppress_health_check=QUIET, derandomize=True)
@given(LEGAL)
def test_legal_sequences_give_equal_results_in_all_fmus(fmus, sequence):
    python, fmi2, fmi3 = (played(one, sequence) for one in fmus)
    assert fmi2 == fmi3  # the same code: to the bit
    full = [max(abs(row[i]) for row in python) for i in range(len(python[0]))]
    torque = max(full[:4])  # parts of the torque may cancel
    for n, (row, expected) in enumerate(zip(fmi2, python, strict=True)):
        assert row[-1] == expected[-1], (n, "in_range")
        for i, name in enumerate(OUTPUTS):
            scale = max(abs(expected[i]), 1e-3 * (torque if "torque" in name else full[i]))
            assert abs(row[i] - expected[i]) <= AGREEMENT * scale, (n, name, row[i], expected[i])


# --- illegal sequences ---


class StateMachine:
    """State of a co-simulation FMU after the standards, with the choices of our FMU where they leave one.

    State is one of: instantiated, initialization, step, terminated, error.
    """

    GETS = ("initialization", "step", "terminated", "error")

    def __init__(self, version):
        self.version, self.state, self.setup = version, "instantiated", False
        self.saved = []

    def expected(self, call):
        """Whether the call is accepted; updates the state. A refused call is an error."""
        name, argument = call
        accepted = getattr(self, name)(argument)
        if not accepted:
            self.state = "error"
        return accepted

    def _move(self, allowed, target):
        if self.state not in allowed:
            return False
        self.state = target
        return True

    def set_inputs(self, value):
        return self.state in ("instantiated", "initialization", "step") and math.isfinite(value)

    def set_parameter(self, value):  # all are tunable
        return (
            self.state in ("instantiated", "initialization", "step") and math.isfinite(value) and value >= 0
        )

    def set_output(self, _):
        return False

    def set_unknown(self, _):
        return False

    def get_outputs(self, _):
        return self.state in self.GETS

    def get_unknown(self, _):
        return False

    def get_boolean(self, _):
        return self.state in self.GETS

    def get_boolean_of_real(self, _):
        return False

    def enter_initialization(self, _):
        return self._move(("instantiated",), "initialization")

    def exit_initialization(self, _):
        return self._move(("initialization",), "step")

    def step(self, size):
        if self.state != "step" or not math.isfinite(size) or size < 0.0:
            return False
        return size > 0.0 or self.version == 2  # FMI 3: size > 0; FMI 2: importers probe with 0

    def terminate(self, _):
        return self._move(("step",), "terminated")

    def reset(self, _):
        self.state = "instantiated"
        return True

    def save(self, _):
        self.saved.append(self.state)
        return True

    def restore(self, number):
        if self.saved:
            self.state = self.saved[number % len(self.saved)]
        return True

    def event_mode(self, _):  # model exchange, or an event mode that was not requested
        return False

    def set_time(self, _):
        return False

    def output_derivatives(self, _):  # maxOutputDerivativeOrder = 0
        return False

    def directional_derivative(self, _):
        return self.state in self.GETS


class Caller:
    """Executes the calls of StateMachine; returns the status."""

    def __init__(self, one):
        self.one, self.version, self.states, self.time = one, one.version, [], 0.0

    def set_inputs(self, value):
        return self.one.set(speed=1.0, preload=value)

    def set_parameter(self, value):
        return self.one.set(**{REAL_PARAMETERS[0]: value})

    def set_output(self, _):
        return self.one.set(friction_torque=1.0)

    def set_unknown(self, reference):
        return self.one.set_raw(references(reference), doubles(1.0))

    def get_outputs(self, _):
        return self.one.get_raw(references(*OUTPUTS), doubles(*[0.0] * len(OUTPUTS)))

    def get_unknown(self, reference):
        return self.one.get_raw(references(reference), doubles(0.0))

    def get_boolean(self, _):
        return self._boolean("in_range")

    def get_boolean_of_real(self, _):
        return self._boolean("speed")

    def _boolean(self, name):
        more = (c_size_t(1),) if self.version == 3 else ()
        return self.one.call("GetBoolean", references(name), c_size_t(1), (doubles(0.0)), *more)

    def enter_initialization(self, _):
        return self.one.initialize()

    def exit_initialization(self, _):
        return self.one.call("ExitInitializationMode")

    def step(self, size):
        return self.one.step(0.0, size)

    def terminate(self, _):
        return self.one.call("Terminate")

    def reset(self, _):
        return self.one.call("Reset")

    def save(self, _):
        self.states.append(self.one.save())
        return 0

    def restore(self, number):
        return self.one.restore(self.states[number % len(self.states)]) if self.states else 0

    def event_mode(self, _):
        return self.one.call("EnterEventMode")

    def set_time(self, _):
        return self.one.call("SetTime", c_double(0.0))

    def output_derivatives(self, _):
        vr, order, count = references("friction_torque"), references(1), c_size_t(1)
        if self.version == 2:
            return self.one.call("GetRealOutputDerivatives", vr, count, order, doubles(0.0))
        return self.one.call("GetOutputDerivatives", vr, count, order, doubles(0.0), count)

    def directional_derivative(self, _):
        unknown, known, count = references("friction_torque"), references("speed"), c_size_t(1)
        lengths = (count,) if self.version == 3 else ()
        found = doubles(math.nan)
        return self.one.call(
            "GetDirectionalDerivative", unknown, count, known, count, doubles(1.0), *lengths, found, *lengths
        )


BAD = st.sampled_from([math.nan, math.inf, -math.inf])
TIME = len(VARIABLES)  # reference of the time in FMI 3, which cannot be set
UNKNOWN = st.sampled_from([TIME, TIME + 1, 1000, 2**32 - 1])


def simple(*names):
    return st.tuples(st.sampled_from(names), st.none())


CALLS = st.lists(
    st.one_of(
        simple("enter_initialization"),
        simple("exit_initialization"),
        st.tuples(st.just("step"), st.floats(1e-6, 1.0)),
        st.tuples(st.just("set_inputs"), st.floats(0.0, 1e4)),
        simple("get_outputs", "get_boolean", "directional_derivative"),
        st.tuples(st.just("restore"), st.integers(0, 5)),
        simple("save", "reset"),
        st.tuples(st.just("set_parameter"), st.floats(-0.1, 10.0)),
        simple(
            "terminate", "set_output", "get_boolean_of_real", "event_mode", "set_time", "output_derivatives"
        ),
        st.tuples(st.sampled_from(["set_unknown"]), UNKNOWN),
        st.tuples(st.just("get_unknown"), st.sampled_from([TIME + 1, 1000, 2**32 - 1])),
        st.tuples(st.sampled_from(["set_inputs", "set_parameter"]), BAD),
        st.tuples(st.just("step"), st.one_of(BAD, st.sampled_from([0.0, -1e-3, -1e9]))),
    ),
    min_size=1,
    max_size=40,
)
START = [("enter_initialization", None), ("exit_initialization", None)]


def check(version, sequence, counts):
    machine = StateMachine(version)
    with NativeInstance(version, logging=False) as one:
        caller = Caller(one)
        for n, (name, argument) in enumerate(sequence):
            before = machine.state
            accepted = machine.expected((name, argument))
            status = getattr(caller, name)(argument)
            assert status == (0 if accepted else ERROR), (n, name, argument, before)
            counts["accepted" if accepted else "refused"] += 1
            if not accepted:
                # in the error state only reset, restore, free and getters are accepted
                assert caller.step(1e-3) == caller.set_inputs(1.0) == caller.terminate(None) == ERROR
                assert caller.enter_initialization(None) == caller.exit_initialization(None) == ERROR
                assert caller.get_outputs(None) == 0
        one.call("Reset")
        one.start(speed=20.0)  # works again after any sequence
        fresh = one.go(1e-3)
    with NativeInstance(version, logging=False) as another:
        assert another.start(speed=20.0).go(1e-3) == fresh


@pytest.mark.parametrize("version", [2, 3])
def test_any_sequence_gives_the_status_of_the_state_machine(version):
    counts = {"accepted": 0, "refused": 0}

    @settings(max_examples=ILLEGAL_SEQUENCES, deadline=None, suppress_health_check=QUIET, derandomize=True)
    @given(st.booleans(), CALLS)
    def run(started, sequence):
        check(version, [*(START if started else []), *sequence], counts)

    run()
    assert counts["accepted"] > ILLEGAL_SEQUENCES
    assert counts["refused"] > ILLEGAL_SEQUENCES


def test_the_machine_covers_all_calls():
    calls = {name for name in vars(StateMachine) if not name.startswith("_")} - {"expected", "GETS"}
    assert calls == {name for name in vars(Caller) if not name.startswith("_")}

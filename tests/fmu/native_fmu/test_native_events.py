"""Events of model exchange against steps; event mode, early return, intermediate update of FMI 3 co-simulation."""

import math
from ctypes import byref, c_bool, c_double

import fmpy
import numpy as np
import pytest
from native_library import CS, DISCARD, ERROR, INDICATORS, NUT_MAP, OK, NativeInstance
from native_model import NativeModel

from ballscrew_fmu.models import FRICTION, MONITOR, TRANSMISSION
from ballscrew_fmu.variables.friction import ELEMENT_STATES
from ballscrew_tehl.runtime.constants import DAMPING_TIME, ELEMENTS

pytestmark = pytest.mark.slow
STEP = 1e-3
RATES = [f"{name}_rate" for name in ELEMENT_STATES]
# from rest; next to no damping, which in a step is that of its mean
PRESLIDING = {"presliding_stiffness": 1500.0, "presliding_damping": 1e-12, "presliding_side": 1e-20}


def profile(seed, swing=600.0, count=120):
    """Inputs held over steps: slow and fast motion, reversals, rests; loads that swing, once beyond the map."""
    rng, rows, speed = np.random.default_rng(seed), [], 0.4
    for n in range(count):
        if n % 7 == 0:
            speed = (-1.0) ** (n // 7) * 10.0 ** rng.uniform(-0.2, 0.7)
        rows.append({
            "speed": 0.0 if n % 19 == 18 else speed, "preload": 2000.0 + swing * math.sin(0.2 * n),
            "temperature": 400.0 if swing and 30 <= n < 33 else 303.15, "axial_load": 1.5 * swing * (n >= 40),
        })  # fmt: skip
    return rows


def leave_event_mode(one):
    """The states do not belong to the importer."""
    assert one.update() == (OK, False)
    assert one.call("EnterStepMode") == OK


def started(early_return=True, update=None, **values):
    """In step mode of an instance with event mode."""
    one = NativeInstance(3, CS, event_mode=True, early_return=early_return, update=update)
    one.start(**values)
    assert one.update()[0] == OK
    assert one.call("EnterStepMode") == OK
    return one


def exchange_step(one, row):
    """Heat and events of a step of model exchange at constant inputs: rates are constant between events, so these are
    where lines cross 0."""
    one.latch(**row)
    one.event()  # the inputs jump
    left, heat, events = STEP, 0.0, 0
    while left > 0.0:
        now, states, rates = (one.values(names) for names in (INDICATORS, ELEMENT_STATES, RATES))
        power = one.get("power_loss")
        one.latch(**dict(zip(ELEMENT_STATES, states + left * rates, strict=True)))
        then = one.values(INDICATORS)
        crossed = (now > 0.0) & (then <= 0.0)
        taken = left * min([1.0, *(now[crossed] / (now - then)[crossed])])
        heat, left = heat + taken * power, left - taken
        if crossed.any():  # beyond by rounding: the indicator has changed its sign
            beyond = states + (taken * (1.0 + 1e-13) + 1e-18) * rates
            one.latch(**dict(zip(ELEMENT_STATES, beyond, strict=True)))
            one.event()
            events += 1
    return heat, events


def test_model_exchange_has_the_states_torques_and_heat_of_co_simulation():
    """To rounding while the Coulomb torque stays; or within the time in which elements that slide follow it."""
    for swing, tolerance in ((0.0, 1e-9), (600.0, 0.1)):
        rows, total = profile(3, swing=swing), np.zeros(2)
        exchange, steps = NativeModel(NUT_MAP, continuous=True), NativeModel(NUT_MAP)
        for one in (exchange, steps):
            one.latch(**PRESLIDING, **rows[0])
        exchange.initial_event()
        for row in rows:
            total += exchange_step(exchange, row)
            steps.step(STEP, **row)
            assert abs(exchange.get("friction_torque") - steps.get("friction_torque")) <= tolerance
            if not swing:
                difference = exchange.values(ELEMENT_STATES) - steps.values(ELEMENT_STATES)
                assert np.max(np.abs(difference)) <= 1e-8
        heat, events = total
        heat += exchange.get("heat")
        assert abs(heat - steps.get("heat")) <= tolerance * heat
        assert events >= 60


# --- event mode of co-simulation ---


@pytest.mark.parametrize("early_return", [True, False])
@pytest.mark.parametrize("set_in_event_mode", [True, False])
def test_co_simulation_reports_changes_of_in_range_and_nothing_else(early_return, set_in_event_mode):
    """An event that the importer does not handle is handled by the next step. Results are as without event mode, also
    where a preload vanishes, elements are switched off and the stiffness of the screw changes."""
    rows, events = profile(5), []
    for n in (60, 61, 80):
        rows[n] |= {"preload": 0.0, "axial_load": 0.0}
    start = {"presliding_side": 0.1, **rows[0]}
    with started(early_return, **start) as one, NativeInstance(3).start(**start) as plain:
        for n, row in enumerate(rows):
            if set_in_event_mode:
                assert one.call("EnterEventMode") == OK
            for fmu in (one, plain):
                fmu.set(**row)
                assert fmu.set_boolean("presliding", n < 100) == OK
            if set_in_event_mode:
                one.get("friction_torque")
                leave_event_mode(one)
            needed, early, reached = one.step_to_event(n * STEP, STEP)
            if needed:
                events.append(n)
                assert early
                assert reached == n * STEP
                state = one.save()
                if n == 30:
                    assert one.call("EnterEventMode") == OK
                    leave_event_mode(one)
                assert one.step_to_event(n * STEP, STEP) == (False, False, n * STEP + STEP)
                assert one.restore(state) == OK  # an event that is due is saved
                assert one.step_to_event(n * STEP, STEP)[0] is False
            assert plain.step(n * STEP, STEP) == OK
            assert one.outputs() == pytest.approx(plain.outputs(), rel=1e-12, abs=1e-15)
            if n in (59, 99):
                assert np.max(np.abs(plain.get(*ELEMENT_STATES))) > 1e-4
        assert one.get(*ELEMENT_STATES) == [0.0] * ELEMENTS
    assert events == ([30, 33, 60, 62, 80, 81] if early_return and not set_in_event_mode else [])


@pytest.mark.parametrize(("version", "model"), [(2, FRICTION), (2, TRANSMISSION), ("python", FRICTION)])
def test_the_warning_of_long_steps_is_not_given_at_rest_nor_for_short_parts(opened, version, model):
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
    with updating(Updates()).start(presliding_side=1e-20, speed=0.1) as one:  # parts of 0.6 ms
        one.step_to_event(0.0, 5e-3)
        assert not one.messages


def test_the_monitor_reports_motion_and_range_and_the_transmission_has_no_event_mode():
    """Events at changes of the inputs only; the preload is held as without event mode."""
    changes = ({"speed": 21.0}, {"speed": 0.0}, {"speed": 0.0}, {"speed": 30.0}, {"temperature": 400.0})
    with (
        NativeInstance(3, CS, event_mode=True, early_return=True, model=MONITOR) as one,
        NativeInstance(3, CS, model=MONITOR) as plain,
    ):
        for fmu in (one, plain):
            fmu.start(torque=1.0, speed=20.0, temperature=303.15)
        assert one.update()[0] == OK
        assert one.call("EnterStepMode") == OK
        for n, (values, expected) in enumerate(zip(changes, (False, True, False, True, True), strict=True)):
            for fmu in (one, plain):
                assert fmu.set(**values) == OK
            event, early, reached = one.step_to_event(n * STEP, STEP)
            assert event == early == (reached == n * STEP) == expected
            if event:
                assert one.call("EnterEventMode") == OK
                leave_event_mode(one)
                assert one.step_to_event(n * STEP, STEP)[:2] == (False, False)
            plain.step(n * STEP, STEP)
            assert one.get("preload", "preload_half_width") == plain.get("preload", "preload_half_width")
    with NativeInstance(3, CS, event_mode=True, model=TRANSMISSION) as one:
        assert one.handle is None


# --- intermediate update ---


class Updates:
    """Importer's side: records the calls, sets inputs by a function of time, requests early return at a time."""

    def __init__(self, inputs=None, until=math.inf, ask_from=math.inf):
        self.inputs, self.until, self.ask_from = inputs, until, ask_from
        self.calls, self.one, self.seen = [], None, []

    def __call__(self, _environment, time, settable, gettable, finished, may_return, requested, return_time):
        self.calls.append((time, settable, gettable, finished, may_return))
        self.seen.append(self.one.get("friction_torque", "power_loss"))
        if self.inputs is not None and settable:
            assert self.one.set(**self.inputs(time)) == OK
        if time >= self.ask_from:
            requested[0], return_time[0] = True, self.until


def updating(updates, **options):
    updates.one = NativeInstance(3, CS, update=updates, **options)
    return updates.one


def test_inputs_of_intermediate_updates_are_those_of_shorter_steps():
    def inputs(time):
        return {"speed": 3.0 * math.cos(900.0 * time), "preload": 2000.0 + 1e5 * time}

    updates = Updates(inputs)
    with updating(updates).start(**PRESLIDING) as one, NativeInstance(3).start(**PRESLIDING) as fine:
        for n in range(20):
            one.set(**inputs(n * STEP))
            assert one.step_to_event(n * STEP, STEP) == (False, False, n * STEP + STEP)
            heat = 0.0
            for k in range(8):
                fine.set(**inputs(n * STEP + STEP * k / 8 if k else n * STEP))
                assert fine.step(n * STEP + STEP * k / 8, STEP / 8) == OK
                torque, power = fine.get("friction_torque", "power_loss")
                assert updates.seen[8 * n + k] == pytest.approx([torque, power], rel=1e-9, abs=1e-12)
                heat += power * STEP / 8
            names = (*ELEMENT_STATES, "heat")
            assert one.get(*names) == pytest.approx(fine.get(*names), rel=1e-9, abs=1e-12)
            assert one.get("power_loss")[0] * STEP == pytest.approx(heat, rel=1e-9, abs=1e-15)
        times, flags = [call[0] for call in updates.calls[:8]], [call[1:] for call in updates.calls[:8]]
        assert times == pytest.approx([STEP * k / 8 for k in range(1, 9)], rel=1e-12)
        assert flags == [(True, True, True, False)] * 7 + [(False, True, True, False)]  # no early return
        # a value that is not valid discards the step: outputs, state and time are those before it
        updates.inputs, expected = (lambda time: {"speed": math.nan}), one.outputs()
        for made in (1, 0):  # the second time the value waits
            updates.calls.clear()
            assert one.step(20 * STEP, STEP) == DISCARD
            assert len(updates.calls) == made
            assert "speed = nan" in one.last
            assert one.outputs() == expected
        updates.inputs = None
        for fmu in (one, fine):
            fmu.set(speed=3.0, preload=2000.0)
            assert fmu.step_to_event(20 * STEP, STEP)[:2] == (False, False)
        assert one.get(*ELEMENT_STATES) == pytest.approx(fine.get(*ELEMENT_STATES), rel=1e-9)


def test_the_importer_can_ask_for_an_early_return():
    """Deflection, mean power and heat are those of the time that is reached."""
    for until, reached in (
        (0.6e-3, 0.6e-3), (0.0, 0.5e-3), (math.nan, 0.5e-3), (0.5e-3, 0.5e-3), (2.0, STEP),
    ):  # fmt: skip
        for speed, allowed in ((0.1, True), (3.0, True), (0.1, False)):  # elastic, sliding
            end = reached if allowed else STEP
            updates = Updates(until=until, ask_from=0.45e-3)
            with (
                updating(updates, early_return=allowed).start(speed=speed, **PRESLIDING) as one,
                NativeInstance(3).start(speed=speed, **PRESLIDING) as plain,
            ):
                assert one.step_to_event(0.0, STEP) == (False, end < STEP, pytest.approx(end, rel=1e-12))
                plain.go(end)
                names = (*ELEMENT_STATES, "power_loss", "heat")
                assert one.get(*names) == pytest.approx(plain.get(*names), rel=1e-9, abs=1e-15)
                assert updates.calls[0][4] == allowed


def test_other_calls_within_an_intermediate_update_are_refused():
    def attempt(name):
        if name == "roughness_height":
            return one.set(roughness_height=1e-8)
        given = (c_double(0.0), c_double(STEP), 0, None, None, None, None) if name == "DoStep" else ()
        return one.call(name, *given)

    for call in ("Terminate", "EnterEventMode", "Reset", "DoStep", "roughness_height"):
        statuses = []
        update = lambda *_, call=call, statuses=statuses: statuses.append(attempt(call))  # noqa: E731
        with NativeInstance(3, CS, update=update).start(speed=1.0) as one:
            nothing = byref(c_bool()), byref(c_bool()), byref(c_bool()), byref(c_double())
            assert one.call("DoStep", c_double(0.0), c_double(STEP), 0, *nothing) == ERROR
            assert statuses == [ERROR], call
            assert "Intermediate Update Mode" in one.last


def test_fmpy_follows_the_events(folder_of):
    """fmpy's master with event mode and early return: a row at each event, and the values without."""
    folder = folder_of(FRICTION, 3)
    steps = [(0.0, 303.15), (0.004, 303.15), (0.004, 400.0), (0.008, 400.0), (0.008, 310.0)]
    common = dict(
        fmi_type="CoSimulation", stop_time=0.012, output_interval=STEP, start_values=PRESLIDING | {"speed": 2.0},
        input=np.array(steps, dtype=[("time", float), ("temperature", float)]), output=["friction_torque", "in_range"],
    )  # fmt: skip
    run = fmpy.simulate_fmu(str(folder), use_event_mode=True, early_return_allowed=True, **common)
    plain = fmpy.simulate_fmu(str(folder), **common)
    changes = run["time"][1:][np.diff(run["in_range"]) != 0]
    assert changes == pytest.approx([0.004, 0.008])
    assert len(run) > len(plain)
    assert run["friction_torque"][-1] == pytest.approx(plain["friction_torque"][-1], rel=1e-9)

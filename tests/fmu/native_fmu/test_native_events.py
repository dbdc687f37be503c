"""Event mode, early return and intermediate update of FMI 3 co-simulation: events as in model exchange, in fmpy too."""

import math
from ctypes import byref, c_bool, c_double, c_size_t

import fmpy
import numpy as np
import pytest
from native_host import native_folder
from native_library import CS, DISCARD, ERROR, ME, NUT_MAP, OK, WARNING, NativeInstance, doubles
from scipy.integrate import solve_ivp

from ballscrew_fmu.models import FRICTION, MONITOR, TRANSMISSION

pytestmark = pytest.mark.slow
EVENT_TIME = 1e-9  # [s] largest difference from model exchange
STEP = 1e-3
BRISTLE = {"presliding_stiffness": 1500.0, "presliding_damping": 0.3, "presliding_side": 1e-20}  # from rest
BELOW = 0.999  # share of the Coulomb torque, with which slip begins
NAMES = "presliding_deflection", "viscous_torque", "friction_torque"


def profile(seed, count=120):
    """Inputs held over steps: slow and fast motion, reversals, rests, loads; once beyond the map."""
    rng, rows, speed = np.random.default_rng(seed), [], 0.4
    for n in range(count):
        if n % 7 == 0:
            speed = (-1.0) ** (n // 7) * 10.0 ** rng.uniform(-0.2, 0.7)
        rows.append({
            "speed": 0.0 if n % 19 == 18 else speed, "preload": 2000.0 + 600.0 * math.sin(0.2 * n),
            "temperature": 400.0 if 30 <= n < 33 else 303.15, "axial_load": 900.0 if n >= 40 else 0.0,
        })  # fmt: skip
    return rows


class Modes:
    """Direction in which the bristle slips, 0: it follows, and in_range; as last seen after an event."""

    def __init__(self, one):
        self.one, self.seen = one, (0, True)

    def changed(self):
        """Whether they differ from the last ones. At rest the direction cannot be seen."""
        speed, *torques, rate = self.one.get("speed", *NAMES[:0:-1], "presliding_deflection_rate")
        slip = int(math.copysign(1.0, torques[0] - torques[1])) if rate == 0.0 else 0
        before, self.seen = self.seen, (slip if speed else self.seen[0], self.one.in_range())
        return self.seen != before


def until_slip(one, begin, end, direction):
    """Integrate the bristle to the time of the next event or the end; order 8, roots to rounding."""

    def at(time, z):
        assert one.call("SetTime", c_double(time)) == OK
        assert one.call("SetContinuousStates", doubles(z), c_size_t(1)) == OK

    def rate(time, z):
        at(time, z[0])
        return one.rates()

    def slip(time, z):
        at(time, z[0])
        return one.vector("GetEventIndicators", 2)[1]

    slip.terminal = True
    start = one.vector("GetContinuousStates")
    run = solve_ivp(rate, (begin, end), start, "DOP853", events=slip, rtol=3e-14, atol=1e-17, max_step=2e-3)
    # beyond the root by rounding, so that the indicator has changed its sign
    at(run.t[-1], run.y[0, -1] + (math.copysign(1e-15, direction) if run.status == 1 else 0.0))
    return run.t[-1], run.status == 1


def exchange_events(rows):
    """Times of the changes of mode in model exchange."""
    events = []
    with NativeInstance(3, ME).start(**BRISTLE, **rows[0]) as one:
        one.update()
        one.call("EnterContinuousTimeMode")
        modes = Modes(one)

        def event(time):
            assert one.call("EnterEventMode") == OK
            assert one.update()[0] == OK
            assert one.call("EnterContinuousTimeMode") == OK
            if modes.changed():
                events.append(time)

        for n, row in enumerate(rows):
            time = n * STEP
            one.set(**row)
            event(time)  # the inputs jump
            while time < (n + 1) * STEP:
                time, slips = until_slip(one, time, (n + 1) * STEP, direction=row["speed"])
                if slips:
                    event(time)
    return events


def handle(one):
    """Event mode and back; the continuous state does not belong to the importer."""
    assert one.call("EnterEventMode") == OK
    assert one.update() == (OK, False)
    assert one.call("EnterStepMode") == OK


def started(early_return=True, update=None, **values):
    """In step mode of an instance with event mode."""
    one = NativeInstance(3, CS, event_mode=True, early_return=early_return, update=update)
    one.start(**BRISTLE | {"speed": 2.0} | values)
    assert one.update()[0] == OK
    assert one.call("EnterStepMode") == OK
    return one


def step_events(rows, input_events=False):
    """Times at which co-simulation reports an event."""
    events, time = [], 0.0
    with started(**rows[0]) as one:
        modes = Modes(one)
        modes.changed()
        for n, row in enumerate(rows):
            one.set(**row)
            if input_events:
                handle(one)
                if modes.changed():
                    events.append(time)
            while time < (n + 1) * STEP:
                needed, early, time = one.step_to_event(time, (n + 1) * STEP - time)
                assert early == (time < (n + 1) * STEP)
                assert needed or not early
                if needed:
                    events.append(time)
                    handle(one)
                    assert modes.changed() or not row["speed"]
        assert time == pytest.approx(len(rows) * STEP, rel=1e-12)
        assert all(message.status == WARNING for message in one.messages)
    return events


def test_events_are_those_of_model_exchange():
    rows = profile(3)
    expected = exchange_events(rows)
    assert len(expected) >= 12
    assert sum(abs(time / STEP - round(time / STEP)) > 1e-3 for time in expected) >= 5  # within steps
    for input_events in (False, True):
        events = step_events(rows, input_events)
        assert len(events) == len(expected)
        assert np.max(np.abs(np.subtract(events, expected))) <= EVENT_TIME


# --- event mode of co-simulation ---


def test_events_without_early_return_are_handled_within_the_step():
    """Same deflection and torque at the communication points as with early return; the heat of the steps adds up."""
    rows = profile(5)
    with started(**rows[0]) as early, started(early_return=False, **rows[0]) as whole:
        inside, total = 0, 0.0
        for n, row in enumerate(rows):
            time, heat = n * STEP, 0.0
            for fmu in (early, whole):
                fmu.set(**row)
            while time < (n + 1) * STEP:
                event, _, reached = early.step_to_event(time, (n + 1) * STEP - time)
                heat += early.get("power_loss")[0] * (reached - time)
                inside += n * STEP < time
                time = reached
                if event:
                    handle(early)
            assert whole.step_to_event(n * STEP, STEP) == (False, False, n * STEP + STEP)
            assert whole.get(*NAMES[:2]) == pytest.approx(early.get(*NAMES[:2]), rel=1e-9, abs=1e-14)
            assert whole.get("power_loss")[0] * STEP == pytest.approx(heat, rel=1e-9, abs=1e-14)
            assert whole.in_range() == early.in_range()
            total += heat
            for fmu in (early, whole):
                assert fmu.get("heat")[0] == pytest.approx(total, rel=1e-9)
        assert inside >= 5


def test_slip_is_at_the_coulomb_torque_until_the_speed_reverses_and_an_event_that_is_due_is_saved():
    """Later steps have the heat of their own motion only; an event not handled is handled by the next step."""
    with started(presliding_damping=0.0) as one, started(presliding_damping=0.0) as other:
        event, early, time = one.step_to_event(0.0, 1.0)
        assert (event, early, time) == other.step_to_event(0.0, 1.0) == (True, True, time)
        saved, wound = one.save(), one.get("presliding_deflection")
        saved = saved, one.deserialize(one.serialize(saved))[1]
        handle(one)
        coulomb = sum(one.get("hysteresis_torque", "sliding_torque"))
        assert coulomb == pytest.approx(1500.0 * wound[0] / BELOW, rel=1e-9)
        end = time
        for _ in range(3):
            for fmu in (one, other):
                assert fmu.step_to_event(end, 0.1) == (False, False, end + 0.1)
            assert one.outputs() == other.outputs()
            assert one.get("presliding_deflection") == wound
            assert one.get("power_loss")[0] == pytest.approx(2.0 * one.get("friction_torque")[0], rel=1e-12)
            end += 0.1
        one.set(speed=-2.0)
        assert one.step_to_event(end, 1e-4) == (True, True, end)  # no time passes
        handle(one)
        assert one.get("presliding_deflection") == pytest.approx(wound, rel=1e-12)
        for state in saved:
            assert one.restore(state) == OK
            assert one.step_to_event(time, 1e-3)[0] is False  # not reported a second time
            assert one.get("presliding_deflection_rate") == [0.0]
    for early_return in (True, False):  # an event at the end of a step is no early return
        with started(early_return, presliding_damping=0.0) as one:
            assert one.step_to_event(0.0, time) == (True, False, time)


@pytest.mark.parametrize("in_event_mode", [False, True])
def test_the_stiffness_of_the_screw_follows_the_loads_as_without_event_mode(in_event_mode):
    """Without slip all outputs are the same, with the heat of a bristle whose stiffness vanishes or that is switched
    off; also if the loads are set in event mode."""
    with (
        NativeInstance(3, CS, event_mode=True).start(presliding_side=0.1, speed=0.5) as one,
        NativeInstance(3).start(presliding_side=0.1, speed=0.5) as plain,
    ):
        one.update()
        one.call("EnterStepMode")
        for n, preload in enumerate((2000.0, 2500.0, 1500.0, 0.0, 0.0, 2000.0, 2000.0, 2000.0)):
            if in_event_mode:
                assert one.call("EnterEventMode") == OK
            for fmu in (one, plain):
                fmu.set(preload=preload)
                assert n != 7 or fmu.set_boolean("presliding", False) == OK
            if in_event_mode:
                one.get("friction_torque")
                assert one.update() == (OK, False)
                assert one.call("EnterStepMode") == OK
            assert n not in (3, 7) or plain.get("presliding_deflection")[0] > 1e-4
            assert one.step_to_event(n * STEP, STEP) == (False, False, n * STEP + STEP)
            assert plain.step(n * STEP, STEP) == OK
            assert one.outputs() == pytest.approx(plain.outputs(), rel=1e-12, abs=1e-15)
        assert one.get("presliding_deflection") == [0.0]


@pytest.mark.parametrize("early_return", [False, True])
def test_energy_above_a_coulomb_torque_that_decreases_is_heat_once(early_return):
    """Slip begins at once, and the power of the next step, no other, has what the bristle stored above its limit."""
    stiffness, size, speed = 400.0, 1e-4, 2.0
    with started(early_return, presliding_stiffness=stiffness, presliding_side=0.9, preload=4000.0) as one:
        (wound,) = one.get("presliding_deflection")
        one.set(preload=1000.0)
        event, early, _ = one.step_to_event(0.0, size)
        assert event == early == early_return
        if early_return:
            handle(one)
            one.step_to_event(0.0, size)
        coulomb, (viscous,) = sum(one.get("hysteresis_torque", "sliding_torque")), one.get("viscous_torque")
        limit, total = coulomb / stiffness, 0.0
        assert wound > 1.5 * limit
        assert one.get("presliding_deflection")[0] == pytest.approx(limit, rel=1e-12)
        moved, lost = (coulomb + viscous) * speed * size, 0.5 * stiffness * (wound**2 - limit**2)
        for n, heat in enumerate((lost + moved, moved, moved, moved)):
            assert one.get("power_loss")[0] * size == pytest.approx(heat, rel=1e-9)
            total += heat
            assert one.get("heat")[0] == pytest.approx(total, rel=1e-9)
            assert one.step_to_event((n + 1) * size, size) == (False, False, pytest.approx((n + 2) * size))


def test_the_warning_of_long_steps_is_not_given_at_rest_nor_for_short_parts():
    """Longer than damping over stiffness, 4 ms from the screw, while the bristle is elastic and the shaft moves."""
    for speed, side, count in ((0.0, 1e-20, 0), (0.1, 1e-20, 1), (50.0, 1.0, 0)):
        for model in (FRICTION, TRANSMISSION):
            with NativeInstance(2, model=model).start(presliding_side=side, speed=speed) as one:
                for n in range(2):
                    assert one.step(5e-3 * n, 5e-3) == OK
                texts = [m.text for m in one.messages if m.text.startswith("step")]
                assert len(texts) == count
                assert all(text.startswith("step = 0.005 s; an inertia") for text in texts)
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
                handle(one)
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
    with updating(updates).start(**BRISTLE) as one, NativeInstance(3).start(**BRISTLE) as fine:
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
            assert one.get(*NAMES, "heat") == pytest.approx(fine.get(*NAMES, "heat"), rel=1e-9, abs=1e-12)
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
        assert one.get(*NAMES) == pytest.approx(fine.get(*NAMES), rel=1e-9)


def test_the_importer_can_ask_for_an_early_return():
    """Deflection, mean power and heat are those of the time that is reached."""
    for until, reached in (
        (0.6e-3, 0.6e-3), (0.0, 0.5e-3), (math.nan, 0.5e-3), (0.5e-3, 0.5e-3), (2.0, STEP),
    ):  # fmt: skip
        for speed, allowed in ((0.1, True), (3.0, True), (0.1, False)):  # elastic, sliding
            end = reached if allowed else STEP
            updates = Updates(until=until, ask_from=0.45e-3)
            with (
                updating(updates, early_return=allowed).start(speed=speed, **BRISTLE) as one,
                NativeInstance(3).start(speed=speed, **BRISTLE) as plain,
            ):
                assert one.step_to_event(0.0, STEP) == (False, end < STEP, pytest.approx(end, rel=1e-12))
                plain.go(end)
                names = ("presliding_deflection", "power_loss", "heat")
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


def test_fmpy_follows_the_events(tmp_path):
    """fmpy's master with event mode and early return: a row at each event, and the values of our own master."""
    folder = native_folder(tmp_path / "fmu", NUT_MAP, 3)
    steps = [(0.0, 2.0), (0.004, 2.0), (0.004, -3.0), (0.008, -3.0), (0.008, 0.5)]
    common = dict(
        fmi_type="CoSimulation", stop_time=0.012, output_interval=STEP, start_values=BRISTLE,
        input=np.array(steps, dtype=[("time", float), ("speed", float)]),
        output=["speed", "friction_torque", "presliding_deflection"],
    )  # fmt: skip
    run = fmpy.simulate_fmu(str(folder), use_event_mode=True, early_return_allowed=True, **common)
    plain = fmpy.simulate_fmu(str(folder), **common)
    events = step_events([{"speed": 2.0 if n < 4 else -3.0 if n < 8 else 0.5} for n in range(12)], True)
    for time in events:
        assert np.min(np.abs(run["time"] - time)) <= 1e-12
    assert len(run) >= len(plain) + len([t for t in events if abs(t / STEP - round(t / STEP)) > 1e-6])
    limit = 1.001 * np.max(np.abs(plain["presliding_deflection"]))
    assert np.max(np.abs(run["presliding_deflection"])) <= limit

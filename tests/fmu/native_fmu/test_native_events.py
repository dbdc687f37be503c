"""Event mode, early return and intermediate update of FMI 3 co-simulation: events as in model exchange, in fmpy too."""

import ctypes
import math
from ctypes import byref, c_bool, c_double, c_size_t

import fmpy
import numpy as np
import pytest
from native_library import CS, ERROR, ME, OK, NUT_MAP, REFERENCES, WARNING, NativeInstance, doubles, references
from scipy.integrate import solve_ivp

from ballscrew_fmu.models import MONITOR
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC

EVENT_TIME = 1e-9  # [s] largest difference from model exchange
STEP = 1e-3
BRISTLE = {"presliding_stiffness": 1500.0, "presliding_damping": 0.3}
INDICATORS = 2


def profile(seed, count=120):
    """Inputs held over steps: slow and fast motion, reversals, rests, loads; twice beyond the map."""
    rng = np.random.default_rng(seed)
    rows, speed = [], 0.4
    for n in range(count):
        if n % 7 == 0:
            speed = (-1.0) ** (n // 7) * 10.0 ** rng.uniform(-0.2, 0.7)
        row = {
            "speed": 0.0 if n % 19 == 18 else speed,
            "preload": 2000.0 + 600.0 * math.sin(0.2 * n),
            "temperature": 400.0 if 30 <= n < 33 else 303.15,
            "axial_load": 900.0 if n >= 40 else 0.0,
        }
        rows.append(row)
    return rows


class Modes:
    """Direction in which the bristle slips, 0: it follows, and in_range; as last seen after an event."""

    def __init__(self, one):
        self.one, self.seen = one, (0, True)

    def changed(self):
        """Whether they differ from the last ones. At rest the direction cannot be seen."""
        speed, torque, viscous, rate = self.one.get(
            "speed", "friction_torque", "viscous_torque", "presliding_deflection_rate"
        )
        slip = int(math.copysign(1.0, torque - viscous)) if rate == 0.0 else 0
        before, self.seen = self.seen, (slip if speed else self.seen[0], self.one.in_range())
        return self.seen != before


def exchange_events(rows, law=FILM_SHEAR):
    """Times of the changes of mode in model exchange: an integrator of order 8 at its least tolerance, roots to
    rounding."""
    events = []
    with NativeInstance(3, ME, law=law).start(**BRISTLE, **rows[0]) as one:
        modes = Modes(one)

        def event(time):
            assert one.call("EnterEventMode") == OK
            assert one.update()[0] == OK
            assert one.call("EnterContinuousTimeMode") == OK
            if modes.changed():
                events.append(time)

        def at(time, z):
            assert one.call("SetTime", c_double(time)) == OK
            assert one.call("SetContinuousStates", doubles(z), c_size_t(1)) == OK

        def rate(time, z):
            at(time, z[0])
            return one.rates()

        def slip(time, z):
            at(time, z[0])
            return one.vector("GetEventIndicators", INDICATORS)[1]

        slip.terminal = True
        one.update()
        one.call("EnterContinuousTimeMode")
        for n, row in enumerate(rows):
            time, end = n * STEP, (n + 1) * STEP
            one.set(**row)
            event(time)  # the inputs jump
            while time < end:
                start = one.vector("GetContinuousStates")
                run = solve_ivp(rate, (time, end), start, "DOP853", events=slip, rtol=3e-14, atol=1e-17)
                time = run.t[-1]
                if run.status == 1:
                    # beyond the root by rounding, so that the indicator has changed its sign
                    at(time, run.y[0, -1] + math.copysign(1e-15, row["speed"]))
                    event(time)
                else:
                    at(time, run.y[0, -1])
    return events


def step_events(rows, law=FILM_SHEAR, input_events=False, **options):
    """Times at which co-simulation reports an event, and the time that the steps reach."""
    events, time = [], 0.0
    with NativeInstance(3, CS, event_mode=True, early_return=True, law=law, **options) as one:
        one.start(**BRISTLE, **rows[0])

        modes = Modes(one)

        def handle():
            assert one.call("EnterEventMode") == OK
            assert one.update() == (OK, False)
            assert one.call("EnterStepMode") == OK
            return modes.changed()

        assert one.update()[0] == OK
        assert one.call("EnterStepMode") == OK
        for n, row in enumerate(rows):
            one.set(**row)
            if input_events and handle():
                events.append(time)
            while time < (n + 1) * STEP:
                needed, early, reached = one.step_to_event(time, (n + 1) * STEP - time)
                assert early == (reached < (n + 1) * STEP)
                assert needed or not early
                time = reached
                if needed:
                    events.append(time)
                    assert handle() or not row["speed"]
        assert all(message.status == WARNING for message in one.messages)
    return events, time


@pytest.mark.parametrize("law", [FILM_SHEAR, MECHANISTIC])
def test_events_are_those_of_model_exchange(law):
    rows = profile(3)
    expected = exchange_events(rows, law)
    assert len(expected) >= 12
    assert sum(abs(time / STEP - round(time / STEP)) > 1e-3 for time in expected) >= 5  # within steps
    for input_events in (False, True):
        events, reached = step_events(rows, law, input_events)
        assert reached == pytest.approx(len(rows) * STEP, rel=1e-14)
        assert len(events) == len(expected)
        assert np.max(np.abs(np.subtract(events, expected))) <= EVENT_TIME
        print(np.max(np.abs(np.subtract(events, expected))), len(events))

"""Inertia, offset, friction and preload from logs of axes whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest
import servo_log as axis
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter
from servo_log import GAIN, GUIDES, LEAD, MASS, emps_log, screw_log, write_log

from ballscrew_tehl.applications.identification.directions import bidirectional_friction
from ballscrew_tehl.applications.identification.dynamics import identify
from ballscrew_tehl.applications.identification.log.log_file import Log, read_log
from ballscrew_tehl.applications.identification.log.signals import Drive, Section, Signals, signals_of
from ballscrew_tehl.applications.identification.output import identified_data, identified_text
from ballscrew_tehl.applications.identification.preload import (
    PreloadedLog,
    ScrewMap,
    change_of_preload,
    found_preload,
    screw_friction,
    separated_parts,
    without,
)
from ballscrew_tehl.applications.tables.headings import Column
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map.file import VG100, packaged_map
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import PACKAGED_VG100, load_screw

EMPS = "time [s],position [m],voltage [V]"


@pytest.fixture(scope="module")
def emps():
    return emps_log()


@pytest.fixture(scope="module")
def law():
    parameters = load_screw(PACKAGED_VG100)
    return ScrewMap(parameters, load_map(packaged_map(VG100), parameters), default_friction_set(parameters))


def of_emps(_, position, voltage, **given):
    signals = Signals(False, False, 1e-3, 0.0, [Section(position, GAIN * voltage)], None, None, {}, [])
    return identify(signals, travel=5e-5, **given)


def screw(law, preload, seed, **given):
    _, angle, current = screw_log(law.nut_map, preload, seed, **given)
    signals = Signals(True, False, 1e-3, 0.0, [Section(angle, axis.CONSTANT * current)], 303.15, None, {}, [])
    return identify(signals, travel=5e-5 / LEAD)


def test_emps_gives_the_published_numbers_and_its_measured_curve(emps, tmp_path):
    log = read_log(write_log(tmp_path / "emps.csv", EMPS, *emps))
    found = identify(signals_of(log, Drive(gain=GAIN)), travel=5e-5)
    assert found.inertia == pytest.approx(MASS, rel=5e-3)
    assert found.offset == pytest.approx(axis.OFFSET, abs=0.3)
    assert found.inertia_limits[0] <= MASS <= found.inertia_limits[1]
    # the voltage is held until the next sample
    assert found.delay == pytest.approx(-0.5e-3, abs=0.1e-3)
    many = found.friction.samples >= 34
    truth = np.interp(found.friction.speed, axis.SPEED, axis.FRICTION)[many]
    off = np.abs(found.friction.value[many] + found.offset - truth)
    assert many.sum() > 50
    assert np.all(off <= np.maximum(1.0, 0.03 * np.abs(truth)))


def test_intervals_hold_the_truth_with_noise_and_delay():
    held, inside, late, shares = 8, 0, 0, []
    for seed in range(held):
        found = of_emps(*emps_log(2, 1e-7, 0.03, 2, seed, fine=10))
        inside += found.inertia_limits[0] <= MASS <= found.inertia_limits[1]
        truth = np.interp(found.friction.speed, axis.SPEED, axis.FRICTION) - found.offset
        shares.append(np.mean((found.friction.low <= truth) & (truth <= found.friction.high)))
        # half a sample of the hold, half a step of the simulation
        late += found.delay_limits[0] <= 1.55e-3 <= found.delay_limits[1]
        assert found.delay_limits[1] - found.delay_limits[0] <= 0.4e-3
    assert inside >= held - 1
    assert late >= held - 1
    assert np.mean(shares) >= 0.9


def test_a_known_offset_leaves_friction_its_own_difference(emps, law):
    free, known = of_emps(*emps), of_emps(*emps, offset=(-5.0, 0.2))
    assert (known.offset, known.offset_error) == (-5.0, 0.2)
    assert known.offset_limits == pytest.approx((-5.0 - 0.392, -5.0 + 0.392), abs=1e-3)
    assert known.friction.value - 5.0 == pytest.approx(free.friction.value + free.offset, rel=1e-9)
    truth = np.interp(known.friction.speed, axis.SPEED, axis.FRICTION) + 5.0
    assert np.mean((known.friction.low <= truth) & (truth <= known.friction.high)) >= 0.95
    one, other = bidirectional_friction(free.friction), bidirectional_friction(known.friction, 0.2)
    assert other.mean == pytest.approx(one.mean, rel=1e-9)
    assert other.difference - one.difference == pytest.approx(free.offset + 5.0, rel=1e-9)
    # the error of an offset moves both directions: not their mean
    assert np.median(other.error / one.error) == pytest.approx(1.0, abs=0.1)
    assert any("it cannot all be an offset" in note for note in free.notes)
    assert not any("(f+ - f-)/2" in note for note in screw(law, 1800.0, 6).notes)


def test_given_mass_fewer_bins_a_given_cutoff_and_no_residuals_over_the_position(emps):
    found = of_emps(*emps, inertia=MASS, bins_wanted=12, cutoff=50.0)
    assert (found.inertia, found.inertia_limits, found.cutoff) == (MASS, None, 50.0)
    assert len(found.friction.speed) == 24
    with pytest.raises(ValueError, match=r"inertia given = 9.5e\+07 kg; the log shows about 95"):
        of_emps(*emps, inertia=1e6 * 95.0)
    nowhere = replace(found, places=(np.empty(0),) * 3)
    assert "residual over position" not in identified_text(nowhere, identified_data(nowhere))


def missing_at_wraps(time, position, voltage):
    """An encoder that starts again each 20 mm, three rows missing at some of its jumps."""
    wrapped = (position - position.min()) % 0.02
    jumps = np.flatnonzero(np.abs(np.diff(wrapped)) > 0.01)[::7]
    return [np.delete(s, (jumps[:, None] + np.arange(3)).ravel()) for s in (time, wrapped, voltage)]


def jittered(time, position, voltage):
    """Sampled up to 0.2 steps off, and stamped so."""
    seen = time + np.random.default_rng(1).uniform(-2e-4, 2e-4, len(time))
    return seen, CubicSpline(time, position)(seen), np.interp(seen, time, voltage)


CASES = [
    ("time [ms],position [mm],voltage [V]", lambda t, x, u: (1e3 * t, 1e3 * x, u), ""),
    (EMPS, lambda t, x, u: missing_at_wraps(t, x, u), "every 0.02 m: joined"),
    (EMPS, lambda t, x, u: jittered(t, x, u), "uneven sampling"),
    (EMPS, lambda t, x, u: [np.delete(s, np.s_[9000:9300]) for s in (t, x, u)], "1 gap(s) in time"),
    (EMPS, lambda t, x, u: (t, x, np.where(np.arange(len(t)) % 97, u, np.nan)), "uneven sampling"),
    (EMPS, lambda t, x, u: (np.round(t, 2), x, u), "taken as evenly sampled"),
    (EMPS, lambda t, x, u: (t, x + 0.05 * (t > 9.0), u), "1 jump(s) of the position"),
    (EMPS, lambda t, x, u: (t, x + (np.arange(len(t)) == 4000), u), ""),
    (EMPS, lambda t, x, u: (t, x, u + 5e3 * (np.arange(len(t)) == 4000)), ""),
    (EMPS, lambda t, x, u: (t, x, np.where(np.arange(len(t)) == 4000, 1e300, u)), ""),
    (EMPS, lambda t, x, u: (t, x[np.arange(len(x)) // 5 * 5], u), "position repeats each value in 5 rows"),
    (EMPS, lambda t, x, u: (t, x, u[np.arange(len(u)) // 4 * 4]), "voltage repeats each value in 4 rows"),
    ("time [s],velocity [mm/min],force [N]", lambda t, x, u: (t, 6e4 * np.gradient(x, t), GAIN * u), ""),
]


@pytest.mark.parametrize(("headings", "change", "note"), CASES)
def test_units_wraps_gaps_missing_samples_and_jumps(emps, tmp_path, headings, change, note):
    log = read_log(write_log(tmp_path / "log.csv", headings, *change(*emps)))
    found = identify(signals_of(log, Drive(gain=GAIN)), travel=5e-5)
    assert found.inertia == pytest.approx(MASS, rel=2e-3)
    assert note in "\n".join(found.notes)


def test_a_channel_that_is_too_slow_is_named(emps, tmp_path):
    time, position, voltage = emps
    held = position[np.arange(len(time)) // 100 * 100]
    log = read_log(write_log(tmp_path / "log.csv", EMPS, time, held, voltage))
    with pytest.raises(ValueError, match=r"= 0.1 s; allowed: .* position repeats each value in 100 rows"):
        signals_of(log, Drive(gain=GAIN))


def of_signals(motion, effort, units, drive):
    signals = dict(zip(("time", "position", "current"), motion + effort, strict=True))
    columns = {name: Column(k, "", unit) for k, (name, unit) in enumerate(zip(signals, units, strict=True))}
    return signals_of(Log(signals, columns, {}, []), drive)


def test_sides_of_a_gear_a_lead_a_left_hand_thread_and_signs_of_the_drive(emps):
    """Motor with 3 turns of the screw each: the same axis by angle and torque of the motor, or with other signs."""
    time, position, voltage = emps
    lead, ratio = 1e-3, 3.0
    current = (GAIN * voltage * lead / 0.5,)
    right = of_signals((time, position), current, ("s", "m", "A"), Drive(torque_constant=0.5, lead=lead))
    gear = Drive(torque_constant=0.5, ratio=ratio, lead=lead)
    motor = of_signals((time, position / lead * ratio), (current[0] / ratio,), ("s", "rad", "A"), gear)
    assert np.allclose(motor.sections[0].motion, right.sections[0].motion, rtol=1e-12)
    assert np.allclose(motor.sections[0].effort, right.sections[0].effort, rtol=1e-12)
    found = identify(right, travel=0.05)
    assert right.rotary
    assert found.inertia == pytest.approx(MASS * lead**2, rel=2e-3)
    for drive, sign in (
        (Drive(torque_constant=0.5, lead=-lead), -1),
        (Drive(torque_constant=-0.5, lead=lead), 1),
    ):
        other = identify(of_signals((time, position), (-current[0],), ("s", "m", "A"), drive), travel=0.05)
        assert other.inertia == pytest.approx(found.inertia, rel=1e-6)
        assert other.offset == pytest.approx(sign * found.offset, rel=1e-6)
        assert other.friction.value == pytest.approx(sign * found.friction.value[::sign], rel=1e-6)


def test_preload_and_its_change_with_known_guides(law):
    found, logs = [], []
    for preload, seed in ((1800.0, 1), (2000.0, 2)):
        one = screw(law, preload, seed)
        assert one.inertia == pytest.approx(axis.INERTIA, rel=3e-3)
        assert one.offset == pytest.approx(axis.TILT, abs=0.01)
        assert one.offset_limits[0] <= axis.TILT <= one.offset_limits[1]
        friction = without(screw_friction(one, None), GUIDES * LEAD)
        logs.append(screw_friction(one, None))
        found.append(PreloadedLog(friction, found_preload(friction, law, 303.15), 303.15))
        assert found[-1][1].preload_low_n < preload < found[-1][1].preload_high_n
        assert found[-1][1].preload_log_low_n < preload < found[-1][1].preload_log_high_n
        assert found[-1][1].shape_fits
    # the error of a log without the nut counts
    both = without(logs[0], 0.0, logs[0]._replace(mean=0.0 * logs[0].mean + 0.01))
    assert both.mean == pytest.approx(logs[0].mean - 0.01, rel=1e-12)
    assert both.error == pytest.approx(2.0**0.5 * logs[0].error, rel=1e-12)
    change = change_of_preload(*found, law)
    assert change.preload_ratio_low <= 0.9 <= change.preload_ratio_high < 1.0
    # the law's interval is common to both, but the exponent of the preload may be up to 1
    wide = found[0][1].preload_high_n - found[0][1].preload_low_n
    assert change.preload_ratio_high - change.preload_ratio_low < 0.35 * wide / 1800.0
    light = screw_friction(screw(law, 1000.0, 3), None)
    apart = separated_parts([(logs[1], 2000.0, 303.15), (light, 1000.0, 303.15)], law)
    assert apart.without_nut_low_nm <= GUIDES * LEAD <= apart.without_nut_high_nm
    assert apart.law_factor_low <= 1.0 <= apart.law_factor_high


def axis_log(seed, sine=False, step=1e-3, noise=0.01, back=1.0, bend=0.0):
    """Time [s], angle [rad], torque [N.m] of 2e-3 kg m2, 0.3 N.m + 1e-3 N.m s times the speed, offset 0.1.

    back : speed of the return over that of the feed;  bend : of friction over the root of the speed
    """
    rng, moves = np.random.default_rng(seed), [np.zeros(200)]
    for speed in 120.0 * np.array([0.04, 0.1, 0.2, 0.4, 0.7, 1.0]):
        for signed in (speed, -back * speed):
            ramp = np.linspace(0.0, signed, int(abs(signed) / 400.0 / step) + 2)
            moves += [ramp, np.full(int(500 * speed / abs(signed)), signed), ramp[::-1], np.zeros(100)]
    window = np.hanning(22)[1:-1]
    speed = np.convolve(np.concatenate(moves), window / window.sum(), "same")
    if sine:
        speed = 120.0 * np.sin(np.pi * step * np.arange(20_000))
    time, angle = step * np.arange(len(speed)), np.cumsum(speed) * step - 0.5 * speed * step
    friction = 0.3 * np.sign(speed) + 1e-3 * speed + bend * np.sign(speed) * np.sqrt(np.abs(speed))
    friction = np.where(np.abs(speed) > 1e-9, friction, 0.0)
    torque = 2e-3 * np.gradient(speed, step) + friction + 0.1 + rng.normal(0.0, noise, len(speed))
    return time, np.round(angle, 4), torque


def of_rows(where, *columns):
    log = read_log(write_log(where / "log.csv", "time [s],position [rad],torque [N.m]", *columns))
    return identify(signals_of(log, Drive()), travel=0.04)


def holds(found):
    """Whether inertia and offset are inside their limits, and the share of bins that are."""
    speed, friction = found.friction.speed, found.friction
    truth = 0.3 * np.sign(speed) + 1e-3 * speed
    limits = (found.inertia_limits, 2e-3), (found.offset_limits, 0.1)
    inside = [low <= value <= high for (low, high), value in limits]
    return *inside, np.mean((friction.low <= truth) & (truth <= friction.high))


def rows_of(t, size):
    return np.random.default_rng(9).random(len(t)) < size


def lost(t):
    """All rows but 80 of each 1500, which an export may fill by straight lines."""
    return np.arange(len(t)) % 1500 < 1420


#: what a drive or an export does to a log, by what a note says of it
KINDS = {
    "held at equal values": lambda t, x, y: (t, x, np.where(np.arange(len(t)) < 2500, y[0], y)),
    "clipped": lambda t, x, y: (t, x, np.clip(y, -1.0, 1.15)),
    "drops to 0": lambda t, x, y: (t, x, np.where(rows_of(t, 0.05), 0.0, y)),
    "the code 32.767": lambda t, x, y: (t, x, np.where(rows_of(t, 0.02), 32.767, y)),
    "stamps jitter": lambda t, x, y: (np.sort(t + 2e-3 * np.random.default_rng(9).random(len(t))), x, y),
    "an even raster": lambda t, x, y: (t[np.minimum(np.arange(len(t)) // 16 * 16 + 15, len(t) - 1)], x, y),
    "positive when it drives": lambda t, x, y: (t, x, y * np.where(np.gradient(x) < -1e-3, -1.0, 1.0)),
    "by straight lines over 10 rows": lambda t, x, y: (t, x, np.interp(t, t[::10], y[::10])),
    "is smoothed": lambda t, x, y: (t, x, lfilter([0.05], [1.0, -0.95], y - y[0]) + y[0]),
    "12 ms behind": lambda t, x, y: (t, x, np.interp(t - 0.012, t, y)),
    "truncation": lambda t, x, y: (t, x, np.trunc(y / 0.06) * 0.06),
    "1 times a turn": lambda t, x, y: (t, x, y + 0.05 * np.sin(x)),
    "a buffer that was not filled": lambda t, x, y: [np.pad(values, (0, 3000)) for values in (t, x, y)],
    "overflows its words": lambda t, x, y: (t, x, ((np.round(y / 2e-5) + 32768) % 65536 - 32768) * 2e-5),
    "is a straight line over pieces": lambda t, x, y: [np.interp(t, t[lost(t)], v[lost(t)]) for v in (t, x, y)],
    "unsigned words": lambda t, x, y: (t, x, np.round(y / 5e-5) % 65536 * 5e-5),
}  # fmt: skip


@pytest.mark.parametrize("note", KINDS)
def test_what_drives_and_exports_do_is_named_and_in_the_intervals(note, tmp_path):
    found = of_rows(tmp_path, *KINDS[note](*axis_log(3)))
    assert note in "\n".join(found.notes)
    inertia, offset, bins = holds(found)
    assert inertia
    assert offset or found.offset == pytest.approx(0.1, abs=0.01)
    assert bins >= 0.85


def test_directions_at_other_speeds_do_not_tell_an_offset_from_friction_that_bends(tmp_path):
    found = of_rows(tmp_path, *axis_log(3, back=3.0, bend=0.04))
    assert found.offset_limits[0] <= 0.1 <= found.offset_limits[1]
    assert abs(found.offset - 0.1) > 0.005  # a straight line alone would not hold it
    assert "the directions have few common speeds" in "\n".join(found.notes)
    computed = of_rows(tmp_path, *axis_log(3, noise=0.0))
    assert "torque has no noise" in "\n".join(computed.notes)


def test_a_sine_does_not_tell_the_delay_and_one_direction_not_the_offset(tmp_path):
    time, angle, torque = axis_log(4, sine=True)
    found = of_rows(tmp_path, time, angle, np.interp(time - 5e-3, time, torque))
    assert found.inertia_limits[0] <= 2e-3 <= found.inertia_limits[1]
    assert "does not tell the delay" in "\n".join(found.notes)
    one = axis_log(5)
    ahead = np.maximum.accumulate(one[1])
    rows = np.r_[True, np.diff(ahead) > 0.0] & (np.arange(len(ahead)) > 6000)
    signals = Signals(
        True, False, 1e-3, 0.0, [Section(x[rows], y[rows]) for x, y in [one[1:]]], None, None, {}, []
    )
    with pytest.raises(ValueError, match="--inertia-kgm2 with its value, for the friction of one direction"):
        identify(signals, travel=0.04)


def test_intervals_of_plain_logs_hold_the_truth_as_often_as_they_say(tmp_path):
    inside = np.mean([holds(of_rows(tmp_path, *axis_log(100 + seed))) for seed in range(40)], axis=0)
    assert np.all(inside >= 0.85)
    assert inside[2] <= 0.985

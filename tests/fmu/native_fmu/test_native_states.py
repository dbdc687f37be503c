"""Saved and serialized states of the native FMUs: complete, exact, and refused when anything is wrong with them."""

import ctypes
import functools
import re
from ctypes import byref, c_size_t, c_void_p

import native_library as native
import pytest
from native_library import CS, ERROR, ME, NUT_MAP, OK, TOKEN, NativeInstance, doubles
from native_model import sealed
from synthetic_map import make_map

from ballscrew_fmu.models import AXIS, FRICTION, MODELS, MONITOR, TRANSMISSION
from ballscrew_fmu.native_fmu.sources import table_hash

pytestmark = pytest.mark.slow
both_versions = pytest.mark.parametrize("version", [2, 3])
CASES = [(v, kind, model) for model in MODELS for v in (2, 3) for kind in (CS, ME)]
CASES += [("python", CS, FRICTION)]
PRESLIDING = {"presliding_stiffness": 400.0, "presliding_damping": 0.5}
START = {
    FRICTION: PRESLIDING | {"preload": 1500.0, "axial_load": 200.0},
    TRANSMISSION: PRESLIDING | {"position": -1e-6},
    MONITOR: {"torque": 0.8, "speed": 30.0, "initial_preload": 700.0},
    AXIS: PRESLIDING | {"guide_coulomb": 0.5, "support_stiffness": 2e8},  # slides at 2.2e-3
}
LATER = (0.002, 0.02, -0.01, 1.0, 0.0)


def wound(one):
    one.start(**START[one.model])
    if one.kind == CS:
        for speed in (30.0, 0.2, 0.0) if one.model is MONITOR else (0.2, 0.0):
            advance(one, speed)
        one.set(temperature=310.0)  # set, not stepped
    else:
        one.update()
        one.call("EnterContinuousTimeMode")
        drive(one, 0.1)
        if one.states:  # some elements slide from now on, others stick
            set_states(one, ([3e-3, -3e-3] * one.states)[: one.states])
            one.call("EnterEventMode")
            assert one.update() == (OK, True)
            one.call("EnterContinuousTimeMode")
    return one


def drive(one, speed):
    """Sets the speed; of the axis a torque that it breaks away from and holds."""
    return one.set(**({"speed": speed} if "angle_rate" not in one.names else {"motor_torque": 10.0 * speed}))


def set_states(one, states):
    one.call("SetContinuousStates", doubles(*states), c_size_t(len(states)))


def advance(one, speed):
    assert drive(one, speed) == OK
    assert one.step(one.time, 1e-3) == OK
    one.time += 1e-3


def seen(one):
    names = one.names.keys() - {"in_range", "presliding", "refine"}
    return [*one.get(*sorted(names)), one.in_range()]


def go_on(one):
    rows = [seen(one)]
    for speed in LATER:
        if one.kind == CS:
            advance(one, speed)
        else:
            drive(one, speed)
            if one.states:
                pairs = zip(one.vector("GetContinuousStates", one.states), one.rates(), strict=True)
                set_states(one, [state + 1e-6 * rate for state, rate in pairs])
            one.call("EnterEventMode")
            rows.append(one.update())
            one.call("EnterContinuousTimeMode")
        rows.append(seen(one))
    return rows


def disturb(one):
    if one.kind == ME:
        one.call("EnterEventMode")
    drive(one, -3.0)
    one.set(temperature=340.0, roughness_height=0.0)
    assert "presliding" not in one.names or one.set_boolean("presliding", False) == OK
    one.update() if one.kind == ME else one.step(one.time, 0.5)


@pytest.mark.parametrize(("version", "kind", "model"), CASES, ids=lambda x: getattr(x, "layer", str(x)))
def test_a_state_continues_exactly(opened, version, kind, model):
    """Restored repeatedly, through bytes in a new instance, after a reset, beside others: the same to the last bit."""
    new = functools.partial(opened, version, kind, model)
    with wound(new()) as one, new() as other:
        state, time = one.save(), one.time
        content = one.serialize(state)
        assert one.serialize(one.save()) == content
        for more in (-1, 1):  # room that is not that of the state
            assert (one.serialize(state, more), one.restore(state)) == (ERROR, OK)
        one.get(*one.names)  # getters change no result
        first = go_on(one)
        for _ in range(2):
            disturb(one)
            assert one.restore(state) == OK
            one.time = time
            assert go_on(one) == first
        status, again = other.deserialize(content)
        assert status == OK, other.last
        assert other.restore(again) == OK
        other.time = time
        assert other.serialize(other.save()) == content
        with wound(new()) as third:
            assert go_on(third) == go_on(other) == first
        assert one.set_raw(one.vr(999), doubles(1.0)) == ERROR  # restoring ends the error state
        assert one.restore(state) == OK
        one.time = time
        assert go_on(one) == first
        assert one.forget(state) == one.forget(state) == OK  # a second time it is NULL
        assert one.restore(c_void_p()) == ERROR
        disturb(other)
        with new() as fresh:
            assert other.call("Reset") == OK
            assert other.serialize(other.save()) == fresh.serialize(fresh.save())


@pytest.mark.parametrize("version", [2, 3, "python"])
def test_times_and_warnings_are_restored(opened, version):
    with opened(version).start(start=1.0, stop=2.0, temperature=0.0) as one, opened(version) as other:
        one.go(0.75)
        assert other.restore(other.deserialize(one.serialize(one.save()))[1]) == OK
        if version == 3:
            assert other.get(native.TIME_REFERENCE) == [1.75]
        other.set(preload=0.0)
        assert other.step(1.75, 0.1) == OK
        assert [m.text.split()[0] for m in other.messages] == ["preload"]  # not temperature again
        if version != "python":
            assert other.step(1.85, 0.5) == ERROR
            assert "stop time 2 s" in other.last


@both_versions
def test_states_of_another_map_are_refused(version):
    other_map = make_map(viscous_scale=1.5)
    with NativeInstance(version).start() as one, NativeInstance(version, nut_map=other_map).start() as other:
        assert other.restore(one.save()) == ERROR
        assert "of another map: not restored" in other.last
        with NativeInstance(version, nut_map=other_map).start() as same:
            assert same.restore(other.save()) == OK


@both_versions
def test_a_state_is_saved_over_an_old_one_and_no_step_takes_memory(version):
    with wound(NativeInstance(version)) as one:
        state = one.save()
        address = state.value
        assert one.call(f"Get{one.saved}", byref(state)) == OK
        assert state.value == address
    for model in MODELS:
        with NativeInstance(version, model=model, counts=True) as one:
            counts = (ctypes.c_long * 2).in_dll(one.library, "counts")
            wound(one)
            before = list(counts)
            for speed in LATER:
                advance(one, speed)
            seen(one)
            assert list(counts) == before
            one.save()  # freed by freeInstance
            one.forget(one.save())
            assert list(counts) == [before[0] + 2, before[1] + 1]
        assert counts[0] == counts[1] > 0


def refused(one, content, found="damaged|not a state of this format|another version or map"):
    status, state = one.deserialize(content)
    assert status == ERROR
    assert state.value is None
    assert re.search(found, one.last), one.last
    one.call("Reset")


@both_versions
def test_damaged_and_foreign_contents_are_refused(version):
    """Every byte flipped, every truncation; with correct checksums another map, table, token, size, version."""
    with wound(NativeInstance(version)) as one, NativeInstance(version) as other:
        good = one.serialize(one.save())
        assert sealed(good) == good
        for place in range(len(good)):
            refused(other, good[:place] + bytes([good[place] ^ 0x81]) + good[place + 1 :])
            refused(other, good[:place])
        refused(other, good + b"\0")
        content_hash, table = NUT_MAP.header["content_hash"].encode(), table_hash(NUT_MAP.header).encode()
        for bad in (
            good.replace(content_hash, content_hash[::-1]), good.replace(table, table[::-1]),
            good.replace(TOKEN.encode(), b"{tesT}"),
            good.replace(TOKEN.encode() + b"\0", TOKEN.encode() + b"x"), good[:-8], good + bytes(8),
        ):  # fmt: skip
            assert bad != good
            refused(other, sealed(bad), "another version or map")
        refused(other, b"BSFSTA99" + good[8:], "begin with 'BSFSTA99'.*begins with 'BSFSTA06'")

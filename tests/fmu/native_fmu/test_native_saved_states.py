"""Saved and serialized states of the native FMUs: complete, exact, and refused when anything is wrong with them."""

import math
import re
import struct
import subprocess
from ctypes import byref, c_size_t, c_void_p, create_string_buffer

import pytest
from native_library import (
    CS,
    ERROR,
    ME,
    NUT_MAP,
    OK,
    REALS,
    TIME_REFERENCE,
    TOKEN,
    NativeInstance,
    compiled,
    doubles,
    references,
)
from native_model import compiler
from synthetic_map import LAWS

from ballscrew_fmu.models import NATIVE_MODELS
from ballscrew_fmu.native_fmu.sources import native_sources
from ballscrew_tehl.runtime.packed import FILM_SHEAR

pytestmark = pytest.mark.slow

both_versions = pytest.mark.parametrize("version", [2, 3])
both_kinds = pytest.mark.parametrize("kind", [CS, ME])
both_laws = pytest.mark.parametrize("law", LAWS)
START = {"presliding_stiffness": 400.0, "presliding_damping": 0.5, "preload": 1500.0, "axial_load": 200.0}
LATER = (0.002, 0.02, -0.01, 1.0, 0.0)
HEAD = 24  # [bytes] magic, checksum, layout, size


def wound(version, kind=CS, law=FILM_SHEAR):
    """An instance with a deflected bristle at inputs that do not reveal it."""
    one = NativeInstance(version, kind, law=law).start(**START)
    if kind == CS:
        one.go(speed=0.2)
        one.go(speed=0.0)
        one.set(temperature=310.0)  # set, not stepped
    else:
        one.update()
        one.call("EnterContinuousTimeMode")
        one.call("SetContinuousStates", doubles(3e-4), c_size_t(1))
        one.set(speed=0.1)
    return one


def go_on(one):
    """All results of a run from here."""
    seen = [one.get(*REALS)]
    for speed in LATER:
        if one.kind == CS:
            seen.append(one.go(speed=speed))
        else:
            one.set(speed=speed)
            rate = one.rates()[0]
            state = one.vector("GetContinuousStates")[0] + 1e-3 * rate
            one.call("SetContinuousStates", doubles(state), c_size_t(1))
            one.call("EnterEventMode")
            changed = one.update()
            one.call("EnterContinuousTimeMode")
            seen.append([changed, *one.outputs(), *one.vector("GetEventIndicators", 2)])
    return seen


def disturb(one):
    if one.kind == CS:
        one.go(0.5, speed=-3.0, preload=9000.0, roughness_height=0.0)
        return
    one.call("EnterEventMode")
    one.set(speed=-3.0, preload=9000.0, roughness_height=0.0)
    one.update()


@both_versions
@both_kinds
@both_laws
def test_a_state_can_be_restored_repeatedly(version, kind, law):
    with wound(version, kind, law) as one:
        state, time = one.save(), one.time
        first = go_on(one)
        for _ in range(2):
            disturb(one)
            assert one.restore(state) == OK
            one.time = time
            assert go_on(one) == first
        assert one.forget(state) == OK


@both_versions
@both_kinds
@both_laws
def test_a_serialized_state_continues_exactly_in_a_fresh_instance(version, kind, law):
    with wound(version, kind, law) as one, NativeInstance(version, kind, law=law) as other:
        content = one.serialize(one.save())
        assert one.serialize(one.save()) == content
        status, state = other.deserialize(content)
        assert status == OK, other.last
        assert other.restore(state) == OK
        other.time = one.time
        assert other.serialize(other.save()) == content
        assert go_on(other) == go_on(one)  # to the last bit
    assert one.messages == other.messages == []


@both_versions
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_slipping_bristle_goes_on_slipping(version, way):
    with NativeInstance(version, ME) as one, NativeInstance(version, ME) as other:
        one.start(**START, speed=way, presliding_deflection=way)  # far beyond sliding
        one.update()
        assert one.rates() == [0.0]
        _, state = other.deserialize(one.serialize(one.save()))
        assert other.restore(state) == OK
        for each in (one, other):
            assert each.rates() == [0.0]
            each.set(speed=-way)
            assert each.update() == (OK, True)  # sticks again
        assert other.outputs() == one.outputs()


@both_versions
@pytest.mark.parametrize(("kind", "letter"), [*((CS, x) for x in "instx"), *((ME, x) for x in "inectx")])
def test_the_state_of_the_state_machine_is_restored(version, kind, letter):
    expected = {
        "s": [OK, ERROR, ERROR],
        "e": [OK, ERROR, OK],
        "c": [OK, ERROR, ERROR],
        "n": [ERROR, OK, ERROR],
    }
    with NativeInstance(version, kind).go_to(letter) as one, NativeInstance(version, kind) as other:
        _, state = other.deserialize(one.serialize(one.save()))
        tried = []
        for name in ("Terminate", "ExitInitializationMode", "EnterContinuousTimeMode"):
            other.restore(state)
            tried.append(other.call(name))
        assert tried == expected.get(letter, [ERROR] * 3)


@both_versions
def test_restoring_ends_the_error_state(version):
    with wound(version) as one:
        state, time = one.save(), one.time
        first = go_on(one)
        assert one.set(friction_torque=1.0) == ERROR
        assert one.step(0.0, 1e-3) == ERROR
        assert one.restore(state) == OK
        one.time = time
        assert go_on(one) == first


@both_versions
def test_time_and_stop_time_are_saved(version):
    with NativeInstance(version).start(start=1.0, stop=2.0) as one, NativeInstance(version) as other:
        one.go(0.75)
        _, state = other.deserialize(one.serialize(one.save()))
        assert other.restore(state) == OK
        if version == 3:
            assert other.get(TIME_REFERENCE) == [1.75]
        assert other.step(1.75, 0.5) == ERROR
        assert "stop time 2 s" in other.last


@both_versions
def test_a_warning_is_not_repeated_after_restoring(version):
    with NativeInstance(version).start(temperature=0.0) as one, NativeInstance(version) as other:
        state = one.save()
        _, copy = other.deserialize(one.serialize(state))
        for each, saved in ((one, state), (other, copy)):
            each.restore(saved)
            each.go(preload=0.0)
        assert [m.text.split()[0] for m in one.messages] == ["temperature", "preload"]
        assert [m.text.split()[0] for m in other.messages] == ["preload"]


@both_versions
@both_kinds
def test_instances_are_independent(version, kind):
    def run(*instances):
        return [[go_on(one) for one in instances] for _ in range(2)]

    with wound(version, kind) as one:
        alone = run(one)
    with wound(version, kind) as one, wound(version, kind) as two, NativeInstance(version, kind) as three:
        three.set(friction_torque=1.0)
        together = [[go_on(one)], [go_on(one)]]
        assert together == alone
        assert run(two) == alone
        assert {len(one.messages), len(two.messages)} == {0}
        assert len(three.messages) == 1


@both_versions
@both_kinds
def test_reset_equals_a_new_instance(version, kind):
    with wound(version, kind) as used, NativeInstance(version, kind) as fresh:
        disturb(used)
        assert used.call("Reset") == OK
        assert used.serialize(used.save()) == fresh.serialize(fresh.save())
        for one in (used, fresh):
            one.start()
        assert used.outputs() == fresh.outputs()


@both_versions
def test_a_state_is_saved_over_an_old_one(version):
    name = "GetFMUstate" if version == 2 else "GetFMUState"
    with wound(version) as one:
        state = one.save()
        address, before = state.value, one.serialize(state)
        one.go(speed=1.0)
        assert one.call(name, byref(state)) == OK
        assert state.value == address
        assert one.serialize(state) != before


@both_versions
def test_freeing_a_state_twice_or_not_at_all(version):
    with wound(version) as one:
        state = one.save()
        assert one.forget(state) == OK
        assert state.value is None
        assert one.forget(state) == OK
        assert one.call("FreeFMUstate" if version == 2 else "FreeFMUState", None) == OK
        one.save()
        assert one.restore(c_void_p()) == ERROR


# wrong bytes


def checksum(content):
    """64-bit FNV-1a hash (Fowler, Noll, Vo)."""
    value = 14695981039346656037
    for byte in content:
        value = (value ^ byte) * 1099511628211 & 0xFFFFFFFFFFFFFFFF
    return value


def sealed(content):
    """The bytes with correct size and checksum."""
    content = content[:20] + struct.pack("<I", len(content)) + content[24:]
    return content[:8] + struct.pack("<Q", checksum(content[16:])) + content[16:]


def refused(one, content, found="damaged|another version or map"):
    status, state = one.deserialize(content)
    assert status == ERROR
    assert state.value is None
    assert re.search(found, one.last), one.last
    one.call("Reset")
    return True


@both_versions
@both_kinds
def test_every_flipped_byte_and_every_truncation_is_refused(version, kind):
    with wound(version, kind) as one, NativeInstance(version, kind) as other:
        good = one.serialize(one.save())
        assert sealed(good) == good
        for place in range(len(good)):
            for mask in (0x01, 0x80, 0xFF):
                bad = good[:place] + bytes([good[place] ^ mask]) + good[place + 1 :]
                assert refused(other, bad, "damaged")
            assert refused(other, good[:place], "damaged")
        assert refused(other, good + b"\0")
        assert refused(other, b"\0" * len(good))
        assert other.deserialize(good)[0] == OK


@both_versions
def test_states_of_another_version_map_or_layout_are_refused(version):
    with wound(version) as one, NativeInstance(version) as other:
        good = one.serialize(one.save())
        content_hash = NUT_MAP.header["content_hash"].encode()
        assert TOKEN.encode() in good
        assert content_hash in good
        assert refused(
            other, sealed(good.replace(content_hash, content_hash[::-1])), "another version or map"
        )
        assert refused(other, sealed(good.replace(TOKEN.encode(), b"{tesT}")), "another version or map")
        longer = struct.pack("<I", len(TOKEN) + 1) + TOKEN.encode() + b"x"
        assert refused(other, sealed(good.replace(struct.pack("<I", len(TOKEN)) + TOKEN.encode(), longer)))
        assert refused(other, sealed(good[:16] + struct.pack("<I", 99) + good[20:]), "layout 99.*layout 3")
        assert refused(other, sealed(good[:-1]))
        assert refused(other, sealed(good + b"\0"))


@both_versions
def test_impossible_values_are_refused(version):
    with wound(version) as one, NativeInstance(version) as other:
        good = one.serialize(one.save())
        fields = HEAD + 8 + len(TOKEN) + len(NUT_MAP.header["content_hash"])
        time, stop, state, warned, stale = struct.unpack_from("<ddIII", good, fields)
        assert (time, stop, state, warned, stale) == (pytest.approx(2e-3), math.inf, 16, 0, 1)
        # values are valid, no event is due, initialization is done
        assert struct.unpack_from("<III", good, fields + 28) == (0, 0, 0)
        preload = fields + 40
        assert struct.unpack_from("<d", good, preload) == (1500.0,)
        for place, form, value in (
            (fields, "<d", math.nan), (fields + 8, "<d", math.nan), (fields + 16, "<I", 0),
            (fields + 16, "<I", 3), (fields + 16, "<I", 128), (fields + 20, "<I", 1 << 31),
            (fields + 24, "<I", 2), (fields + 28, "<I", 2), (fields + 32, "<I", 2), (fields + 36, "<I", 2),
            (preload, "<d", math.nan), (preload, "<d", 1e300), (preload + 8, "<d", math.inf), (len(good) - 4, "<I", 3),
        ):  # fmt: skip
            bad = bytearray(good)
            struct.pack_into(form, bad, place, value)
            assert refused(other, sealed(bytes(bad)), "another version or map")


@both_versions
def test_states_of_the_other_kind_are_refused(version):
    with wound(version, CS) as one, NativeInstance(version, ME) as other:
        status, state = other.deserialize(one.serialize(one.save()))
        assert status == OK
        assert other.restore(state) == ERROR
        assert "co-simulation" in other.last


@both_versions
def test_wrong_sizes_and_null_pointers(version):
    ending = "FMUstate" if version == 2 else "FMUState"
    read = "DeSerializeFMUstate" if version == 2 else "DeserializeFMUState"
    room, size = create_string_buffer(4096), c_size_t()
    for more in (-1, 1):
        with wound(version) as one:
            assert one.serialize(one.save(), more) == ERROR
            assert "bytes" in one.last
    with wound(version) as one:
        state = one.save()
        length = c_size_t(len(one.serialize(state)))
        for name, arguments in (
            (f"Serialized{ending}Size", (None, byref(size))), (f"Serialized{ending}Size", (state, None)),
            (f"Serialize{ending}", (None, room, length)), (f"Serialize{ending}", (state, None, length)),
            (read, (None, length, byref(c_void_p()))), (read, (room, length, None)), (f"Get{ending}", (None,)),
        ):  # fmt: skip
            assert one.call(name, *arguments) == ERROR, name


@pytest.mark.parametrize("model", NATIVE_MODELS, ids=lambda model: model.name)
def test_every_field_of_the_model_is_serialized_or_computed_again(model):
    """A new field of the model that is not serialized would be lost without an error."""
    sources = native_sources(NUT_MAP.header, 2, "t", model)
    state, code, walk = (
        sources[name].decode()
        for name in (
            "monitor_state.h" if model.layer == "monitor" else "screw_state.h",
            "model.c",
            "saved_state.c",
        )
    )
    structure = re.search(r"struct Model \{([^}]*)\};", state)[1]
    declared = set(re.findall(r"\b(\w+)(?:\[\w+\])?\s*[,;]", re.sub(r"/\*.*?\*/", "", structure, flags=re.S)))
    listed = set(re.findall(r"X\((\w+)\)", state)) - {"X"}
    cleared = code[code.index("void model_clear_computed") :].partition("\n}\n")[0]
    computed_again = set(re.findall(r"model->(\w+)", cleared))
    body = walk[walk.index("static void pass_model") : walk.index("static void pass_situation")]
    passed = set(re.findall(r"model->(\w+)", body)) - {"field"}
    assert all(f"{macro}(PASS" in body for macro in re.findall(r"#define (MODEL_\w+)\(X\)", state))
    assert len(declared) > 10
    assert declared == listed | computed_again | passed
    assert not computed_again & (listed | passed)


@both_versions
def test_getters_do_not_change_a_state(version):
    with wound(version) as one:
        state = one.save()
        first = go_on(one)
        one.restore(state)
        one.time = 2e-3
        one.get(*REALS)
        one.in_range()
        one.get_raw(references("friction_torque"), doubles(0.0))
        assert go_on(one) == first


@pytest.mark.skipif(len(compiler()) > 1, reason="sanitizers need a compiler of the system")
@both_versions
def test_a_host_under_sanitizers(version):
    program = compiled(version, sanitize=True)
    run = subprocess.run([program, program.parent], capture_output=True, text=True, timeout=300, check=False)
    assert run.returncode == 0, run.stderr[-3000:]
    messages = int(run.stdout.split()[0])
    assert 1000 < messages < 100000  # one per refused call

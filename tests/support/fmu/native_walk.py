"""Random calls, damaged states and damaged files: `native_walk.py SEED`, in a process that preloads the sanitizers.

The state of each instance is followed by the table of legal calls. Another status ends the program with an exception,
an error of memory with a report.
"""

import math
import random
import struct
import sys
import tempfile
from ctypes import Array, c_double, c_size_t, c_uint, create_string_buffer
from pathlib import Path

from native_calls import LEGAL, STATES, UNSUPPORTED, arguments, is_legal
from native_library import DISCARD, ERROR, ME, NUT_MAP, OK, NativeInstance, doubles
from native_model import put_resources, resources, sealed
from synthetic_map import closed_form

from ballscrew_fmu.models import MODELS, TRANSMISSION
from ballscrew_tehl.runtime.packed import Law

CALLS, FILES = 4000, 200  # of each model and version; damaged ones of the map and of the screw
ODD = (math.nan, math.inf, -math.inf, 1e300, -1e30, 1e29, -1.0, 0.0, 5e-324)
NEXT = {"EnterInitializationMode": "n", "EnterEventMode": "e", "EnterContinuousTimeMode": "c"}
OFTEN = {"ExitInitializationMode", "DoStep", "SetReal", "GetReal", "SetFloat64", "GetFloat64", *NEXT}
NEXT |= {"Reset": "i", "Terminate": "t"}  # state after a call


def damaged(rng, content, first, last=None):
    """Other four or eight bytes between first and last."""
    place, size = rng.randrange(first, (last or len(content)) - 8), rng.choice((4, 8))
    word = struct.pack("<d", rng.choice((*ODD, 1.0, 2.0))), struct.pack("<Q", rng.getrandbits(64))
    return content[:place] + rng.choice(word)[:size] + content[place + size :]


def odd_arguments(rng, one, name):
    """Of any variables and with any numbers, now and then NULL, a wrong reference or a number of no physics."""
    given = list(arguments(one, name))
    known = list(one.names.values())[: 3 if name[0] == "S" and rng.random() < 0.9 else None]
    if len(given) == 5 and given[0] is given[2] is None:  # variables of a type
        count, real = rng.choice((1, 2, 3, 40)), name[3:] in ("Real", "Float64")
        room = doubles(*[0.0] * count) if real else create_string_buffer(b"\1" * 8 * count)
        given = [one.vr(*[1] * count), c_size_t(count), room, c_size_t(count)]
    for place, value in enumerate(given):
        if isinstance(value, c_double):
            value.value = rng.choice(ODD) if rng.random() < 0.1 else value.value
        elif rng.random() < 0.02:
            given[place] = None
        elif isinstance(value, Array) and value._type_ is c_uint:
            value[:] = [rng.choice(known) if rng.random() < 0.99 else rng.getrandbits(32) for _ in value]
        elif isinstance(value, Array) and value._type_ is c_double:
            value[:] = [rng.choice(ODD) if rng.random() < 0.05 else rng.uniform(0.0, 400.0) for _ in value]
    return given


def call(rng, one, state):
    """State after a random call."""
    legal, odd = (
        [n for n in LEGAL[one.version] if is_legal(one.version, n, one.kind, state)],
        rng.random() < 0.3,
    )
    often = ["Reset"] if state in "xt" else [name for name in legal if name in OFTEN]
    name = rng.choice(rng.choices((often, legal, list(LEGAL[one.version])), (68, 29, 3))[0])
    status = one.call(name, *(odd_arguments(rng, one, name) if odd else arguments(one, name)))
    possible = {UNSUPPORTED.get(name, OK), *([DISCARD] * (name == "DoStep")), *([DISCARD, ERROR] * odd)}
    expected = possible if name in legal else {ERROR}
    assert status in expected, (one.model.name, one.version, one.kind, state, name, odd, status, one.last)
    if status == OK and name == "ExitInitializationMode":
        return "e" if one.kind == ME else "s"
    return {OK: NEXT.get(name, state), ERROR: "x"}.get(status, state)


def use_states(rng, one, state, saved):
    """State after saving one, or restoring one of an instance of this or the other kind, from memory or from bytes."""
    if len(saved) < 3 or rng.random() < 0.3:
        saved.append((one, one.save(), state))
        return state
    owner, pointer, letter = saved.pop(rng.randrange(len(saved)))
    content = owner.serialize(pointer)
    short = content[: 8 * rng.randrange(len(content) // 8)]
    assert one.deserialize(rng.choice((short, sealed(short))))[0] == ERROR
    bad = sealed(damaged(rng, content, 24, 24 + 3 * 64))  # in token, table or map that it belongs to
    assert bad == content or one.deserialize(bad)[0] == ERROR
    if rng.random() < 0.5:
        (status, other), freed = one.deserialize(content), owner.forget(pointer)
        assert status == freed == OK
        pointer = other
    status = one.restore(pointer)
    assert status == (OK if owner.kind == one.kind else ERROR)
    return letter if status == OK else "x"


def walk(rng, version, model):
    """One of each kind, which share a map, now and then replaced by a new one."""
    options = {
        "model": model,
        "nut_map": closed_form(Law.MECHANISTIC if model is TRANSMISSION else Law.THREE_PARAMETER),
    }
    pair, saved = [[NativeInstance(version, kind, **options), "i"] for kind in STATES], []
    for _ in range(CALLS):
        one, state = each = rng.choice(pair)
        if rng.random() < 0.01:
            one.__exit__()
            saved = [entry for entry in saved if entry[0] is not one]
            each[:] = NativeInstance(version, one.kind, **options), "i"
        else:
            each[1] = use_states(rng, *each, saved) if rng.random() < 0.05 else call(rng, one, state)
    pair[0][0].__exit__()
    pair[1][0].__exit__()


def read_damaged_files(rng, folder):
    """Some are refused with a message, the others used."""
    for name, content in resources(NUT_MAP).items():
        refused = 0
        for _ in range(FILES):
            bad = rng.choice((
                content[: rng.randrange(len(content))], damaged(rng, content, 0), sealed(damaged(rng, content, 24)),
                sealed(damaged(rng, content, 24, 400)), sealed(content[: -8 * rng.randrange(1, 100)]),
            ))  # fmt: skip
            put_resources(folder, NUT_MAP, **{name.partition(".")[0]: bad})
            with NativeInstance(rng.choice((2, 3)), resources=str(folder)) as one:
                refused += one.handle is None
                assert one.handle or one.last
                if one.handle:
                    at = {"preload": rng.uniform(-1e3, 2e4), "speed": rng.uniform(0.0, 2e3)}
                    one.start(**at, axial_load=rng.uniform(-2e4, 2e4)).go()
        assert 0 < refused < FILES, name


if __name__ == "__main__":
    seeded = random.Random(int(sys.argv[1]))
    for each in MODELS:
        walk(seeded, 2, each)
        walk(seeded, 3, each)
    with tempfile.TemporaryDirectory() as place:
        read_damaged_files(seeded, Path(place))

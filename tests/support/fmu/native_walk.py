"""Random calls, damaged states and damaged map files under sanitizers: native_walk.py SEED.

For a process with the sanitizer preloaded and the folders of the support on the path. The state of each instance is
followed by the table of legal calls: a status that it does not allow ends the program with an exception, an error of
memory with a report.
"""

import ctypes
import math
import random
import struct
import sys
from ctypes import c_size_t, c_void_p

from native_calls import LEGAL, STATES, UNSUPPORTED, arguments, is_legal
from native_library import (
    CS,
    DISCARD,
    ERROR,
    ME,
    NUT_MAP,
    OK,
    VARIABLES,
    WARNING,
    NativeInstance,
    counting_functions,
    doubles,
)
from native_model import compiled_model
from synthetic_map import closed_form

from ballscrew_fmu.models import AXIS, FRICTION, MONITOR, TRANSMISSION
from ballscrew_fmu.native_fmu.resource_files import checksum
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC

LIVES, CALLS, DAMAGES, FILES = 12, 150, 4, 600  # instances of a kind, calls of each, damaged states, files
WALKED = ((FRICTION, FILM_SHEAR), (MONITOR, FILM_SHEAR), (TRANSMISSION, MECHANISTIC), (AXIS, FILM_SHEAR))
ODD = (math.nan, math.inf, -math.inf, 1e30, -1e300, -1.0, 0.0, 5e-324, 1e29, 1.7e308)
TARGET = {  # state after a call
    "EnterInitializationMode": "n", "EnterEventMode": "e", "EnterContinuousTimeMode": "c", "Terminate": "t",
    "Reset": "i",
}  # fmt: skip
WORDS = (0, 1, 2**64 - 1, *(struct.unpack("<Q", struct.pack("<d", x))[0] for x in (math.nan, math.inf, 1e30)))


def sealed(content: bytes) -> bytes:
    """Bytes of a file, a map or a saved state, with correct size and checksum."""
    return (
        content[:8]
        + struct.pack("<QQ", len(content), checksum(content[24 : len(content) // 8 * 8]))
        + content[24:]
    )


def damaged(rng: random.Random, content: bytes, first: int, last: int | None = None) -> bytes:
    """Another word of eight or four bytes between first and last."""
    place = rng.randrange(first, (last or len(content)) - 8)
    word = struct.pack("<Q", rng.choice((*WORDS, rng.getrandbits(64))))[: rng.choice((4, 8))]
    return content[:place] + word + content[place + len(word) :]


def random_values(rng: random.Random, one: NativeInstance) -> int:
    """Status of setting or getting any variables, with NULL and odd values now and then."""
    count = rng.choice((0, 1, 2, 3, 40))
    names = [
        rng.choice(list(one.names)) if rng.random() < 0.98 else rng.getrandbits(32) for _ in range(count)
    ]
    values = [rng.choice(ODD) if rng.random() < 0.1 else rng.uniform(0.0, 400.0) for _ in range(count)]
    if rng.random() < 0.02:
        name = "SetReal" if one.version == 2 else "SetFloat64"
        return one.call(name, one.vr(*names), c_size_t(count), None, c_size_t(count))
    return (one.set_raw if rng.random() < 0.8 else one.get_raw)(one.vr(*names), doubles(*values))


def one_life(rng: random.Random, version: int, kind: str, model, law: str) -> int:
    """Calls of one instance that succeeded."""
    functions, given, taken = counting_functions() if version == 2 else (None, [], [])
    good = 0
    with NativeInstance(
        version, kind, functions=functions, model=model, nut_map=closed_form(law), sanitize=True, logging=version == 3,
    ) as one:  # fmt: skip
        state, saved = "i", []
        for _ in range(CALLS):
            if rng.random() < 0.25:
                state = "x" if random_values(rng, one) == ERROR else state
                continue
            if state in "xt" and rng.random() < 0.5:
                name = "Reset"
            else:
                legal = [n for n in LEGAL[version] if is_legal(version, n, kind, state)]
                name = rng.choice(legal if rng.random() < 0.85 else list(LEGAL[version]))
            given_arguments = arguments(one, name)
            status = one.call(name, *given_arguments)
            if not is_legal(version, name, kind, state):
                assert status == ERROR, (version, kind, state, name, status)
                state = "x"
                continue
            expected = {UNSUPPORTED.get(name, OK)} | (
                {DISCARD} if name == "DoStep" or name.startswith("Set") else set()
            )
            assert status in expected, (version, kind, state, name, status, one.last)
            good += status <= WARNING
            if name == "ExitInitializationMode":
                state = "e" if kind == ME else "s"
            state = "x" if status == ERROR else TARGET.get(name, state)
            if rng.random() < 0.05:
                saved.append((one.save(), state))
            elif saved and rng.random() < 0.05:
                pointer, state = rng.choice(saved)
                assert one.restore(pointer) == OK
        pointer = one.save()
        content = one.serialize(pointer)
        for _ in range(DAMAGES):
            status, _ = one.deserialize(content[: rng.randrange(len(content))])
            assert status == ERROR
            status, again = one.deserialize(sealed(damaged(rng, content, 24)))
            if status == OK and one.restore(again) == OK:  # another valid state, with which it works
                values = doubles(*[0.0] * len(one.names))
                if one.get_raw(one.vr(*one.names), values) == OK:
                    assert kind == CS or all(map(math.isfinite, values))
    assert sorted(given) == sorted(taken)
    return good


def damaged_maps(rng: random.Random) -> None:
    """Files of which some are refused with a message, the others evaluated."""
    path = compiled_model(NUT_MAP, sanitize=True)
    library = ctypes.CDLL(str(path))
    library.map_from_bytes.restype = c_void_p
    library.model_get.restype = ctypes.c_double
    model = ctypes.create_string_buffer(8192)
    content, message = (path.parent / "nut_map.bin").read_bytes(), ctypes.create_string_buffer(400)
    head = 88 + 8 * 20  # numbers of axes, defaults and law
    starts = [float(v.start or 0.0) for v in VARIABLES]
    start, seen = doubles(*starts), set()
    for n in range(FILES):
        kind = n % 5
        if kind == 0:
            bad = content[: rng.randrange(len(content))]
        elif kind == 1:
            bad = damaged(rng, content, 0)
        elif kind == 2:
            bad = sealed(damaged(rng, content, 88, head))
        elif kind == 3:
            bad = sealed(damaged(rng, content, head))
        else:
            bad = sealed(content + bytes(8) if n % 2 else content[: -8 * rng.randrange(1, 100)])
        found = library.map_from_bytes(bad, c_size_t(len(bad)), 0, b"map", message, c_size_t(400))
        seen.add(found is not None)
        if found is None:
            assert message.value.startswith(b"map")
            continue
        library.model_reset(model, c_void_p(found), start, False)
        for _ in range(5):
            for index, top in enumerate((20000.0, 2000.0, 400.0, 20000.0)):
                library.model_set(model, index, ctypes.c_double(rng.uniform(-0.1, 1.0) * top))
            library.model_step(model, ctypes.c_double(1e-3))
            for index in range(4, 16):
                library.model_get(model, index)
        library.map_free(c_void_p(found))
    assert seen == {True, False}


def main() -> None:
    rng = random.Random(int(sys.argv[1]))
    good = 0
    for model, law in WALKED:
        for _ in range(LIVES):
            for version in (2, 3):
                for kind in STATES:
                    good += one_life(rng, version, kind, model, law)
    damaged_maps(rng)
    print(good)


if __name__ == "__main__":
    main()

"""Random calls, damaged states and damaged map files under sanitizers: native_walk.py SEED.

For a process with the sanitizer preloaded and the folders of the support on the path. The state of each instance is
followed by the table of legal calls: a status that it does not allow ends the program with an exception, an error of
memory with a report.
"""

import math
import random
import struct
import sys
import tempfile
from ctypes import c_size_t
from pathlib import Path

from native_calls import LEGAL, STATES, UNSUPPORTED, arguments, is_legal
from native_library import (
    CS,
    DISCARD,
    ERROR,
    ME,
    NUT_MAP,
    OK,
    WARNING,
    NativeInstance,
    counting_functions,
    doubles,
)
from native_model import put_resources
from synthetic_map import closed_form

from ballscrew_fmu.models import AXIS, FRICTION, MONITOR, TRANSMISSION
from ballscrew_fmu.native_fmu.resource_files import MAP_FILE, checksum
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC

LIVES, CALLS, DAMAGES, FILES = 8, 150, 4, 400  # instances of a kind, calls of each, damaged states, files
WALKED = ((FRICTION, FILM_SHEAR), (MONITOR, FILM_SHEAR), (TRANSMISSION, MECHANISTIC), (AXIS, FILM_SHEAR))
ODD = (math.nan, math.inf, -math.inf, 1e30, -1e300, -1.0, 0.0, 5e-324, 1e29, 1.7e308)
TOPS = {"preload": 20000.0, "speed": 2000.0, "temperature": 400.0, "axial_load": 20000.0}  # beyond the map
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


def damaged_maps(rng: random.Random, folder: Path) -> None:
    """Files of which some are refused with a message, the others evaluated."""
    put_resources(folder, NUT_MAP)
    place, seen = folder / MAP_FILE, set()
    content = place.read_bytes()
    head = 88 + 8 * 20  # numbers of axes, defaults and law
    kinds = (
        lambda: content[: rng.randrange(len(content))],
        lambda: damaged(rng, content, 0),
        lambda: sealed(damaged(rng, content, 88, head)),
        lambda: sealed(damaged(rng, content, head)),
        lambda: sealed(rng.choice((content + bytes(8), content[: -8 * rng.randrange(1, 100)]))),
    )
    for n in range(FILES):
        place.write_bytes(kinds[n % len(kinds)]())
        with NativeInstance(2, resources=str(folder), sanitize=True) as one:
            seen.add(one.handle is not None)
            if one.handle is None:
                assert MAP_FILE in one.last
                continue
            one.start()
            for _ in range(5):
                one.go(**{name: rng.uniform(-0.1, 1.0) * top for name, top in TOPS.items()})
    assert seen == {True, False}


def main() -> None:
    rng = random.Random(int(sys.argv[1]))
    good = 0
    for model, law in WALKED:
        for _ in range(LIVES):
            for version in (2, 3):
                for kind in STATES:
                    good += one_life(rng, version, kind, model, law)
    with tempfile.TemporaryDirectory() as folder:
        damaged_maps(rng, Path(folder))
    print(good)


if __name__ == "__main__":
    main()

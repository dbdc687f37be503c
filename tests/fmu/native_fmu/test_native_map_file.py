"""The reader of the native map file: damaged files, and fuzzing under sanitizers."""

import ctypes
import math
import struct
import subprocess
from pathlib import Path

import pytest
from native_model import compiled_model, sanitized_host
from paths import NATIVE_HOSTS
from synthetic_map import LAWS, make_map

from ballscrew_fmu.native_fmu.map_file import checksum, map_bytes
from ballscrew_tehl.runtime.packed import AXES, DEFAULTS, MECHANISTIC

pytestmark = pytest.mark.slow

NUT_MAP = make_map()
HASH = NUT_MAP.header["content_hash"]
GOOD = map_bytes(NUT_MAP)
FUZZ_COUNT = 6000
HEAD = 88  # [bytes] magic, size, checksum, content hash
LAW = 8 * (3 * len(AXES) + len(DEFAULTS))  # [bytes] axes and defaults, before the law


@pytest.fixture(scope="module")
def reader(tmp_path_factory):
    """Message of the reader for these bytes, None if they are accepted."""
    folder = tmp_path_factory.mktemp("reader")
    library = ctypes.CDLL(str(compiled_model(folder, NUT_MAP)))
    library.map_from_bytes.restype = ctypes.c_void_p
    library.map_read.restype = ctypes.c_void_p

    def read(content: bytes | Path, law: int = 0):
        message = ctypes.create_string_buffer(400)
        room = ctypes.c_size_t(400)
        if isinstance(content, Path):
            found = library.map_read(str(content).encode(), law, message, room)
        else:
            size = ctypes.c_size_t(len(content))
            found = library.map_from_bytes(content, size, law, b"map", message, room)
        if found:
            library.map_free(ctypes.c_void_p(found))
            return None
        return message.value.decode()

    return read


def sealed(content: bytes) -> bytes:
    """The bytes with correct size and checksum."""
    body = content[24:]
    return content[:8] + struct.pack("<QQ", len(content), checksum(body)) + body


def test_valid_file_is_accepted(reader, tmp_path):
    file = tmp_path / "Kugelgewinde m\u00fc+#[1] %20.bin"
    file.write_bytes(GOOD)
    assert reader(GOOD) is None
    assert reader(file) is None
    assert sealed(GOOD) == GOOD


@pytest.mark.parametrize(
    ("damage", "found"),
    [
        (lambda b: b[:20], "not a nut map"),
        (lambda b: b[:50], "truncated"),
        (lambda b: b"X" + b[1:], "not a nut map"),
        (lambda b: b[:-8], "truncated"),
        (lambda b: b + bytes(8), "truncated"),
        (lambda b: b[:500] + bytes([b[500] ^ 16]) + b[501:], "checksum"),
        (lambda b: sealed(b[:-8]), "size does not fit"),
        (lambda b: sealed(b[:HEAD] + struct.pack("<d", -1.0) + b[HEAD + 8 :]), "axis force"),
        (lambda b: sealed(b[: HEAD + 16] + struct.pack("<d", 3.0) + b[HEAD + 24 :]), "axis force"),
        (lambda b: sealed(b[: HEAD + 16] + struct.pack("<d", 1e9) + b[HEAD + 24 :]), "axis force"),
        (lambda b: sealed(b[: HEAD + 16] + struct.pack("<d", 4096.0) + b[HEAD + 24 :]), "size does not fit"),
        (lambda b: sealed(b[: HEAD + LAW] + struct.pack("<d", 2.0) + b[HEAD + LAW + 8 :]), "friction law"),
        (lambda b: sealed(b[: HEAD + LAW] + struct.pack("<d", 0.5) + b[HEAD + LAW + 8 :]), "friction law"),
        (
            lambda b: sealed(b[: HEAD + LAW] + struct.pack("<d", math.nan) + b[HEAD + LAW + 8 :]),
            "friction law",
        ),
        (lambda b: sealed(b[:-8] + struct.pack("<d", float("nan"))), "not finite"),
    ],
)
def test_damaged_file_is_refused(reader, damage, found):
    message = reader(damage(GOOD))
    assert message is not None
    assert found in message


def test_another_map_of_the_same_law_is_accepted(reader):
    assert reader(map_bytes(make_map(2.0))) is None


def test_map_of_another_law_is_refused_with_both_laws(reader):
    other = make_map(law=MECHANISTIC)
    found = (
        f"map: map {other.header['content_hash'][:12]} has the friction law mechanistic, expected film_shear"
    )
    assert reader(map_bytes(other)).startswith(found)
    assert reader(map_bytes(other), law=1) is None
    assert "friction law film_shear, expected mechanistic" in reader(GOOD, law=1)


def test_another_format_is_refused_with_both_formats(reader):
    message = reader(b"BSFMAP01" + GOOD[8:])
    assert f"{len(GOOD)} bytes that begin with 'BSFMAP01'" in message
    assert "begins with 'BSFMAP03'" in message
    assert "begin with '..P.'" in reader(b"\x00\n\x50\xff")


def test_equal_maps_are_one_in_memory_until_the_last_is_freed(tmp_path):
    library = ctypes.CDLL(str(compiled_model(tmp_path, NUT_MAP)))
    library.map_from_bytes.restype = ctypes.c_void_p
    message = ctypes.create_string_buffer(400)

    def get(content):
        return library.map_from_bytes(content, ctypes.c_size_t(len(content)), 0, b"map", message, 400)

    def users(place):
        return ctypes.c_ulong.from_address(place + offset).value

    other = map_bytes(make_map(2.0))
    one = get(GOOD)
    head = ctypes.string_at(one, 1024)
    offset = head.index(HASH.encode()) + 80  # hash of 64 characters and 0, padding, next, then users
    assert users(one) == 1
    assert get(GOOD) == one
    two = get(other)
    assert two != one
    assert (users(one), users(two)) == (2, 1)
    for place in (two, one):  # the head of the list, then what is left
        library.map_free(ctypes.c_void_p(place))
    assert users(one) == 1
    assert get(GOOD) == one
    assert get(GOOD[:-1] + bytes([GOOD[-1] ^ 1])) is None  # damaged: refused although it is in memory
    for _ in range(2):
        library.map_free(ctypes.c_void_p(one))
    library.map_free(None)


def test_missing_file_is_named(reader, tmp_path):
    assert reader(tmp_path / "none.bin") == f"{tmp_path / 'none.bin'}: cannot be opened"


def test_every_flipped_bit_of_the_head_is_found(reader):
    for bit in range(8 * HEAD):
        flipped = bytearray(GOOD)
        flipped[bit // 8] ^= 1 << bit % 8
        assert reader(bytes(flipped)) is not None, bit


@pytest.mark.parametrize("law", LAWS)
def test_fuzzed_files_give_no_sanitizer_report(tmp_path, law):
    try:
        program = sanitized_host(tmp_path, make_map(law=law), NATIVE_HOSTS / "fuzz_map.c")
    except FileNotFoundError as error:
        pytest.skip(str(error))
    run = subprocess.run(
        [program, tmp_path / "nut_map.bin", str(FUZZ_COUNT)], capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0, run.stdout + run.stderr
    refused, accepted = (int(word) for word in run.stdout.split() if word.isdigit())
    assert refused + accepted == FUZZ_COUNT
    assert refused > FUZZ_COUNT // 2
    assert accepted > FUZZ_COUNT // 10  # some damaged files are other valid maps, which are evaluated

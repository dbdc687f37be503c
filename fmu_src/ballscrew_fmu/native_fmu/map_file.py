"""The nut map as file of the native FMUs: resources/nut_map.bin."""

import struct

import numpy as np
from numpy.typing import NDArray

from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import AXES, DEFAULTS, SURFACES, TORQUE_SURFACES, map_hash

MAP_FILE = "nut_map.bin"
MAGIC = b"BSFMAP03"
#: bytes of size and checksum behind it, then characters of the content hash
NUMBERS, HASH_SIZE = "<QQ", 64


def map_bytes(nut_map: NutMap) -> bytes:
    """Magic, size, checksum and content hash, then little-endian doubles: the numbers of the map."""
    body = map_hash(nut_map.header).encode() + map_numbers(nut_map).astype("<f8").tobytes()
    size = len(MAGIC) + struct.calcsize(NUMBERS) + len(body)
    return MAGIC + struct.pack(NUMBERS, size, checksum(body)) + body


def hash_in(data: bytes) -> str:
    """Content hash that such a file states; "" if it is damaged or of another format."""
    begin = len(MAGIC) + struct.calcsize(NUMBERS)
    found = data[begin : begin + HASH_SIZE].decode("ascii", "replace")
    return found if data.startswith(MAGIC) and len(found) == HASH_SIZE else ""


def map_numbers(nut_map: NutMap) -> NDArray[np.float64]:
    """Axes, defaults, law, presliding angle and coefficients of a map, in this order, flat.

    The surfaces needed for a torque are stored apart from the others, speed first and force last: an evaluation reads
    sixteen contiguous rows (native/core/nut_law.h).
    """
    header, arrays = nut_map.header, nut_map.arrays
    numbers = [float(x) for name in AXES for x in header["axes"][name]]
    numbers += [float(header["defaults"][name]) for name in DEFAULTS]
    numbers.append(float(tuple(SURFACES).index(nut_map.law)))
    numbers.append(nut_map.presliding_angle)
    surfaces = arrays["coefficients"].transpose(1, 2, 0, 3)
    parts = [
        np.array(numbers),
        surfaces[..., :TORQUE_SURFACES],
        surfaces[..., TORQUE_SURFACES:],
        arrays["force_coefficients"],
        arrays["separation_coefficients"].T,
        arrays["sharing_coefficients"].transpose(2, 0, 1),
    ]
    return np.concatenate([np.ravel(part) for part in parts])


def checksum(data: bytes) -> int:
    """64-bit FNV-1a hash (Fowler, Noll, Vo) of little-endian words of eight bytes."""
    value = 14695981039346656037
    for word in np.frombuffer(data, dtype="<u8").tolist():
        value = (value ^ word) * 1099511628211 & 0xFFFFFFFFFFFFFFFF
    return value

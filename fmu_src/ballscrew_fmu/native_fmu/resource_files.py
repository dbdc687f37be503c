"""Files in the resources of the native FMUs: the nut map (nut_map.bin), and the screw that an FMU is of (screw.bin).

Both begin with a magic, the size of the file and the checksum of what follows. A map is the same file in the FMUs of
all models and may be replaced by that of another screw; the screw belongs to one FMU.
"""

import re
import struct
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ballscrew_fmu.models import FmuModel
from ballscrew_fmu.variables.friction import origin_text
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import AXES, DEFAULTS, SURFACES, TORQUE_SURFACES, map_hash

MAP_FILE, MAP_MAGIC = "nut_map.bin", b"BSFMAP04"
SCREW_FILE, SCREW_MAGIC = "screw.bin", b"BSFSCR01"
NUMBERS = "<QQ"  # size and checksum behind the magic
HEAD_SIZE = len(MAP_MAGIC) + struct.calcsize(NUMBERS)
HASH_SIZE = 64  # characters of a hash, and of a name or token
ORIGIN_SIZE = 600  # [bytes] of the text of an origin; a message has some more


def _sealed(magic: bytes, body: bytes) -> bytes:
    return magic + struct.pack(NUMBERS, HEAD_SIZE + len(body), checksum(body)) + body


@lru_cache(maxsize=1)  # of one build
def map_bytes(nut_map: NutMap) -> bytes:
    """The content hash, then little-endian doubles: the numbers of the map."""
    return _sealed(
        MAP_MAGIC, map_hash(nut_map.header).encode() + map_numbers(nut_map).astype("<f8").tobytes()
    )


def start_numbers(header: Mapping[str, Any], model: FmuModel) -> list[float]:
    """Start values of all variables, 0 where there is none, then the numbers of the model."""
    return [float(v.start or 0.0) for v in model.variables(header)] + list(model.numbers(header))


def screw_bytes(header: Mapping[str, Any], model: FmuModel, table_hash: str, token: str) -> bytes:
    """Model, hash of its table of variables, token, hash of the map; law; start_numbers; origin of the friction.

    ValueError: the token has characters that are not allowed, or too many.
    """
    if not re.fullmatch(rf"[{{}}\w.-]{{0,{HASH_SIZE}}}", token, re.ASCII):
        raise ValueError(f"token = {token!r}; needs letters, digits, braces, dots and dashes only")
    texts = (model.native_name, table_hash, token, map_hash(header))
    starts = start_numbers(header, model)
    body = b"".join(text.encode().ljust(HASH_SIZE, b"\0") for text in texts)
    body += struct.pack(f"<Q{len(starts)}d", tuple(SURFACES).index(header["law"]), *starts)
    origin = origin_text(header).encode()[: ORIGIN_SIZE - 1].decode(errors="ignore").encode()
    return _sealed(SCREW_MAGIC, body + origin.ljust(ORIGIN_SIZE, b"\0"))


def hash_in(data: bytes) -> str:
    """Content hash that the file of a map states; "" if it is damaged or of another format."""
    result = data[HEAD_SIZE : HEAD_SIZE + HASH_SIZE].decode("ascii", "replace")
    return result if data.startswith(MAP_MAGIC) and len(result) == HASH_SIZE else ""


def map_numbers(nut_map: NutMap) -> NDArray[np.float64]:
    """Axes, defaults, law, presliding angle, preload factor and coefficients of a map, in this order, flat.

    The surfaces needed for a torque are stored apart from the others, speed first and force last: an evaluation reads
    sixteen contiguous rows (native/core/nut_law.h).
    """
    header, arrays = nut_map.header, nut_map.arrays
    numbers = [float(x) for name in AXES for x in header["axes"][name]]
    numbers += [float(header["defaults"][name]) for name in DEFAULTS]
    numbers.append(float(tuple(SURFACES).index(nut_map.law)))
    numbers += [nut_map.presliding_angle, nut_map.preload_factor]
    surfaces = arrays["coefficients"].transpose(1, 2, 0, 3)
    parts = [
        np.array(numbers),
        surfaces[..., :TORQUE_SURFACES],
        surfaces[..., TORQUE_SURFACES:],
        arrays["force_coefficients"],
        arrays["drag_coefficients"],
        arrays["separation_coefficients"].T,
        arrays["sharing_coefficients"].transpose(2, 0, 1),
        arrays["shift_coefficients"],
    ]
    return np.concatenate([np.ravel(part) for part in parts])


def checksum(data: bytes) -> int:
    """64-bit FNV-1a hash (Fowler, Noll, Vo) of little-endian words of eight bytes."""
    value = 14695981039346656037
    for word in np.frombuffer(data, dtype="<u8").tolist():
        value = (value ^ word) * 1099511628211 & 0xFFFFFFFFFFFFFFFF
    return value

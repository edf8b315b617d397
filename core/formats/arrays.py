"""Arrays as .npy bytes under the name of their content: one SHA-256 for project and journal."""

from __future__ import annotations

import hashlib
import math
import threading
import weakref
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.record import freeze

DTYPES = ("|b1", "|i1", "|u1", "<i2", "<u2", "<i4", "<u4", "<i8", "<u8", "<f4", "<f8")
LARGEST_ARRAY = 8 << 30  # bytes
MOST_AXES = 4
_MAGIC = b"\x93NUMPY\x01\x00"


class ArraySpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a file says about an array before its bytes are read."""

    dtype: str
    shape: tuple[int, ...]

    def __post_init__(self) -> None:
        if self.dtype not in DTYPES:
            raise ValueError(f"arrays of dtype {self.dtype[:20]!r} are not allowed")
        if len(self.shape) > MOST_AXES or any(not 0 <= n < 2**40 for n in self.shape):
            raise ValueError("an array has an impossible shape")
        if self.nbytes > LARGEST_ARRAY:
            raise ValueError(f"an array of {self.nbytes} bytes is too large")

    @property
    def nbytes(self) -> int:
        return math.prod(self.shape) * int(self.dtype[2:])

    def header(self) -> bytes:
        """The .npy header (version 1.0) that stands before these bytes; always a multiple of 64 long.

        Files are compared with it instead of being parsed: there is only one header an array can have.
        """
        text = f"{{'descr': '{self.dtype}', 'fortran_order': False, 'shape': {self.shape!r}, }}"
        padding = -(len(_MAGIC) + 2 + len(text) + 1) % 64
        text += " " * padding + "\n"
        return _MAGIC + len(text).to_bytes(2, "little") + text.encode("ascii")


def spec_of(array: NDArray[Any]) -> ArraySpec:
    """The spec of an array; ValueError when its dtype cannot be stored."""
    return ArraySpec(dtype=array.dtype.newbyteorder("<").str, shape=array.shape)


def raw_bytes(array: NDArray[Any]) -> NDArray[np.uint8]:
    """The bytes of a C-contiguous array as they stand in a file, (nbytes,) uint8, shared where possible."""
    return np.ascontiguousarray(array, array.dtype.newbyteorder("<")).reshape(-1).view(np.uint8)


def hash_array(array: NDArray[Any]) -> str:
    """SHA-256 (hex) of the .npy file of `array`, header included: equal only for equal dtype, shape and bytes."""
    digest = hashlib.sha256(spec_of(array).header())
    digest.update(raw_bytes(array).data)
    return digest.hexdigest()


def array_from(payload: bytes, spec: ArraySpec) -> NDArray[Any]:
    """The read-only array in the .npy bytes `payload`, which must be exactly what `spec` says.

    Raises
    ------
    ValueError
        Another header, another length, or booleans other than 0 and 1.
    """
    header = spec.header()
    if len(payload) != len(header) + spec.nbytes or not payload.startswith(header):
        raise ValueError("an array is not what the table says")
    array = np.frombuffer(payload, np.dtype(spec.dtype), offset=len(header)).reshape(spec.shape)
    if spec.dtype == "|b1" and array.size and array.view(np.uint8).max() > 1:
        raise ValueError("an array of truth values holds others than 0 and 1")
    return array if array.flags.aligned else freeze(array.copy())


class ArrayHashes:
    """Remembers the hashes of living read-only arrays by identity, so that what did not change is hashed once."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[weakref.ref[Any], str]] = {}
        self._lock = threading.Lock()

    def of(self, array: NDArray[Any]) -> str:
        """As :func:`hash_array`."""
        with self._lock:
            known = self._known.get(id(array))
        if known is not None and known[0]() is array:
            return known[1]
        digest = hash_array(array)
        key = id(array)
        entry = (weakref.ref(array), digest)
        with self._lock:
            if len(self._known) > 4096:
                self._known = {k: v for k, v in self._known.items() if v[0]() is not None}
            self._known[key] = entry
        return digest

    def remember(self, array: NDArray[Any], digest: str) -> None:
        """Take the hash of an array just read and checked as known."""
        with self._lock:
            self._known[id(array)] = (weakref.ref(array), digest)

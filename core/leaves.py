"""The arrays at the leaves of a tree of records, whatever craft the records belong to."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from core.record import Record

Path = tuple[str | int, ...]


def leaves(value: Any, path: Path = ()) -> Iterator[tuple[Path, np.ndarray]]:
    """Every array under `value` with the way to it (field names and places in tuples), in a fixed order.

    The same array may be met more than once.
    """
    if isinstance(value, np.ndarray):
        yield path, value
    elif isinstance(value, Record):
        for name in value.__struct_fields__:
            yield from leaves(getattr(value, name), (*path, name))
    elif isinstance(value, tuple):
        for i, part in enumerate(value):
            yield from leaves(part, (*path, i))


def array_bytes(*values: Any) -> int:
    """Bytes of the distinct arrays under `values`."""
    return sum({id(a): a.nbytes for value in values for _, a in leaves(value)}.values())


def same_bits(a: Any, b: Any) -> bool:
    """True when two values are equal to the last bit, arrays (dtype, shape, bytes) and numbers alike."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, Record):
        return all(same_bits(getattr(a, n), getattr(b, n)) for n in a.__struct_fields__)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same_bits, a, b))
    if isinstance(a, float):
        return a.hex() == b.hex()
    return bool(a == b)

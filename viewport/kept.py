"""Which of the things on the graphics card serve the next picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from core.record import Record


def matched(kept: Sequence[Any], wanted: Sequence[Any], make: Callable[[Any], Any]) -> list[Any]:
    """Drawables for the wanted things: one with just these arrays, else one that can take them, else a new one.

    Those left over are released.
    """
    spare = list(kept)
    found: list[Any] = [None] * len(wanted)
    for turn in ("holds", "update"):
        for i, thing in enumerate(wanted):
            if found[i] is not None:
                continue
            match = next((d for d in spare if getattr(d, turn)(thing)), None)
            if match is not None:
                spare.remove(match)
                match.update(thing)
                found[i] = match
    for drawable in spare:
        drawable.release()
    return [make(thing) if drawable is None else drawable for drawable, thing in zip(found, wanted, strict=True)]


def same(a: Any, b: Any) -> bool:
    """True when two values hold the very same arrays and equal numbers; tuples and records are looked into.

    Matrices, of up to 16 numbers, are compared by their numbers.
    """
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, Record):
        return all(same(getattr(a, name), getattr(b, name)) for name in a.__struct_fields__)
    if isinstance(a, np.ndarray):
        return a.size <= 16 and np.array_equal(a, b)
    return bool(a == b)

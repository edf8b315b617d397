"""Which of the things on the graphics card serve the next picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any


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
    """True when two values hold the very same arrays and equal numbers; tuples are looked into."""
    if a is b:
        return True
    if isinstance(a, tuple) and isinstance(b, tuple):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    plain = (bool, int, float, str, type(None))
    return isinstance(a, plain) and isinstance(b, plain) and a == b

"""What a hand does to a keyed curve: keys set, moved and taken away, tangents turned. Curve in, curve out."""

from __future__ import annotations

import itertools
from collections.abc import Collection
from typing import Literal

from core.curve import CLOSEST, Curve, Key, Tangent, curve_at
from core.errors import UserError

SAME_FRAME = 1e-3  # a key this near to a frame stands on it


def key_at(curve: Curve, frame: float) -> int | None:
    """The place of the key that stands on a frame, or None."""
    return next((i for i, key in enumerate(curve.keys) if abs(key.frame - frame) <= SAME_FRAME), None)


def with_key(curve: Curve | None, frame: float, value: float | None = None) -> Curve:
    """The curve with a key of `value` (by default what the curve has there) on a frame; a key there keeps its tangents.

    `curve` is None for the first key of all, which needs a value.
    """
    if curve is None:
        return Curve(keys=(Key(frame=frame, value=value or 0.0),))
    number = float(curve_at(curve, frame)) if value is None else value
    at = key_at(curve, frame)
    if at is not None:
        keys = (*curve.keys[:at], curve.keys[at].replace(value=number), *curve.keys[at + 1:])
    else:
        keys = tuple(sorted((*curve.keys, Key(frame=frame, value=number)), key=_frame))
    changed: Curve = curve.replace(keys=keys)
    return changed


def without_keys(curve: Curve, places: Collection[int]) -> Curve | None:
    """The curve without some of its keys; None when there is none left."""
    keys = tuple(key for i, key in enumerate(curve.keys) if i not in places)
    return curve.replace(keys=keys) if keys else None


def moved_keys(curve: Curve, places: Collection[int], frames: float, value: float) -> tuple[Curve, frozenset[int]]:
    """The curve with some of its keys moved in time and value, and where those keys stand in it now.

    They may pass other keys.

    Raises
    ------
    UserError
        A key would land on another one.
    """
    moved = [
        (key.replace(frame=key.frame + frames, value=key.value + value), True) if i in places else (key, False)
        for i, key in enumerate(curve.keys)
    ]
    moved.sort(key=lambda item: item[0].frame)
    keys = tuple(key for key, _ in moved)
    if any(b.frame - a.frame < CLOSEST for a, b in itertools.pairwise(keys)):
        raise UserError("Two keys cannot stand on one frame; move it beside the other one.")
    return curve.replace(keys=keys), frozenset(i for i, (_, mine) in enumerate(moved) if mine)


def with_tangents(curve: Curve, places: Collection[int], kind: Tangent) -> Curve:
    """The curve with both tangents of some of its keys of one kind."""
    keys = tuple(
        key.replace(arrive=kind, leave=kind) if i in places else key for i, key in enumerate(curve.keys))
    changed: Curve = curve.replace(keys=keys)
    return changed


def with_handle(
    curve: Curve, place: int, side: Literal["arrive", "leave"], handle: tuple[float, float], broken: bool = False,
) -> Curve:
    """The curve with one handle of a key turned, its tangents free; the other handle turns along unless `broken`.

    handle : (frames, value) from the key; it never points backwards in time.
    """
    key = curve.keys[place]
    frames = min(handle[0], 0.0) if side == "arrive" else max(handle[0], 0.0)
    changes: dict[str, object] = {side: "free", f"{side}_handle": (frames, handle[1])}
    if not broken:
        other = "leave" if side == "arrive" else "arrive"
        reach = handle_of(curve, place, other)[0]
        if frames != 0.0:
            changes |= {other: "free", f"{other}_handle": (reach, reach * handle[1] / frames)}
    keys = (*curve.keys[:place], key.replace(**changes), *curve.keys[place + 1:])
    changed: Curve = curve.replace(keys=keys)
    return changed


def handle_of(curve: Curve, place: int, side: Literal["arrive", "leave"] | str) -> tuple[float, float]:
    """Where a handle ends, (frames, value) from its key: its own when free, else a third of the way to the neighbour
    in the direction in which the curve goes."""
    key = curve.keys[place]
    if getattr(key, side) == "free":
        own: tuple[float, float] = getattr(key, f"{side}_handle")
        return own
    step = -1 if side == "arrive" else 1
    there = place + step
    inside = 0 <= there < len(curve.keys)
    reach = abs(curve.keys[there].frame - key.frame) / 3.0 if inside else 5.0
    small = min(reach, 1.0) * 1e-3
    if not inside or getattr(key, side) == "step":
        return step * reach, 0.0
    slope = (float(curve_at(curve, key.frame + step * small)) - key.value) / (step * small)
    return step * reach, step * reach * slope


def _frame(key: Key) -> float:
    return key.frame

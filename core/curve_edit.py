"""What a hand does to a keyed curve: keys set, moved and taken away, tangents turned. Curve in, curve out."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterable
from typing import Literal

import numpy as np

from core.curve import CLOSEST, HANDLED, Array, Curve, Key, Tangent, control_points, curve_at
from core.errors import UserError

FREE_REACH = 5.0  # frames: a handle that no key is in the way of
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
    return _changed(curve, places, lambda key: key.replace(frame=key.frame + frames, value=key.value + value))


def scaled_keys(
    curve: Curve, places: Collection[int], about: tuple[float, float], factors: tuple[float, float],
) -> tuple[Curve, frozenset[int]]:
    """The curve with some of its keys and their handles scaled, and where those keys stand in it now.

    Parameters
    ----------
    about : (frame, value) that stays. factors : of time and value; a negative one of time runs them backwards.

    Raises
    ------
    UserError
        Keys would land on one another.
    """
    (frame, value), (slower, higher) = about, factors

    def scaled(key: Key) -> Key:
        arrive, leave = (_times(handle, factors) for handle in (key.arrive_handle, key.leave_handle))
        moved = {"frame": frame + (key.frame - frame) * slower, "value": value + (key.value - value) * higher}
        if slower >= 0.0:
            return key.replace(**moved, arrive_handle=arrive, leave_handle=leave)
        return key.replace(
            **moved, arrive=key.leave, leave=key.arrive, arrive_handle=leave, leave_handle=arrive)

    return _changed(curve, places, scaled)


def set_keys(
    curve: Curve, places: Collection[int], frame: float | None = None, value: float | None = None,
) -> tuple[Curve, frozenset[int]]:
    """The curve with some of its keys on a value, and moved so that the first of them stands on a frame.

    Raises
    ------
    UserError
        A key would land on another one.
    """
    first = min((curve.keys[i].frame for i in places), default=0.0)
    frames = 0.0 if frame is None else frame - first
    return _changed(curve, places, lambda key: key.replace(
        frame=key.frame + frames, value=key.value if value is None else value))


def snapped_keys(curve: Curve, places: Collection[int]) -> tuple[Curve, frozenset[int]]:
    """The curve with some of its keys on the nearest whole frames, and where those keys stand in it now.

    Of several that land on one frame the nearest to it stays; a key that does not move gives way.
    """
    snapped = [curve.keys[i].replace(frame=float(round(curve.keys[i].frame)))
               for i in sorted(places, key=lambda i: abs(curve.keys[i].frame - round(curve.keys[i].frame)))]
    return _put(tuple(key for i, key in enumerate(curve.keys) if i not in places), snapped, curve)


def pasted_keys(curve: Curve | None, keys: Iterable[Key]) -> tuple[Curve, frozenset[int]]:
    """The curve with further keys, and where they stand in it; keys on their frames give way.

    `curve` is None when there is none yet; of `keys` there is at least one.
    """
    return _put(() if curve is None else curve.keys, list(keys), curve)


def with_tangents(curve: Curve, places: Collection[int], kind: Tangent) -> Curve:
    """The curve with both tangents of some of its keys of one kind.

    What follows handles begins with those that are shown; "aligned" puts both on the line through their ends.
    """

    arrives, leaves = (side.tolist() for side in handles_of(curve))

    def turned(place: int, key: Key) -> Key:
        changes: dict[str, object] = {"arrive": kind, "leave": kind}
        if kind in HANDLED:
            arrive, leave = tuple(arrives[place]), tuple(leaves[place])
            reach = leave[0] - arrive[0]
            if kind == "aligned" and reach > 0.0:
                slope = (leave[1] - arrive[1]) / reach
                arrive, leave = (arrive[0], arrive[0] * slope), (leave[0], leave[0] * slope)
            changes |= {"arrive_handle": arrive, "leave_handle": leave}
        made: Key = key.replace(**changes)
        return made

    keys = tuple(turned(i, key) if i in places else key for i, key in enumerate(curve.keys))
    changed: Curve = curve.replace(keys=keys)
    return changed


def with_handle(
    curve: Curve, place: int, side: Literal["arrive", "leave"], handle: tuple[float, float], broken: bool = False,
) -> Curve:
    """The curve with one handle of a key turned.

    The other one turns along, both "aligned" from then on, unless the tangent is "free" already or is made so by
    `broken`.

    handle : (frames, value) from the key; it never points backwards in time.
    """
    key = curve.keys[place]
    frames = min(handle[0], 0.0) if side == "arrive" else max(handle[0], 0.0)
    alone = broken or getattr(key, side) == "free"
    kind = "free" if alone else "aligned"
    changes: dict[str, object] = {side: kind, f"{side}_handle": (frames, handle[1])}
    other = "leave" if side == "arrive" else "arrive"
    if alone:
        if getattr(key, other) == "aligned":
            changes |= {other: "free"}
    else:
        reach, rise = handle_of(curve, place, other)
        changes |= {other: kind, f"{other}_handle": (reach, reach * handle[1] / frames if frames else rise)}
    keys = (*curve.keys[:place], key.replace(**changes), *curve.keys[place + 1:])
    changed: Curve = curve.replace(keys=keys)
    return changed


def handle_of(curve: Curve, place: int, side: Literal["arrive", "leave"] | str) -> tuple[float, float]:
    """Where a handle ends, (frames, value) from its key: its own where it has one, else a third of the way to the
    neighbour in the direction in which the curve goes."""
    frames, value = handles_of(curve)[0 if side == "arrive" else 1][place]
    return float(frames), float(value)


def handles_of(curve: Curve) -> tuple[Array, Array]:
    """All handles before and after the keys, (K, 2) each, as :func:`handle_of`."""
    count = len(curve.keys)
    arrive, leave = np.tile([-FREE_REACH, 0.0], (count, 1)), np.tile([FREE_REACH, 0.0], (count, 1))
    if count > 1:
        x, y = control_points(curve)
        leave[:-1] = np.stack([x[:, 1] - x[:, 0], y[:, 1] - y[:, 0]], axis=1)
        arrive[1:] = np.stack([x[:, 2] - x[:, 3], y[:, 2] - y[:, 3]], axis=1)
    for i, key in enumerate(curve.keys):
        if key.leave == "step":
            leave[i, 1] = 0.0
            if i + 1 < count:
                arrive[i + 1, 1] = 0.0
    for i, key in enumerate(curve.keys):
        if key.arrive in HANDLED:
            arrive[i] = key.arrive_handle  # as long as it is, even where it is shortened
        if key.leave in HANDLED:
            leave[i] = key.leave_handle
    return arrive, leave


def _changed(curve: Curve, places: Collection[int], change: Callable[[Key], Key]) -> tuple[Curve, frozenset[int]]:
    """The curve with some of its keys changed, and where those stand; UserError when two meet."""
    try:
        moved = [(change(key), True) if i in places else (key, False) for i, key in enumerate(curve.keys)]
    except ValueError:
        raise UserError("A key cannot go as far as that; choose a nearer frame and a smaller value.") from None
    moved.sort(key=lambda item: item[0].frame)
    keys = tuple(key for key, _ in moved)
    if any(b.frame - a.frame < CLOSEST for a, b in itertools.pairwise(keys)):
        raise UserError("Two keys cannot stand on one frame; move it beside the other one.")
    return curve.replace(keys=keys), frozenset(i for i, (_, mine) in enumerate(moved) if mine)


def _put(kept: Iterable[Key], new: Iterable[Key], curve: Curve | None) -> tuple[Curve, frozenset[int]]:
    """New keys (the first on a frame counts) among kept ones, which give way to them; and where the new ones stand."""
    placed: list[Key] = []
    taken: set[int] = set()
    for key in new:
        if not _near(key.frame, taken):
            placed.append(key)
            taken.add(round(key.frame / SAME_FRAME))
    old = [key for key in kept if not _near(key.frame, taken)]
    keys = sorted((*old, *placed), key=_frame)
    made = Curve(keys=tuple(keys)) if curve is None else curve.replace(keys=tuple(keys))
    mine = {id(key) for key in placed}
    return made, frozenset(i for i, key in enumerate(keys) if id(key) in mine)


def _near(frame: float, taken: set[int]) -> bool:
    """Whether a frame is one of those taken, which are counted in :data:`SAME_FRAME`."""
    slot = round(frame / SAME_FRAME)
    return not taken.isdisjoint((slot - 1, slot, slot + 1))


def _times(handle: tuple[float, float], factors: tuple[float, float]) -> tuple[float, float]:
    return handle[0] * factors[0], handle[1] * factors[1]


def _frame(key: Key) -> float:
    return key.frame

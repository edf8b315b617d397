"""Where the feathers of wings are: anchors carried by the skin, the fan between its two ends, and what a hand adds."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.curve import Curve
from core.feather.coat.frames import frames_of, unit
from core.feather.coat.posing import BEND, CUP, LENGTH, LIFT, POSE, ROLL
from core.feather.coat.wing import (
    OFFSET_FIELDS,
    OFFSET_VALUES,
    ROW_FIELDS,
    ROW_VALUES,
    WING_FIELDS,
    WING_NAMES,
    Anchor,
    Wing,
    WingRow,
    first_id,
)
from core.random import rand
from core.value import Formula, Value, evaluate_within, names_used

Array = NDArray[np.float64]
VARIED = 0.012, 0.02  # radians of direction and share of the length, by which feathers of a row differ


class WingFeathers(NamedTuple):
    """N feathers of wings at one frame.

    ids : (N,) int32, ascending. roots : (N, 3), frames : (N, 3, 3) float32, rows right, along, out. poses : (N, 6).
    widths : (N,) factors on vanes. flipped : (N,) bool, mirrored left to right. parts : (N,) of the bird.
    """

    ids: NDArray[np.int32]
    roots: NDArray[np.float32]
    frames: NDArray[np.float32]
    poses: Array
    widths: Array
    flipped: NDArray[np.bool_]
    parts: NDArray[np.str_]


def lay_wings(
    wings: tuple[Wing, ...], rest: NDArray[np.float32], posed: NDArray[np.float32], frame: float
) -> WingFeathers:
    """The feathers of wings on a skin whose points are (V, 3) at rest and posed, metres."""
    rows: list[tuple[Any, ...]] = []
    for wing in sorted((one for one in wings if one.rows), key=lambda one: one.id):
        moves = [anchor_move(anchor, rest, posed) for anchor in wing.anchors]
        upper = _upper(wing, moves)
        for row in sorted(wing.rows, key=lambda one: one.id):
            if row.count:
                rows.append(_lay_row(wing, row, moves, frame, upper))
    if not rows:
        none = np.zeros((0, 3), np.float32)
        return WingFeathers(
            np.zeros(0, np.int32), none, np.zeros((0, 3, 3), np.float32), np.zeros((0, POSE)), np.zeros(0),
            np.zeros(0, np.bool_), np.zeros(0, np.str_))
    ids, roots, frames, poses, widths, flipped, parts = (np.concatenate(c) for c in zip(*rows, strict=True))
    return WingFeathers(
        ids, np.ascontiguousarray(roots, np.float32), np.ascontiguousarray(frames, np.float32), poses, widths, flipped,
        parts)


def anchor_move(anchor: Anchor, rest: NDArray[np.float32], posed: NDArray[np.float32]) -> tuple[Array, Array]:
    """The rotation (3, 3) and shift (3,) that carry a patch of skin from rest as nearly as one can: x -> R x + t.

    Least squares (Kabsch, "A solution for the best rotation to relate two sets of vectors", 1976).
    """
    if posed is rest:
        return np.eye(3), np.zeros(3)
    a, b = rest[anchor.vertices].astype(np.float64), posed[anchor.vertices].astype(np.float64)
    at, to = a.mean(axis=0), b.mean(axis=0)
    u, _, vt = np.linalg.svd((a - at).T @ (b - to))
    turn = vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T)) or 1.0]) @ u.T
    return turn, to - turn @ at


def _upper(wing: Wing, moves: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Where the upper side of a wing faces, (3,) at rest and now: the mean of the row that was made first."""
    first = min(wing.rows, key=lambda row: row.id)
    at_rest = first.normals.astype(np.float64)
    quills = [row for row in wing.rows if row.normals[0] @ first.normals[0] > 0.0 and row.follow == 1.0] or [first]
    now = [moves[a][0] @ normal.astype(np.float64) for row in quills for a, normal in zip(
        row.anchors, row.normals, strict=True)]
    return unit(at_rest.mean(axis=0)), unit(np.mean(now, axis=0))


def _lay_row(
    wing: Wing, row: WingRow, moves: list[tuple[Array, Array]], frame: float, upper: tuple[Array, Array]
) -> tuple[Any, ...]:
    count = row.count
    k = np.linspace(0.0, 1.0, count) if count > 1 else np.full(1, 0.5)
    number = np.arange(1, count + 1)
    ids = (first_id(wing, row) + np.arange(count)).astype(np.int32)
    at = _stations(row, k)
    turns = np.stack([moves[a][0] for a in row.anchors])
    places = np.einsum("sij,sj->si", turns, row.places.astype(np.float64)) + np.stack(
        [moves[a][1] for a in row.anchors])
    normals = unit(_mixed(np.einsum("sij,sj->si", turns, row.normals.astype(np.float64)), at))
    normals_at_rest = unit(_mixed(row.normals.astype(np.float64), at))
    shares, lengths, widths = (
        _mixed(column.astype(np.float64)[:, None], at)[:, 0] for column in (row.shares, row.lengths, row.widths))
    inner, outer = np.array(wing.inner_direction), np.array(wing.outer_direction)
    inner_now, outer_now = moves[wing.inner][0] @ inner, moves[wing.outer][0] @ outer
    opened = _opened(inner, outer, normals_at_rest, inner_now, outer_now, normals)
    share_open = min(max(opened, 0.0), 1.0)
    if wing.kind == "wing":  # folded feathers lie in one plane, so that none stands through another
        over = 1.0 if normals_at_rest[0] @ upper[0] >= 0.0 else -1.0
        normals = unit(share_open * normals + (1.0 - share_open) * over * upper[1])
    known = {"k": k, "number": number, "open": opened, "frame": frame}
    given = {name: evaluate_within(getattr(row, name), ROW_FIELDS[name], frame, known) for name in ROW_VALUES}
    added = {name: np.broadcast_to(given[name], count).astype(np.float64) for name in ROW_VALUES}
    for offset in row.offsets:
        if offset.number <= count:
            one = {**known, "k": k[offset.number - 1], "number": offset.number}
            for name in OFFSET_VALUES:
                value = evaluate_within(getattr(offset, name), OFFSET_FIELDS[name], frame, one)
                added[name][offset.number - 1] += float(value)
    fan = float(evaluate_within(wing.fan, WING_FIELDS["fan"], frame, {}))
    shares_now = wing.middle + (shares - wing.middle) * fan
    resting, outward = _fan(inner, outer, normals_at_rest, shares)
    direction, _ = _fan(inner_now, outer_now, normals, shares_now)
    if row.follow < 1.0:
        turn = _mixed(turns.reshape(len(turns), 9), at).reshape(count, 3, 3)
        stays = _square(np.einsum("nij,nj->ni", turn, resting), normals)
        angle = row.follow * _angle(stays, direction, normals)
        direction = _turned(stays, normals, angle)
    varied = VARIED[0] * (2.0 * rand(ids, 11) - 1.0)
    direction = _turned(direction, normals, outward * (added["spread"] + varied))
    frames = frames_of(direction, normals)
    length = lengths * added["length"] * (1.0 + VARIED[1] * (2.0 * rand(ids, 12) - 1.0))
    across = np.arange(count) - row.top * (count - 1)
    height = row.height - row.step * np.abs(across)
    roots = _mixed(places, at) + height[:, None] * normals
    # a vane's narrow side is its left; outward it shall look, in a tail away from the middle
    flipped = np.full(count, outward < 0.0)
    if wing.kind == "tail":
        flipped ^= shares < wing.middle
    side = np.where(flipped, -1.0, 1.0)
    poses = np.zeros((count, POSE))
    poses[:, LENGTH] = length
    poses[:, LIFT] = added["lift"]
    poses[:, ROLL] = -side * (row.roll * share_open + added["twist"])
    poses[:, BEND] = -added["bend"] / length
    poses[:, CUP] = row.cup
    return ids, roots, frames, poses, widths * added["width"], flipped, np.full(count, row.part)


def _stations(row: WingRow, k: Array) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Between which two stations a feather at `k` (n,) of the row stands, evenly by distance at rest, and how far."""
    if len(row.places) == 1:
        none = np.zeros(len(k), np.intp)
        return none, none, np.zeros(len(k))
    steps = np.linalg.norm(np.diff(row.places.astype(np.float64), axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(np.maximum(steps, 1e-9))])
    at = k * way[-1]
    low = np.clip(np.searchsorted(way, at, side="right") - 1, 0, len(way) - 2)
    return low, low + 1, (at - way[low]) / (way[low + 1] - way[low])


def _mixed(values: Array, at: tuple[NDArray[np.intp], NDArray[np.intp], Array]) -> Array:
    low, high, share = at
    return np.asarray(values[low] * (1.0 - share[:, None]) + values[high] * share[:, None])


def _fan(inner: Array, outer: Array, normals: Array, shares: Array) -> tuple[Array, float]:
    """Directions (n, 3) between the ends of the fan, in the plane of each normal, and the sign that turns outward."""
    first = _square(np.broadcast_to(inner, normals.shape), normals)
    angle = _angle(first, _square(np.broadcast_to(outer, normals.shape), normals), normals)
    return _turned(first, normals, shares * angle), 1.0 if float(np.median(angle)) >= 0.0 else -1.0


def _opened(
    inner: Array, outer: Array, normals: Array, inner_now: Array, outer_now: Array, normals_now: Array
) -> float:
    """How far a fan is open: its angle over that at rest."""
    (was, now) = (
        float(np.median(_angle(_square(np.broadcast_to(a, n.shape), n), _square(np.broadcast_to(b, n.shape), n), n)))
        for a, b, n in ((inner, outer, normals), (inner_now, outer_now, normals_now)))
    return now / was if abs(was) > 1e-6 else 1.0


def _square(vectors: Array, normals: Array) -> Array:
    return unit(vectors - normals * np.einsum("nc,nc->n", vectors, normals)[:, None])


def _angle(a: Array, b: Array, normals: Array) -> Array:
    """The angle (n,) from a to b about the normals, -pi .. pi."""
    return np.asarray(np.arctan2(np.einsum("nc,nc->n", np.cross(a, b), normals), np.einsum("nc,nc->n", a, b)))


def _turned(vectors: Array, normals: Array, angle: Array) -> Array:
    """Vectors square to normals turned about them."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.asarray(c * vectors + s * np.cross(normals, vectors))


def wings_move(wings: tuple[Wing, ...]) -> bool:
    """True when anything of wings depends on the frame by itself."""
    found: list[Value] = [wing.fan for wing in wings]
    for wing in wings:
        for row in wing.rows:
            found += [getattr(row, name) for name in ROW_VALUES]
            found += [getattr(offset, name) for offset in row.offsets for name in OFFSET_VALUES]
    return any(
        isinstance(value.base, Curve) or (isinstance(value.base, Formula) and "frame" in names_used(value))
        for value in found)


def check_names_of(value: Value) -> set[str]:
    """The names a value of a wing reads that no wing has; they come to nothing."""
    return set(names_used(value)) - set(WING_NAMES)

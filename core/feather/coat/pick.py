"""Which feather a line of sight meets first."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from core.feather.coat.winged import Laid

Array = NDArray[np.float64]


class FeatherHit(NamedTuple):
    """A feather under a line of sight.

    row : of the coat. id : of the feather. along : 0 at the root .. 1 at the tip. distance : metres from the eye.
    """

    row: int
    id: int
    along: float
    distance: float


def feather_under(laid: Laid, origin: ArrayLike, direction: ArrayLike, within: float = np.inf) -> FeatherHit | None:
    """The nearest feather that is shown on a line from `origin` (3,) along the unit `direction` (3,), metres.

    within : feathers farther than this are not looked at (the skin hides them).
    """
    start, way = np.asarray(origin, np.float64), np.asarray(direction, np.float64)
    vanes = laid.layered.vanes
    boxes = laid.layered.boxes[:, -1].astype(np.float64)
    rows = np.flatnonzero(laid.shown & _meets_boxes(boxes[:, :3], boxes[:, 3:], start, way, within))
    best: FeatherHit | None = None
    last = vanes.shape[1] - 1
    for row in rows:
        distance, along = _first_hit(vanes[row].astype(np.float64), start, way)
        if distance < (within if best is None else best.distance):
            best = FeatherHit(int(row), int(laid.ids[row]), along / last, distance)
    return best


def _meets_boxes(low: Array, high: Array, start: Array, way: Array, within: float) -> NDArray[np.bool_]:
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (low - start) / way, (high - start) / way
    one, other = np.fmin(one, other), np.fmax(one, other)  # what is nan lies in the plane of a face: no bound
    near, far = np.nanmax(one, axis=1, initial=0.0), np.nanmin(other, axis=1, initial=within)
    return np.asarray(near <= far)


def _first_hit(vane: Array, start: Array, way: Array) -> tuple[float, float]:
    """Metres to where a line first meets a vane (R, C, 3), inf where it does not, and how many rows from its root.

    Möller and Trumbore, Fast minimum storage ray-triangle intersection (1997), from both sides.
    """
    a, b, c, d = vane[:-1, :-1], vane[:-1, 1:], vane[1:, :-1], vane[1:, 1:]
    corners = np.stack([np.stack([a, b, c], axis=2), np.stack([d, c, b], axis=2)])  # (2, R-1, C-1, 3, 3)
    u_edge, v_edge = corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    across = np.cross(way, v_edge)
    det = (u_edge * across).sum(axis=-1)
    flat = 1e-9 * np.linalg.norm(u_edge, axis=-1) * np.linalg.norm(v_edge, axis=-1)
    safe = np.where(np.abs(det) <= flat, np.inf, det)  # seen from the side, or without an area
    to = start - corners[..., 0, :]
    u = (to * across).sum(axis=-1) / safe
    other = np.cross(to, u_edge)
    v, distance = (other @ way) / safe, (other * v_edge).sum(axis=-1) / safe
    hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (distance > 0.0) & np.isfinite(safe)
    distance = np.where(hit, distance, np.inf)
    best = np.unravel_index(int(distance.argmin()), distance.shape)
    row = float(best[1])
    along = row + float(v[best]) if best[0] == 0 else row + 1.0 - float(u[best])
    return float(distance[best]), along

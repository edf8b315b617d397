"""The comb's benchmark: five hair styles on a plane and on a sphere, each to be reached in few passes.

500 strands of 16 points, length U(.85, 1.15), on the plane z = 0 or on the cap of a sphere of radius 4. A pass is one
run over all parallel lanes. The error is the angle to the target, averaged over segments, then over strands.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.groom.guides import Guides
from core.groom.region import View
from core.mesh.distance_field import DistanceField
from core.mesh.roots import Roots
from core.record import freeze

Array = NDArray[np.float64]
BALL = 4.0  # radius of the sphere; its top is the origin
CENTRE = np.array([0.0, 0.0, -BALL])
PIXELS = 200.0  # per unit
SIZE = 1600
PASSES = 5


def distance(points: Array, sphere: bool) -> Array:
    if not sphere:
        return points[..., 2]
    return np.linalg.norm(points - CENTRE, axis=-1) - BALL


def normals(points: Array, sphere: bool) -> Array:
    if not sphere:
        return np.broadcast_to([0.0, 0.0, 1.0], points.shape).copy()
    d = points - CENTRE
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def field_of(sphere: bool, cell: float = 0.08) -> DistanceField:
    """The exact distance, sampled on a grid."""
    low, high = np.array([-2.8, -2.8, -1.4]), np.array([3.8, 2.8, 1.6])
    dims = np.ceil((high - low) / cell).astype(int) + 1
    grid = np.stack(np.meshgrid(*[low[k] + cell * np.arange(dims[k]) for k in range(3)], indexing="ij"), axis=-1)
    return DistanceField(low, cell, 10.0, freeze(distance(grid, sphere).astype(np.float32)))


def orthographic(side: bool) -> View:
    """Looking down on the skin (screen x, y = x, y) or along +y at it (screen x, y = x, z), PIXELS per unit."""
    s = 2.0 * PIXELS / SIZE
    m = np.eye(4)
    m[0, :3], m[1, :3], m[2, :3] = [s, 0, 0], [0, s, 0], [0, 0, -0.1]
    if side:
        m[1, :3], m[2, :3] = [0, 0, s], [0, 0.1, 0]
    return View(m, SIZE, SIZE)


def to_pixels(plane: Array) -> Array:
    """(K, 2) units across and up on the screen to pixels."""
    return np.stack([0.5 * SIZE - 0.5 + PIXELS * plane[:, 0], 0.5 * SIZE - 0.5 - PIXELS * plane[:, 1]], axis=-1)


def hair(
    seed: int, sphere: bool, half: tuple[float, float], upright: bool, count: int = 500, points: int = 16
) -> Guides:
    """Strands standing up (tilt 8 degrees, bend 0 .. 25) or lying flat along +x (elevation 20, bend 15)."""
    rng = np.random.default_rng(seed)
    roots = np.stack([rng.uniform(-half[0], half[0], count), rng.uniform(-half[1], half[1], count), np.zeros(count)], 1)
    if sphere:
        roots[:, 2] = np.sqrt(BALL**2 - (roots[:, :2] ** 2).sum(1)) - BALL
    n = normals(roots, sphere)
    t = np.array([1.0, 0, 0]) - n[:, :1] * n
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    frames = np.stack([t, np.cross(n, t), n], axis=1)
    length = rng.uniform(0.85, 1.15, count)
    s = (np.arange(points - 1) + 0.5) / (points - 1)
    if upright:
        tilt, way = np.abs(rng.normal(0, np.radians(8), count)), rng.uniform(0, 2 * np.pi, count)
        bend, bend_way = rng.uniform(0, np.radians(25), count), rng.uniform(0, 2 * np.pi, count)
        angle = tilt[:, None] * np.stack([np.cos(way), np.sin(way)], 1)
        bent = np.stack([np.cos(bend_way), np.sin(bend_way)], 1)
        angle = angle[:, None] + (bend[:, None] * s)[..., None] * bent[:, None]
        size = np.linalg.norm(angle, axis=-1, keepdims=True)
        local = np.concatenate([np.sin(size) * angle / np.maximum(size, 1e-12), np.cos(size)], axis=-1)
    else:
        up = np.radians(20) + np.radians(4) * rng.normal(size=count)
        bend = np.radians(15) * rng.uniform(-1, 1, count)
        azimuth = np.radians(8) * rng.normal(size=count)[:, None] + bend[:, None] * s
        e = np.broadcast_to(up[:, None], azimuth.shape)
        local = np.stack([np.cos(e) * np.cos(azimuth), np.cos(e) * np.sin(azimuth), np.sin(e)], axis=-1)
    q = np.einsum("gsk,gkc->gsc", local, frames)
    x = np.concatenate([np.zeros((count, 1, 3)), np.cumsum(q * (length / (points - 1))[:, None, None], axis=1)], 1)
    return guides_of(roots[:, None] + x, frames)


def guides_of(points: Array, frames: Array) -> Guides:
    """Guides with bare roots (enough for kernels that only read frames)."""
    count = len(points)
    roots = Roots(
        faces=np.zeros(count, np.int32), corners=np.tile(np.arange(3, dtype=np.int32), (count, 1)),
        weights=np.tile(np.array([1, 0, 0], np.float32), (count, 1)), uvs=np.zeros((count, 2), np.float32),
        frames=frames.astype(np.float32),
    )
    return Guides(
        ids=np.arange(count, dtype=np.int32), roots=roots, points=points.astype(np.float32),
        hold=np.zeros(points.shape[:2], np.float32), selected=np.zeros(count, bool), frozen=np.zeros(count, bool),
        next_id=count,
    )


class Target(NamedTuple):
    name: str
    half: tuple[float, float]
    upright: bool
    side_view: bool
    radius: float
    threshold: float
    lanes: Callable[[bool], list[Array]]
    error: Callable[[Array, Array, bool], Array]


def _line(a: tuple[float, float], b: tuple[float, float], curve: Callable[[Array], Array] | None = None) -> Array:
    t = np.linspace(0, 1, 200)[:, None]
    p = np.asarray(a) * (1 - t) + np.asarray(b) * t
    return p if curve is None else np.stack([p[:, 0], curve(p[:, 0])], axis=1)


def _angle(a: Array, b: Array) -> Array:
    cross = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.degrees(np.arctan2(cross, (a * b).sum(-1)))


def _parts(points: Array) -> tuple[Array, Array, Array]:
    """Unit segments, their middles and how far along the strand these are."""
    d = np.diff(points, axis=1)
    size = np.linalg.norm(d, axis=-1)
    s = (np.cumsum(size, axis=1) - 0.5 * size) / size.sum(axis=1, keepdims=True)
    return d / size[..., None], 0.5 * (points[:, 1:] + points[:, :-1]), s


def _mean(error: Array, where: Array) -> Array:
    return (error * where).sum(axis=1) / np.maximum(where.sum(axis=1), 1)


def _along(points: Array, sphere: bool, wanted: Array, above: float) -> Array:
    q, middle, s = _parts(points)
    n = normals(middle, sphere)
    t = wanted - (wanted * n).sum(-1, keepdims=True) * n
    return _mean(_angle(q, t / np.linalg.norm(t, axis=-1, keepdims=True)), s > above)


def _sweep_lanes(sphere: bool) -> list[Array]:
    if not sphere:
        return [_line((-1.6, 0.35), (2.4, 0.35))]
    a = np.linspace(-1.6, 2.4, 200) / BALL
    return [np.stack([(BALL + 0.35) * np.sin(a), (BALL + 0.35) * np.cos(a) - BALL], axis=1)]


def _s_error(points: Array, start: Array, sphere: bool) -> Array:
    q, middle, s = _parts(points)
    tangent = np.stack([np.ones_like(s), 0.24 * np.pi * np.cos(2 * np.pi * middle[..., 0]), np.zeros_like(s)], axis=-1)
    flat = q * [1.0, 1.0, 0.0]
    return _mean(_angle(flat, tangent), s > 0.2)


def _part_error(points: Array, start: Array, sphere: bool) -> Array:
    side = np.where(points[:, :1, 1:2] >= 0, 1.0, -1.0) * np.array([0.0, 1.0, 0.0])
    return _along(points, sphere, side, 0.3)


def _tips_error(points: Array, start: Array, sphere: bool) -> Array:
    q, middle, s = _parts(points)
    base = _mean(_angle(q, _parts(start)[0]), s < 0.45)
    n = normals(middle, sphere)
    t = np.array([1.0, 0, 0]) - n[..., :1] * n
    t /= np.linalg.norm(t, axis=-1, keepdims=True)
    azimuth = np.degrees(np.arctan2((q * np.cross(n, t)).sum(-1), (q * t).sum(-1)))
    outside = np.maximum(0, np.maximum(60 - azimuth, azimuth - 110))
    return np.maximum(base, _mean(outside, s > 0.75))


X = np.array([1.0, 0.0, 0.0])
TARGETS = (
    Target("sweep", (1.0, 0.3), True, True, 0.35, 12, _sweep_lanes, lambda p, s, b: _along(p, b, X, 0.3)),
    Target("S", (0.1, 0.9), False, False, 0.3, 12, lambda b: [
        _line((-0.3, 0), (1.35, 0), lambda x, y=y: y + 0.12 * np.sin(2 * np.pi * x))
        for y in np.arange(-0.96, 0.97, 0.24)], _s_error),
    Target("flat", (0.8, 0.8), True, False, 0.4, 12, lambda b: [
        _line((-1.4, y), (1.9, y)) for y in np.arange(-0.8, 0.81, 0.32)], lambda p, s, b: _along(p, b, X, 0.25)),
    Target("part", (0.8, 0.8), True, False, 0.4, 20, lambda b: [
        _line((x, sign * 0.05), (x, sign * 1.9)) for x in np.arange(-0.8, 0.81, 0.32) for sign in (1, -1)],
        _part_error),
    Target("tips", (0.05, 0.9), False, False, 0.28, 12, lambda b: [_line((0.85, -1.6), (0.85, 2.0))], _tips_error),
)

Comb = Callable[[Guides, View, Array, float, bool], Guides]


def passes_needed(
    target: Target, sphere: bool, comb: Comb, seed: int, strands: int = 500
) -> tuple[int, float, Guides]:
    """Passes until the target is reached (PASSES + 1 when it never is), the error of the last, the guides."""
    guides = hair(seed, sphere, target.half, target.upright, strands)
    start = guides.points.astype(np.float64)
    view = orthographic(target.side_view)
    error = np.inf
    for count in range(1, PASSES + 1):
        for lane in target.lanes(sphere):
            radius = target.radius * PIXELS
            guides = comb(guides, view, resampled(to_pixels(lane), 0.1 * radius), radius, sphere)
        error = float(target.error(guides.points.astype(np.float64), start, sphere).mean())
        if error <= target.threshold:
            return count, error, guides
    return PASSES + 1, error, guides


def resampled(path: Array, step: float) -> Array:
    """The path in even steps of `step` pixels (the dabs)."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.linspace(0, arc[-1], max(2, int(np.ceil(arc[-1] / step)) + 1))
    return np.stack([np.interp(at, arc, path[:, k]) for k in range(2)], axis=1)


def plain_brush(guides: Guides, view: View, path: Array, radius: float, sphere: bool) -> Guides:
    """What is compared with: every point moves with the ring by its smooth weight, then lengths are put back.

    Strength 1; points that fall below the skin slide along it.
    """
    x = guides.points.astype(np.float64)
    lengths = np.linalg.norm(np.diff(x, axis=1), axis=-1)
    basis = view.motion_basis()
    gap = 0.005 * lengths.sum(axis=1)
    for a, b in pairwise(path):
        pixels, _ = view.pixels(x)
        ab = b - a
        t = np.clip((pixels - a) @ ab / (ab @ ab), 0, 1)
        d = np.linalg.norm(pixels - a - t[..., None] * ab, axis=-1) / radius
        w = np.where(d < 1, 1 - d * d * (3 - 2 * d), 0.0)
        w[:, 0] = 0
        rows = np.nonzero(w.max(axis=1) > 0)[0]
        if len(rows) == 0:
            continue
        motion = basis @ np.array([2 * ab[0] / view.width, -2 * ab[1] / view.height])
        y = x[rows] + w[rows][..., None] * motion
        for j in range(y.shape[1] - 1):
            q = y[:, j + 1] - y[:, j]
            q /= np.maximum(np.linalg.norm(q, axis=1, keepdims=True), 1e-12)
            y[:, j + 1] = y[:, j] + lengths[rows, j, None] * q
            for _ in range(3):
                low = gap[rows] - distance(y[:, j + 1], sphere)
                under = low > 0
                if not under.any():
                    break
                n = normals(y[:, j + 1], sphere)
                rise = np.clip((q * n).sum(1) + low / lengths[rows, j], -1, 1)
                along = q - (q * n).sum(1, keepdims=True) * n
                along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
                q = np.where(under[:, None], np.sqrt(1 - rise**2)[:, None] * along + rise[:, None] * n, q)
                y[:, j + 1] = y[:, j] + lengths[rows, j, None] * q
        x[rows] = y
    return guides.replace(points=freeze(x.astype(np.float32)))

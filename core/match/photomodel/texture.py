"""Photographs projected onto a model: each face gets a flat piece of one picture, filled from photographs that see it.

A photograph counts for a texel where it sees it, nothing before it; of several the one that sees its face largest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.photomodel.records import Photo
from core.match.photomodel.rows import seen_by
from core.match.solve.state import Array
from core.mesh.bvh import Bvh, build_bvh, cast_rays
from core.mesh.mesh import Mesh
from core.mesh.triangulate import triangulate
from core.record import freeze

PAD = 2  # texels around a face
LEAST = 4  # texels, side of a face
NEAR = 1e-3  # of the distance: so much nearer than the face is something before it
BLANK = 0.5  # what no photograph sees


class Textured(NamedTuple):
    """mesh : with UVs. picture : (S, S, 3) float32. seen : share of the texels of faces that a photograph sees."""

    mesh: Mesh
    picture: NDArray[np.float32]
    seen: float


class _Chart(NamedTuple):
    """A face laid flat: origin and two axes in the world, texels per unit; left, top, width and height in texels."""

    origin: Array
    u: Array
    v: Array
    normal: Array
    flat: Array
    best: tuple[int, ...]
    density: float


def textured(
    mesh: Mesh, photos: Sequence[Photo], pictures: Sequence[NDArray[np.float32]], side: int = 2048
) -> Textured:
    """Give a mesh UVs and a picture of `side` texels, from photographs (H, W, 3) float32 that have a place.

    Raises
    ------
    UserError
        No photograph has a place, or the faces do not fit even at the smallest size.
    """
    ready = [row for row, photo in enumerate(photos) if photo.rotation is not None]
    if not ready:
        raise UserError("No photograph has a place yet; solve the model before you project them onto it.")
    triangles = triangulate(mesh)
    bvh = build_bvh(mesh.points, triangles.vertices)
    places = mesh.points.astype(np.float64)
    loops = np.split(mesh.corners, np.cumsum(mesh.counts)[:-1])
    charts = [_chart(places[loop], photos, ready) for loop in loops]
    scale, boxes = _packed(charts, side)
    picture = np.full((side, side, 3), BLANK, np.float32)
    uvs = np.zeros((len(mesh.corners), 2), np.float32)
    start, texels, filled = 0, 0, 0
    for chart, box in zip(charts, boxes, strict=True):
        left, top, width, height = box
        density = chart.density * scale
        rows, columns = np.mgrid[0:height, 0:width]
        at = np.stack([(columns - PAD) / density, (rows - PAD) / density], axis=-1).reshape(-1, 2)
        world = chart.origin + at[:, :1] * chart.u + at[:, 1:] * chart.v
        colour, seen = _colour(world, chart, photos, pictures, bvh)
        picture[top : top + height, left : left + width] = colour.reshape(height, width, 3)
        texels, filled = texels + len(seen), filled + int(seen.sum())
        count = len(chart.flat)
        uvs[start : start + count, 0] = (left + PAD + chart.flat[:, 0] * density + 0.5) / side
        uvs[start : start + count, 1] = 1.0 - (top + PAD + chart.flat[:, 1] * density + 0.5) / side
        start += count
    return Textured(mesh.replace(uvs=freeze(uvs)), picture, filled / max(1, texels))


def _chart(loop: Array, photos: Sequence[Photo], ready: list[int]) -> _Chart:
    normal = np.cross(loop, np.roll(loop, -1, axis=0)).sum(axis=0)
    normal = normal / max(float(np.linalg.norm(normal)), 1e-30)
    ways = np.roll(loop, -1, axis=0) - loop
    u = ways[int(np.argmax((ways**2).sum(axis=1)))]
    u = u - (u @ normal) * normal
    u = u / max(float(np.linalg.norm(u)), 1e-30)
    v = np.cross(u, normal)  # rows of a picture go down
    flat = np.stack([loop @ u, loop @ v], axis=1)
    origin = u * flat[:, 0].min() + v * flat[:, 1].min() + normal * float((loop @ normal).mean())
    flat = flat - flat.min(axis=0)
    area = 0.5 * abs(float(np.cross(loop - loop[0], np.roll(loop, -1, axis=0) - loop[0]).sum(axis=0) @ normal))
    scored = []
    for row in ready:
        photo = photos[row]
        centre = _centre(photo)
        if (centre - loop.mean(axis=0)) @ normal <= 0.0:
            continue
        pixels, depth = seen_by(photo, loop)
        inside = _inside(photo, pixels, depth)
        if depth.min() > 0.0 and inside.any():
            x, y = pixels[:, 0], pixels[:, 1]
            covered = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
            scored.append((covered * float(inside.mean()), row))
    scored.sort(reverse=True)
    density = np.sqrt(max(scored[0][0], 1.0) / max(area, 1e-30)) if scored else LEAST / max(float(flat.max()), 1e-30)
    return _Chart(origin, u, v, normal, flat, tuple(row for _, row in scored), float(density))


def _centre(photo: Photo) -> Array:
    assert photo.rotation is not None
    return np.asarray(-photo.rotation.T @ np.array(photo.translation))


def _inside(photo: Photo, pixels: Array, depth: Array) -> NDArray[np.bool_]:
    """(N,) whether pixels (N, 2) at depths (N,) lie in the picture."""
    low, high = (pixels > -0.5).all(axis=1), (pixels < [photo.width - 0.5, photo.height - 0.5]).all(axis=1)
    return np.asarray((depth > 0.0) & low & high)


def _sampled(picture: NDArray[np.float32], pixels: Array) -> NDArray[np.float32]:
    """Colours (N, 3) at pixels (N, 2), in rows as OpenCV's maps may not be longer than 32 767."""
    width = 1024
    rows = -(-len(pixels) // width)
    places = np.zeros((rows * width, 2), np.float32)
    places[: len(pixels)] = pixels
    x, y = (np.ascontiguousarray(places[:, k].reshape(rows, width)) for k in range(2))
    found = cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found.reshape(-1, found.shape[-1])[: len(pixels), :3], np.float32)


def _packed(charts: list[_Chart], side: int) -> tuple[float, list[tuple[int, int, int, int]]]:
    """The largest scale, one texel a pixel at most, at which all charts fit on shelves of a square; where they are."""
    low, high, best = 0.0, 1.0, _shelves(charts, side, 0.0)
    if best is None:
        raise UserError(f"{len(charts)} faces do not fit on a picture of {side} texels; make it larger.")
    found = _shelves(charts, side, 1.0)
    if found is not None:
        return 1.0, found
    for _ in range(20):
        middle = 0.5 * (low + high)
        found = _shelves(charts, side, middle)
        if found is None:
            high = middle
        else:
            low, best = middle, found
    return max(low, 1e-12), best


def _shelves(charts: list[_Chart], side: int, scale: float) -> list[tuple[int, int, int, int]] | None:
    spans = np.array([chart.flat.max(axis=0) * chart.density for chart in charts])
    sizes = (np.clip(np.ceil(spans * scale), LEAST, 1 << 20).astype(int) + 2 * PAD + 1).tolist()
    boxes: list[tuple[int, int, int, int]] = [(0, 0, 0, 0)] * len(charts)
    left = top = shelf = 0
    for k in sorted(range(len(charts)), key=lambda k: -sizes[k][1]):
        width, height = sizes[k]
        if left + width > side:
            left, top, shelf = 0, top + shelf, 0
        if width > side or top + height > side:
            return None
        boxes[k] = (left, top, width, height)
        left, shelf = left + width, max(shelf, height)
    return boxes


def _colour(
    world: Array, chart: _Chart, photos: Sequence[Photo], pictures: Sequence[NDArray[np.float32]], bvh: Bvh
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Colours (N, 3) of places on a face, and which of them a photograph sees."""
    colour, seen = np.full((len(world), 3), BLANK, np.float32), np.zeros(len(world), bool)
    fallback = np.zeros(len(world), bool)
    for row in chart.best:
        left = np.flatnonzero(~seen)
        if not len(left):
            break
        photo = photos[row]
        pixels, depth = seen_by(photo, world[left])
        inside = _inside(photo, pixels, depth)
        centre = _centre(photo)
        way = world[left] - centre
        reached, _, _ = cast_rays(bvh, np.broadcast_to(centre, way.shape).astype(np.float32), way.astype(np.float32))
        free = inside & (reached > 1.0 - NEAR)
        sampled = _sampled(pictures[row], pixels)
        first = inside & ~free & ~fallback[left]  # better another's colour than none, where all are hidden
        colour[left[first]] = sampled[first]
        fallback[left[first]] = True
        colour[left[free]] = sampled[free]
        seen[left[free]] = True
    return colour, seen

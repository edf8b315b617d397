"""Where a point must be in the next photograph: on its epipolar line after one pick, at one place after two."""

from __future__ import annotations

import numpy as np

from core.match.photomodel.records import Photomodel, find
from core.match.photomodel.rows import ray, seen_by
from core.match.solve.state import Array

STEPS = 96  # places along an epipolar line
NEAR, FAR = 0.05, 50.0  # of the distance of the scene


def epipolar_line(model: Photomodel, photo: int, xy: tuple[float, float], other: int) -> Array:
    """Pixels (K, 2) of photograph `other` where what is seen at `xy` of `photo` can be, the nearest to it first.

    Lines bend as the lens does. Empty where one of the two has no place, or nothing of the line is in front.
    """
    seen, there = (model.photos[find(model.photos, id_)] for id_ in (photo, other))
    if seen.rotation is None or there.rotation is None:
        return np.zeros((0, 2))
    start, way = ray(seen, np.array([xy], np.float64))
    places = np.array([point.place for point in model.points if point.place is not None]).reshape(-1, 3)
    usual = float(np.median(np.linalg.norm(places - start, axis=1))) if len(places) else 1.0
    depth = usual / np.linspace(1.0 / NEAR, 1.0 / FAR, STEPS)
    pixels, ahead = seen_by(there, start + depth[:, None] * way)
    near = np.abs(pixels - 0.5 * np.array([there.width, there.height])) < 1.5 * max(there.width, there.height)
    return np.asarray(pixels[(ahead > 1e-9) & near.all(axis=1)])


def foretold(model: Photomodel, point: int, photo: int) -> tuple[float, float] | None:
    """Pixels of a photograph where a point that has a place is seen; None where it cannot be."""
    place = model.points[find(model.points, point)].place
    seen = model.photos[find(model.photos, photo)]
    if place is None or seen.rotation is None:
        return None
    pixels, ahead = seen_by(seen, np.array([place]))
    if ahead[0] <= 0.0:
        return None
    return float(pixels[0, 0]), float(pixels[0, 1])


def next_photo(model: Photomodel, point: int) -> int | None:
    """The photograph in which a point should be picked next: where it is in the picture and was not yet, the one that
    looks at it from farthest aside of those that have it. None when there is no such photograph."""
    item = model.points[find(model.points, point)]
    have = set(item.picks.photo.tolist())
    centres = {
        photo.id: -photo.rotation.T @ np.array(photo.translation) for photo in model.photos
        if photo.rotation is not None and photo.translation is not None
    }
    best, widest = None, -1.0
    for photo in model.photos:
        if photo.id in have:
            continue
        place = foretold(model, point, photo.id)
        if place is not None and not (0 <= place[0] < photo.width and 0 <= place[1] < photo.height):
            continue
        apart = [float(np.linalg.norm(centres[photo.id] - centres[id_])) for id_ in have
                 if photo.id in centres and id_ in centres]
        width = min(apart, default=0.0)
        if width > widest:
            best, widest = photo.id, width
    return best

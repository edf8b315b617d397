"""First places of what the cameras alone do not give: points seen once, picks along lines and circles."""

from __future__ import annotations

import numpy as np

from core.match.photomodel.records import Photomodel
from core.match.photomodel.rows import Table, ray
from core.match.solve.constraints import mirror_of
from core.match.solve.state import Array, Flags, Observations, State, bearings

ROUND = 0.02  # spread of the radius over it: as round as a circle that was solved before still is
BEST, APART = 8, 0.85  # directions a circle may face that are tried to the end; cosine between any two of them
NORMALS = 200  # directions a circle may face that are tried
OUTLINE = 3  # picks of a circle in a photograph from which its middle is told


def placed(state: State, table: Table, model: Photomodel, known: Flags, held: Flags) -> tuple[State, Flags]:
    """The state with more points, and which have a place now, (tracks,).

    known : (F,) photographs that have a pose. held : (tracks,) points that have a place.
    """
    observations = table.observations
    start, way = _rays(state, observations)
    points, held = state.points.copy(), held.copy()
    first = np.full(table.tracks, -1)
    for n in np.flatnonzero(known[observations.frame])[::-1]:
        first[observations.track[n]] = n
    _by_knowledge(points, held, model, first, start, way)
    rows = {point.id: row for row, point in enumerate(model.points)}
    for line, along in zip(model.lines, table.along_lines, strict=True):
        a, b = (rows[id_] for id_ in line.points)
        if held[a] and held[b]:
            for row in along:
                if first[row] >= 0:
                    points[row] = _nearest(points[a], points[b] - points[a], start[first[row]], way[first[row]])
                    held[row] = True
    for circle, along in zip(model.circles, table.along_circles, strict=True):
        seen = [row for row in along if first[row] >= 0]
        at = first[seen]
        plane = None
        if circle.centre is not None and circle.normal is not None:
            plane = np.array(circle.centre), np.array(circle.normal)
        if plane is None or _roundness(start[at], way[at], *plane) > ROUND:
            plane = _circle(start[at], way[at], observations.frame[at]) if len(seen) >= 2 * OUTLINE else None
        if plane is not None:
            points[seen] = _met(start[at], way[at], *plane)
            held[seen] = True
    return state._replace(points=points), held


def with_rays(model: Photomodel) -> Photomodel:
    """The model with a place for every point that has none and is picked in two photographs or more that have one:
    where the rays of its picks come nearest to each other."""
    photos = {photo.id: photo for photo in model.photos if photo.rotation is not None}
    points = []
    for point in model.points:
        seen = [(photos[id_], xy) for id_, xy in zip(point.picks.photo.tolist(), point.picks.xy, strict=True)
                if id_ in photos]
        if point.place is None and len(seen) > 1:
            rays = [ray(photo, xy[None]) for photo, xy in seen]
            across = np.stack([np.eye(3) - np.outer(way[0], way[0]) for _, way in rays])
            aim = np.einsum("kij,kj->i", across, np.stack([start for start, _ in rays]))
            place = np.linalg.lstsq(across.sum(axis=0), aim, rcond=None)[0]
            if all((place - start) @ way[0] > 0.0 for start, way in rays):
                point = point.replace(place=tuple(map(float, place)))
        points.append(point)
    return model.replace(points=tuple(points))


def _rays(state: State, observations: Observations) -> tuple[Array, Array]:
    """Where each observation was seen from (N, 3), and its unit direction (N, 3), in the world."""
    flat = bearings(state.lens, state.focal[observations.frame], observations.xy)
    turned = np.einsum("nji,nj->ni", state.rotation[observations.frame], flat)
    return state.centres()[observations.frame], turned / np.linalg.norm(turned, axis=1, keepdims=True)


def _by_knowledge(points: Array, held: Flags, model: Photomodel, first: Array, start: Array, way: Array) -> None:
    """Points seen once on a plane of others; mirror images of others. Changes `points` and `held`."""
    rows = {point.id: row for row, point in enumerate(model.points)}
    for known in model.known:
        of = np.array([rows[id_] for id_ in known.points])
        if known.kind == "plane" and held[of].sum() >= 3:
            there = points[of[held[of]]]
            normal = np.linalg.svd(there - there.mean(axis=0))[2][2]
            for row in of[~held[of] & (first[of] >= 0)]:
                n = first[row]
                points[row] = _met(start[n : n + 1], way[n : n + 1], there.mean(axis=0), normal)[0]
                held[row] = True
        if known.kind == "symmetric":
            pairs = of.reshape(-1, 2)
            both = held[pairs].all(axis=1)
            if both.sum() >= 2:
                normal, distance = mirror_of(points[pairs[both].ravel()])
                for a, b in pairs[held[pairs].sum(axis=1) == 1]:
                    have, lack = (a, b) if held[a] else (b, a)
                    points[lack] = points[have] - 2.0 * (points[have] @ normal - distance) * normal
                    held[lack] = True


def _nearest(a: Array, along: Array, start: Array, way: Array) -> Array:
    """The place on the line a + s along that is nearest to a ray."""
    matrix = np.stack([along, -way], axis=1)
    s = np.linalg.lstsq(matrix, start - a, rcond=None)[0][0]
    return np.asarray(a + s * along)


def _met(start: Array, way: Array, middle: Array, normal: Array) -> Array:
    """Where rays (N, 3) meet a plane; those along it at the depth of its middle."""
    slope = way @ normal
    depth = ((middle - start) @ normal) / np.where(np.abs(slope) < 1e-9, 1e-9, slope)
    usual = np.linalg.norm(middle - start, axis=1)
    depth = np.where((depth > 0.05 * usual) & (depth < 20.0 * usual), depth, usual)
    return np.asarray(start + depth[:, None] * way)


def _circle(start: Array, way: Array, photo: Array) -> tuple[Array, Array] | None:
    """Middle and normal of the plane in which all picks of an outline lie most nearly on one circle."""
    photos = [k for k in np.unique(photo) if (photo == k).sum() >= OUTLINE]
    if len(photos) < 2:
        return None
    # the middle of the picks of a photograph looks about at the middle of the circle
    towards = np.stack([way[photo == k].mean(axis=0) for k in photos])
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    origin = np.stack([start[photo == k][0] for k in photos])
    across = np.eye(3) - towards[:, :, None] * towards[:, None, :]
    middle = np.linalg.lstsq(across.sum(axis=0), np.einsum("kij,kj->i", across, origin), rcond=None)[0]
    golden = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(NORMALS)
    height = (np.arange(NORMALS) + 0.5) / NORMALS
    side = np.sqrt(1.0 - height**2)
    normals = np.stack([side * np.cos(golden), side * np.sin(golden), height], axis=1)
    spread = [_roundness(start, way, middle, normal) for normal in normals]
    size = float(np.median(np.linalg.norm(middle - start, axis=1)))
    tried: list[Array] = []
    for k in np.argsort(spread):
        if len(tried) < BEST and all(abs(float(normals[k] @ other)) < APART for other in tried):
            tried.append(normals[k])
    found = [_rounder(start, way, middle, normal, size) for normal in tried]
    return min(found, key=lambda plane: _roundness(start, way, *plane))


def _rounder(start: Array, way: Array, middle: Array, normal: Array, size: float) -> tuple[Array, Array]:
    """Middle and normal moved to where rays meet the plane at one distance from the middle.

    Picks need not be spread evenly, so their own middle is not yet that of the circle.
    """
    from scipy.optimize import least_squares

    def plane(by: Array) -> tuple[Array, Array]:
        turned = normal + by[3:]
        return middle + size * by[:3], turned / max(float(np.linalg.norm(turned)), 1e-12)

    def off(by: Array) -> Array:
        there, facing = plane(by)
        length = np.linalg.norm(_met(start, way, there, facing) - there, axis=1)
        # the last one holds what says nothing, the length of the normal
        return np.append(length / max(length.mean(), 1e-12) - 1.0, 1e-3 * float(by[3:] @ normal))

    return plane(np.asarray(least_squares(off, np.zeros(6), max_nfev=40).x))


def _roundness(start: Array, way: Array, middle: Array, normal: Array) -> float:
    """Spread, over their mean, of how far from the middle rays meet a plane."""
    length = np.linalg.norm(_met(start, way, middle, normal) - middle, axis=1)
    return float(length.std() / max(length.mean(), 1e-12))

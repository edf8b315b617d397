"""First places of what the cameras alone do not give: points seen once, picks along lines and circles."""

from __future__ import annotations

import numpy as np

from core.match.photomodel.records import Photomodel
from core.match.photomodel.rows import Table
from core.match.solve.constraints import mirror_of
from core.match.solve.state import Array, Flags, Observations, State, bearings

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
    for along in table.along_circles:
        seen = [row for row in along if first[row] >= 0]
        at = first[seen]
        plane = _circle(start[at], way[at], observations.frame[at]) if len(seen) >= 2 * OUTLINE else None
        if plane is not None:
            points[seen] = _met(start[at], way[at], *plane)
            held[seen] = True
    return state._replace(points=points), held


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
    spread = [_roundness(_met(start, way, middle, normal)) for normal in normals]
    return middle, normals[int(np.argmin(spread))]


def _roundness(points: Array) -> float:
    length = np.linalg.norm(points - points.mean(axis=0), axis=1)
    return float(length.std() / max(length.mean(), 1e-12))

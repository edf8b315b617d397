"""From the polygons of a file to a mesh that can be groomed: what is wrong is counted and worked around."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from core.errors import UserError
from core.mesh.edges import Edges, next_corner
from core.mesh.mesh import Mesh
from core.mesh.orient import orient
from core.mesh.polygons import Polygons

LARGEST = 1e12  # metres; beyond this squared float32 distances overflow, so such a vertex is as good as NaN

PROBLEMS = {
    "nonfinite_vertices": "vertices that are not finite numbers",
    "out_of_range_faces": "faces naming vertices that do not exist",
    "nonfinite_faces": "faces on vertices that are not finite",
    "degenerate_faces": "faces with fewer than three different vertices",
    "duplicate_faces": "faces that repeat another",
    "zero_area_faces": "faces without area",
    "duplicate_vertices": "vertices doubled along an edge",
    "nonmanifold_edges": "edges shared by more than two faces",
    "flipped_faces": "faces turned the other way",
    "loose_vertices": "vertices no face uses",
    "islands": "separate pieces",
    "missing_uvs": "faces without UVs",
}


class Repaired(NamedTuple):
    """A sound mesh; `problems` counts what was met, by kind (only kinds that were met; words in PROBLEMS).

    vertex_of_source : (V of the polygons,) int32, where each vertex went.
    face_of_source : (F of the polygons,) int32, where each face went, -1 where it was left out.
    closed : the surface has an inside.
    """

    mesh: Mesh
    problems: dict[str, int]
    vertex_of_source: np.ndarray
    face_of_source: np.ndarray
    closed: bool


def repair(polygons: Polygons, kinds: NDArray[np.generic] | None = None) -> Repaired:
    """Make a sound mesh of any polygons.

    Faces that cannot be used are left out; coincident vertices are joined only where that pairs two open
    edges of one part (so files without shared vertices become surfaces, while touching pieces stay apart); faces of a
    piece are turned to agree with most of it, and outwards where the piece is closed. Vertices keep their
    order; those joined to an earlier one disappear. A vertex that is not finite is moved to the middle of the
    others. Faces without area stay, because leaving them out would open a seam.

    Parameters
    ----------
    kinds : (V,) numbers; vertices of different kinds are never joined. None when all are of one kind.

    Raises
    ------
    UserError
        When no face is left.
    """
    met: dict[str, int] = {}
    points, bad = _finite_points(polygons.points, met)
    kept, faces = _clean_faces(polygons, bad, met)
    edges = Edges.of(faces.counts, faces.corners, len(points))
    vertex_of_source = np.arange(len(points))
    while True:  # faces that fall away may leave open edges to be joined
        target = _join_open_edges(points, faces.counts, faces.corners, faces.parts, edges, met, kinds)
        stays = target == np.arange(len(points))
        if stays.all():
            break
        target = (np.cumsum(stays) - 1)[target]
        vertex_of_source = target[vertex_of_source]
        points, bad, kinds = points[stays], bad[stays], None if kinds is None else kinds[stays]
        still, faces = _clean_faces(faces._replace(corners=target[faces.corners]), bad & False, met)
        kept = kept[still]
        edges = Edges.of(faces.counts, faces.corners, len(points))
    counts, corners = faces.counts, faces.corners
    met["flipped_faces"] = orient(points, counts, corners, faces.uvs, edges)
    if met["flipped_faces"]:
        edges = Edges.of(counts, corners, len(points))
    uvs = _whole_uvs(faces.uvs, counts, met)
    _count_the_rest(points, counts, corners, edges, met)
    face_of_source = np.full(len(polygons.counts), -1, np.int32)
    face_of_source[kept] = np.arange(len(kept))
    mesh = Mesh(
        points=points.astype(np.float32), counts=counts.astype(np.int32), corners=corners.astype(np.int32), uvs=uvs,
        parts=faces.parts.astype(np.int32), part_names=polygons.part_names or ("mesh",),
    )  # fmt: skip
    problems = {kind: met[kind] for kind in PROBLEMS if met.get(kind)}
    return Repaired(mesh, problems, vertex_of_source.astype(np.int32), face_of_source, edges.closed)


def _finite_points(points: NDArray[np.float64], met: dict[str, int]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    bad: NDArray[np.bool_] = np.logical_not((np.abs(points) < LARGEST).all(axis=1))
    met["nonfinite_vertices"] = int(bad.sum())
    if bad.any():
        if bad.all():
            raise UserError("None of its vertices is a finite number; export it again.")
        points = np.where(bad[:, None], points[~bad].mean(axis=0), points)
    return points, bad


def _clean_faces(
    polygons: Polygons, bad: NDArray[np.bool_], met: dict[str, int]
) -> tuple[NDArray[np.int64], Polygons]:
    """Rows of the faces that can be used, and those faces without corners that say nothing new."""
    kept, faces, corners = np.arange(len(polygons.counts)), polygons, -1
    while len(faces.corners) != corners:  # a ring that got shorter may repeat another face
        corners = len(faces.corners)
        still = _usable_faces(faces, bad, met)
        kept, faces = kept[still], _take_faces(faces, still)
    return kept, faces


def _usable_faces(polygons: Polygons, bad: NDArray[np.bool_], met: dict[str, int]) -> NDArray[np.int64]:
    """Rows of the faces that name at least three different, existing, finite vertices and repeat no other."""
    counts, corners = polygons.counts, polygons.corners
    face_of_corner = np.repeat(np.arange(len(counts)), counts)
    outside = (corners < 0) | (corners >= len(bad))
    has_outside = np.zeros(len(counts), np.bool_)
    has_outside[face_of_corner[outside]] = True
    broken = np.zeros(len(counts), np.bool_)
    if bad.any():
        broken[face_of_corner[bad[np.where(outside, 0, corners)]]] = True
        broken &= ~has_outside
    repeats = _distinct_corners(counts, corners, face_of_corner)
    degenerate = (repeats < 3) & ~has_outside & ~broken
    usable = ~(has_outside | broken | degenerate)
    double = np.zeros(len(counts), np.bool_)
    starts = np.cumsum(counts) - counts
    by_count = np.flatnonzero(usable)[np.argsort(counts[usable], kind="stable")]
    for rows in np.split(by_count, np.flatnonzero(np.diff(counts[by_count])) + 1) if len(by_count) else ():
        ring = np.sort(corners[starts[rows, None] + np.arange(counts[rows[0]])], axis=1)
        by_ring = np.lexsort(ring.T[::-1])
        same = (ring[by_ring[1:]] == ring[by_ring[:-1]]).all(axis=1)
        double[rows[by_ring[1:][same]]] = True
    met["out_of_range_faces"] = met.get("out_of_range_faces", 0) + int(has_outside.sum())
    met["nonfinite_faces"] = met.get("nonfinite_faces", 0) + int(broken.sum())
    met["degenerate_faces"] = met.get("degenerate_faces", 0) + int(degenerate.sum())
    met["duplicate_faces"] = met.get("duplicate_faces", 0) + int(double.sum())
    kept = np.flatnonzero(usable & ~double)
    if not len(kept):
        raise UserError("None of its faces can be used; export it again.")
    return kept


def _distinct_corners(
    counts: NDArray[np.int64], corners: NDArray[np.int64], face_of_corner: NDArray[np.int64]
) -> NDArray[np.int64]:
    """How many different vertices each face names, (F,)."""
    distinct = counts.copy()
    starts = np.cumsum(counts) - counts
    for size in (2, 3, 4):
        rows = np.flatnonzero(counts == size)
        ring = np.sort(corners[starts[rows, None] + np.arange(size)], axis=1)
        distinct[rows] -= (ring[:, 1:] == ring[:, :-1]).sum(axis=1)
    large = (counts > 4)[face_of_corner]
    if large.any():
        face, vertex = face_of_corner[large], corners[large]
        order = np.lexsort((vertex, face))
        face, vertex = face[order], vertex[order]
        again = (face[1:] == face[:-1]) & (vertex[1:] == vertex[:-1])
        distinct -= np.bincount(face[1:][again], minlength=len(counts))
    return distinct


def _take_faces(polygons: Polygons, kept: NDArray[np.int64]) -> Polygons:
    """The kept faces, without corners that repeat their neighbour and without further rounds of the same ring."""
    counts, corners, uvs, parts = polygons.counts, polygons.corners, polygons.uvs, polygons.parts
    if len(kept) < len(counts):
        rows = np.zeros(len(counts), np.bool_)
        rows[kept] = True
        mask = np.repeat(rows, counts)
        counts, corners, parts = counts[kept], corners[mask], parts[kept]
        uvs = None if uvs is None else uvs[mask]
    again = corners[next_corner(counts)] == corners
    if again.any():
        counts = counts - np.bincount(np.repeat(np.arange(len(counts)), counts)[again], minlength=len(counts))
        corners, uvs = corners[~again], None if uvs is None else uvs[~again]
    once = _first_rounds(counts, corners)
    if once is not None:
        rounds = np.add.reduceat(once, np.cumsum(counts) - counts, dtype=np.int64)
        counts, corners, uvs = rounds, corners[once], None if uvs is None else uvs[once]
    # copies, because faces are turned in place later
    uvs = None if uvs is None else uvs.astype(np.float32)
    return polygons._replace(counts=counts, corners=corners.copy(), uvs=uvs, parts=parts)


def _first_rounds(counts: NDArray[np.int64], corners: NDArray[np.int64]) -> NDArray[np.bool_] | None:
    """The corners of the first round of each face, (C,), where a face goes round itself several times; else None."""
    starts = np.cumsum(counts) - counts
    rows = np.flatnonzero(counts >= 6)
    if not len(rows):
        return None
    distinct = _distinct_corners(counts, corners, np.repeat(np.arange(len(counts)), counts))
    suspects = rows[(distinct[rows] < counts[rows]) & (counts[rows] % np.maximum(distinct[rows], 1) == 0)]
    once = None
    for row in suspects.tolist():
        start, count, period = int(starts[row]), int(counts[row]), int(distinct[row])
        rounds = corners[start : start + count].reshape(-1, period)
        if (rounds == rounds[0]).all():
            once = np.ones(len(corners), np.bool_) if once is None else once
            once[start + period : start + count] = False
    return once


def _join_open_edges(
    points: NDArray[np.float64],
    counts: NDArray[np.int64],
    corners: NDArray[np.int64],
    parts: NDArray[np.int32],
    edges: Edges,
    met: dict[str, int],
    kinds: NDArray[np.generic] | None,
) -> NDArray[np.int64]:
    """Where each vertex goes, (V,): itself, or the first of those it coincides with along two open edges of a part."""
    same = np.arange(len(points))
    open_ = edges.order[(edges.uses == 1)[edges.group]]
    if not len(open_):
        return same
    part = np.repeat(parts, counts)[open_]
    ends = np.stack([corners[open_], corners[next_corner(counts)[open_]]], axis=1)
    mark = np.zeros(len(points), np.bool_)
    mark[ends] = True
    used = np.flatnonzero(mark)
    place_of = np.zeros(len(points), np.int64)
    place_of[used] = _places(points[used])
    if kinds is not None:
        kind = np.unique(kinds[used], return_inverse=True)[1].ravel()
        place_of[used] = np.unique(place_of[used] * (kind.max() + 1) + kind, return_inverse=True)[1].ravel()
    places = int(place_of.max()) + 1
    if places == len(used):
        return same
    at = place_of[ends]
    swap = at[:, 0] > at[:, 1]
    ends[swap], at[swap] = ends[swap][:, ::-1], at[swap][:, ::-1]
    key = at[:, 0] * places + at[:, 1]
    order = np.lexsort((key, part)) if part.any() else np.argsort(key, kind="stable")
    ends, key, part = ends[order], key[order], part[order]  # what lies in two parts was kept apart by somebody
    fresh = np.append(True, (key[1:] != key[:-1]) | (part[1:] != part[:-1]))
    starts = np.flatnonzero(fresh)
    pairs = starts[np.diff(np.append(starts, len(key))) == 2]
    pairs = pairs[key[pairs] // places != key[pairs] % places]
    one, two = ends[pairs].ravel(), ends[pairs + 1].ravel()
    graph = coo_matrix((np.ones(len(one), np.int8), (one, two)), shape=(len(points), len(points)))
    total, label = connected_components(graph, directed=False)
    first = np.full(total, len(points))
    np.minimum.at(first, label, same)
    target = first[label]
    met["duplicate_vertices"] = met.get("duplicate_vertices", 0) + int((target != same).sum())
    return target


def _places(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Numbers of places, (N,): equal for rows that are equal in all three coordinates."""
    bits = (points + 0.0).view(np.uint64)  # -0.0 and 0.0 are the same place
    mixed = np.zeros(len(points), np.uint64)
    for axis in range(3):  # one 64-bit word sorts ten times as fast as three numbers
        mixed = (mixed ^ bits[:, axis]) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    order = np.argsort(mixed)
    rows = bits[order]
    # two places of one word would only be told apart once too often, which leaves a pair unjoined
    new = np.append(False, (rows[1:] != rows[:-1]).any(axis=1))
    place = np.empty(len(points), np.int64)
    place[order] = np.cumsum(new)
    return place


def _whole_uvs(
    uvs: NDArray[np.float32] | None, counts: NDArray[np.int64], met: dict[str, int]
) -> NDArray[np.float32] | None:
    """UVs with 0 at faces that have none; None when no face has any."""
    if uvs is None:
        met["missing_uvs"] = len(counts)
        return None
    missing = ~(np.abs(uvs) < np.float32(1e6)).all(axis=1)
    without = np.logical_or.reduceat(missing, np.cumsum(counts) - counts)
    met["missing_uvs"] = int(without.sum())
    if without.all():
        return None
    return np.where(np.repeat(without, counts)[:, None], np.float32(0), uvs)


def _count_the_rest(
    points: NDArray[np.float64],
    counts: NDArray[np.int64],
    corners: NDArray[np.int64],
    edges: Edges,
    met: dict[str, int],
) -> None:
    met["nonmanifold_edges"] = int((edges.uses > 2).sum())
    used = np.zeros(len(points), np.bool_)
    used[corners] = True
    met["loose_vertices"] = int(len(points) - used.sum())
    following = corners[next_corner(counts)]
    graph = coo_matrix((np.ones(len(corners), np.int8), (corners, following)), shape=(len(points), len(points)))
    label = connected_components(graph, directed=False)[1]
    islands = int(np.count_nonzero(np.bincount(label[used])))
    met["islands"] = islands if islands > 1 else 0
    starts = np.cumsum(counts) - counts
    about = np.repeat(corners[starts], counts)
    (ax, ay, az), (bx, by, bz) = (points[corners] - points[about]).T, (points[following] - points[about]).T
    normal = [np.add.reduceat(v, starts) for v in (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)]
    span = np.maximum.reduceat(ax * ax + ay * ay + az * az, starts)
    met["zero_area_faces"] = int((sum(v * v for v in normal) <= (1e-7 * span) ** 2).sum())

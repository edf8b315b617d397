"""Which way a coat lies: a direction field from the nose to the tail and the toes.

Fur grows away from the nose. The geodesic distance from the nose end, smoothed, has a gradient that runs
along the back, down the legs and out to the tip of the tail; a little gravity is mixed in on the flanks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.csgraph import dijkstra

SMOOTHING_PASSES = 24
CLUSTERS = 3000
SOURCES = 24


class Flow(NamedTuple):
    """directions : (V, 3) float32 unit tangents per vertex. distance : (V,) float32, metres from the nose
    (infinite on islands the nose is not on). nose : the vertex the coat starts from, -1 where none stands out."""

    directions: NDArray[np.float32]
    distance: NDArray[np.float32]
    nose: int


def flow_field(
    points: np.ndarray, triangles: np.ndarray, normals: np.ndarray, gravity: float = 0.35, nose: int | None = None
) -> Flow:
    """Directions a coat lies in, for every vertex.

    Parameters
    ----------
    points : (V, 3) float, metres, Y up. triangles : (T, 3) int. normals : (V, 3) unit, outward.
    gravity : weight of straight down against away-from-the-nose. nose : the vertex where that is known.
    """
    p = np.asarray(points, np.float64)
    n = np.asarray(normals, np.float64)
    edges = _edges(triangles)
    average = _averaging(len(p), edges)
    nose = nose_vertex(p, triangles) if nose is None else nose
    raw = np.tile([0.0, -gravity, 0.0], (len(p), 1))
    distance = np.full(len(p), np.inf)
    if nose >= 0:
        distance = _distances(p, edges, nose)
        raw += _away(p, triangles, average, distance)
    raw -= n * np.sum(raw * n, axis=1, keepdims=True)
    for _ in range(SMOOTHING_PASSES):  # fills in where nothing pointed anywhere, and calms the rest
        raw = 0.25 * raw + 0.75 * (average @ raw)
        raw -= n * np.sum(raw * n, axis=1, keepdims=True)
    length = np.linalg.norm(raw, axis=1, keepdims=True)
    lost = length[:, 0] < 1e-9
    raw[lost] = _any_tangent(n[lost])
    length[lost] = 1.0
    return Flow((raw / length).astype(np.float32), distance.astype(np.float32), nose)


def nose_vertex(points: np.ndarray, triangles: np.ndarray) -> int:
    """The vertex a coat starts from: the nose of the largest extremity that is not a foot, or -1.

    Extremities are local maxima of the mean geodesic distance (Hilaga et al., "Topology Matching", SIGGRAPH 2001),
    found on a coarse graph. Feet are the low ones; a head carries more surface around its end than a tail does.
    """
    p = np.asarray(points, np.float64)
    used = np.unique(triangles)
    if len(used) < 8:
        return -1
    cluster, centre = _clusters(p, used)
    edges = _edges(cluster[triangles])
    edges = edges[edges[:, 0] != edges[:, 1]]
    near, _ = _farthest_sources(centre, edges, SOURCES)
    reach = np.isfinite(near).all(axis=0)  # the island of the first source; others have no say
    if reach.sum() < 8:
        return -1
    mean = np.where(reach, np.where(np.isfinite(near), near, 0.0).mean(axis=0), -np.inf)
    radius = 0.16 * near[:, reach].max()
    area = np.bincount(cluster[triangles].ravel(), np.repeat(_areas(p, triangles), 3), minlength=len(centre))
    height = centre[reach, 1]
    foot = np.quantile(height, 0.02) + 0.22 * (height.max() - height.min())
    graph = _graph(centre, edges)
    middle = np.average(centre[reach], axis=0, weights=area[reach] + 1e-30)
    best, most = -1, 0.0
    for node in np.argsort(-mean)[: len(mean)]:
        if mean[node] < 1.08 * mean[reach].min() or not np.isfinite(mean[node]):
            break
        if centre[node, 1] < foot:
            continue
        ball = dijkstra(graph, directed=False, indices=node, limit=radius) <= radius
        if mean[ball].max() > mean[node] or area[ball].sum() <= most:
            continue
        most = area[ball].sum()
        ahead = centre[ball].mean(axis=0) - middle
        ahead[1] = 0.0
        members = used[ball[cluster[used]]]
        best = int(members[np.argmax(p[members] @ ahead)])
    return best


def _clusters(points: np.ndarray, used: np.ndarray) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Vertices gathered into about CLUSTERS cells: cluster of each vertex (V,), centre of each cluster (K, 3)."""
    low = points[used].min(axis=0)
    size = np.ptp(points[used], axis=0)
    cell = max(float(np.sqrt((size[0] * size[1] + size[1] * size[2] + size[2] * size[0]) * 2 / CLUSTERS)), 1e-12)
    keys = np.floor((points - low) / cell).astype(np.int64)
    _, cluster = np.unique(keys, axis=0, return_inverse=True)
    cluster = cluster.reshape(-1)
    total = np.maximum(np.bincount(cluster), 1)
    centre = np.stack([np.bincount(cluster, points[:, k]) / total for k in range(3)], axis=1)
    return cluster, centre


def _farthest_sources(points: np.ndarray, edges: np.ndarray, count: int) -> tuple[NDArray[np.float64], list[int]]:
    """Geodesic distances (count, K) from sources picked one after another, each farthest from those before."""
    graph = _graph(points, edges)
    source = int(np.argmax(np.bincount(edges.ravel(), minlength=len(points)))) if len(edges) else 0
    rows, sources = [], []
    nearest = np.full(len(points), np.inf)
    for _ in range(count):
        row = dijkstra(graph, directed=False, indices=source)
        rows.append(row)
        sources.append(source)
        nearest = np.minimum(nearest, row)
        source = int(np.argmax(np.where(np.isfinite(nearest), nearest, -1.0)))
    return np.array(rows), sources


def _areas(points: np.ndarray, triangles: np.ndarray) -> NDArray[np.float64]:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def smooth_over_surface(values: np.ndarray, triangles: np.ndarray, passes: int) -> NDArray[np.float64]:
    """`values` (V,) or (V, K) averaged with their neighbours `passes` times."""
    average = _averaging(len(values), _edges(triangles))
    out = np.asarray(values, np.float64)
    for _ in range(passes):
        out = 0.5 * out + 0.5 * (average @ out)
    return out


def _edges(triangles: np.ndarray) -> NDArray[np.int64]:
    t = np.asarray(triangles, np.int64)
    pairs = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    if not len(pairs):
        return pairs.reshape(0, 2)
    packed = np.unique(pairs[:, 0] << 32 | pairs[:, 1])
    return np.stack([packed >> 32, packed & 0xFFFFFFFF], axis=1)


def _averaging(count: int, edges: np.ndarray) -> csr_array:
    """(V, V) sparse: the mean over the neighbours of each vertex (itself where it has none)."""
    i, j = np.concatenate([edges, edges[:, ::-1]]).T
    ones = coo_array((np.ones(len(i)), (i, j)), shape=(count, count)).tocsr()
    degree = np.asarray(ones.sum(axis=1)).ravel()
    alone = (degree == 0).astype(float)
    return csr_array(diags_array(1.0 / np.maximum(degree, 1.0)) @ ones + diags_array(alone))


def _distances(points: np.ndarray, edges: np.ndarray, source: int) -> NDArray[np.float64]:
    return np.asarray(dijkstra(_graph(points, edges), directed=False, indices=source))


def _graph(points: np.ndarray, edges: np.ndarray) -> csr_array:
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1) + 1e-12
    return csr_array(coo_array((length, (edges[:, 0], edges[:, 1])), shape=(len(points), len(points))))


def _away(points: np.ndarray, triangles: np.ndarray, average: csr_array, distance: np.ndarray) -> NDArray[np.float64]:
    """Unit gradient of the (smoothed) distance per vertex, zero where the nose cannot be reached."""
    reach = np.isfinite(distance)
    d = np.where(reach, distance, 0.0)
    for _ in range(12):  # edge distances zigzag; their average does not
        d = np.where(reach, 0.5 * d + 0.5 * (average @ d), 0.0)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    twice_area = np.sum(normal * normal, axis=1, keepdims=True)
    da, db, dc = (d[triangles[:, k]][:, None] for k in range(3))
    gradient = np.cross(normal, da * (c - b) + db * (a - c) + dc * (b - a)) / np.maximum(twice_area, 1e-30)
    gradient /= np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-12)
    gradient[~reach[triangles].all(axis=1)] = 0.0
    out = np.zeros_like(points)
    weight = np.sqrt(twice_area)
    for k in range(3):
        np.add.at(out, triangles[:, k], gradient * weight)
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12) * (
        np.linalg.norm(out, axis=1, keepdims=True) > 1e-12
    )


def _any_tangent(normals: np.ndarray) -> NDArray[np.float64]:
    helper = np.where(np.abs(normals[:, 1:2]) < 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    tangent = np.cross(normals, helper)
    return tangent / np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-12)

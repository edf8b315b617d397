"""Catmull-Clark subdivision of polygon meshes, boundaries and per-corner UVs included.

Catmull and Clark, "Recursively generated B-spline surfaces on arbitrary topological meshes" (CAD 1978); boundaries as
uniform cubic B-splines with corners kept (OpenSubdiv's "edge and corner"); UVs are interpolated linearly in each face,
so islands keep their outlines.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from core.mesh.mesh import Mesh


def subdivide(mesh: Mesh, levels: int = 1) -> tuple[Mesh, csr_matrix]:
    """Refine every face into quads, `levels` times.

    Returns
    -------
    mesh : vertices in the order old vertices, edges, faces; faces in the order of the old corners; parts inherited.
    stencils : (new V, old V) float64, rows summing to 1: new values of anything smooth on vertices = stencils @ old.
    """
    total = csr_matrix(np.eye(len(mesh.points))) if levels == 0 else None
    points = mesh.points.astype(np.float64)
    for _ in range(levels):
        mesh, stencils = _refine(mesh)
        total = stencils if total is None else stencils @ total
    assert total is not None
    return mesh.replace(points=(total @ points).astype(np.float32)), total


def _refine(mesh: Mesh) -> tuple[Mesh, csr_matrix]:
    vertices, faces, corners = len(mesh.points), len(mesh.counts), len(mesh.corners)
    face = np.repeat(np.arange(faces), mesh.counts)
    start, count = mesh.starts[face].astype(np.int64), mesh.counts[face].astype(np.int64)
    place = np.arange(corners) - start
    following, previous = start + (place + 1) % count, start + (place - 1) % count
    a, b = mesh.corners.astype(np.int64), mesh.corners[following].astype(np.int64)
    keys, edge = np.unique(np.minimum(a, b) * vertices + np.maximum(a, b), return_inverse=True)
    ends = np.stack([keys // vertices, keys % vertices], axis=1)
    edges = len(keys)
    sharp = np.bincount(edge, minlength=edges) != 2  # boundary, or where more than two faces meet

    def matrix(values: np.ndarray | float, rows: np.ndarray, columns: np.ndarray, shape: tuple[int, int]) -> csr_matrix:
        return csr_matrix((np.broadcast_to(values, rows.shape), (rows, columns)), shape=shape)

    face_points = matrix(1.0 / count, face, a, (faces, vertices))
    middles = matrix(0.5, np.repeat(np.arange(edges), 2), ends.ravel(), (edges, vertices))
    around = matrix(0.5, edge, face, (edges, faces))
    edge_points = _scaled(0.5 * (~sharp), middles + around @ face_points) + _scaled(1.0 * sharp, middles)

    valence = np.maximum(np.bincount(ends.ravel(), minlength=vertices), 1).astype(np.float64)
    touching = np.maximum(np.bincount(a, minlength=vertices), 1).astype(np.float64)
    sharp_edges = np.bincount(ends[sharp].ravel(), minlength=vertices)
    eye = matrix(1.0, np.arange(vertices), np.arange(vertices), (vertices, vertices))
    mean_face = _scaled(1.0 / touching, matrix(1.0, a, face, (vertices, faces)) @ face_points)
    star = matrix(1.0, ends.ravel(), np.repeat(np.arange(edges), 2), (vertices, edges))
    mean_edge = _scaled(1.0 / valence, star @ middles)
    rim = _scaled(0.5 * np.ones(vertices), star @ _scaled(1.0 * sharp, middles))
    alone = np.bincount(ends.ravel(), minlength=vertices) == 0
    smooth = (sharp_edges < 2) & ~alone
    crease = (sharp_edges == 2) & (touching > 1)
    corner = ~smooth & ~crease
    moved = (
        _scaled(smooth / valence, mean_face + 2.0 * mean_edge)
        + _scaled(np.where(smooth, (valence - 3.0) / valence, np.where(crease, 0.5, 1.0 * corner)), eye)
        + _scaled(0.5 * crease, rim)
    )
    stencils = _stacked([moved, edge_points, face_points])

    quads = np.stack([a, vertices + edge, vertices + edges + face, vertices + edge[previous]], axis=1)
    uvs = None
    if mesh.uvs is not None:
        uv = mesh.uvs.astype(np.float64)
        centre = (np.add.reduceat(uv, mesh.starts) / mesh.counts[:, None])[face] if corners else uv
        uvs = np.stack([uv, 0.5 * (uv + uv[following]), centre, 0.5 * (uv + uv[previous])], axis=1).reshape(-1, 2)
    refined = Mesh(
        points=(stencils @ mesh.points.astype(np.float64)).astype(np.float32),
        counts=np.full(corners, 4, np.int32),
        corners=quads.reshape(-1).astype(np.int32),
        uvs=None if uvs is None else uvs.astype(np.float32),
        parts=np.repeat(mesh.parts, mesh.counts),
        part_names=mesh.part_names,
    )
    return refined, stencils


def _scaled(factors: np.ndarray, rows: csr_matrix) -> csr_matrix:
    """Each row of a sparse matrix times its factor."""
    n = len(factors)
    return csr_matrix((np.asarray(factors, np.float64), (np.arange(n), np.arange(n))), shape=(n, n)) @ rows


def _stacked(blocks: list[csr_matrix]) -> csr_matrix:
    from scipy.sparse import vstack

    return csr_matrix(vstack(blocks))

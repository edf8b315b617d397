"""Everything derived from a mesh that grooming asks for again and again, made once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from core.evaluator import Evaluator
from core.mesh.bvh import Bvh, build_bvh, refit
from core.mesh.distance_field import DistanceField, build_distance_field
from core.mesh.mesh import Mesh, Triangles
from core.mesh.normals import mesh_normals
from core.mesh.signed_distance import SignedSkin, build_signed_skin
from core.mesh.triangulate import triangulate
from core.workers import Workers

FIELD_CELLS = 128  # along the longest side; finer costs seconds, and what is finer is settled exactly


class Skin(NamedTuple):
    """A mesh in one pose with its derived data.

    points : (V, 3) float32 of this pose. normals : (V, 3) float32, smooth, unit.
    diagonal : length of the bounding-box diagonal of this pose, metres.
    """

    mesh: Mesh
    triangles: Triangles
    points: np.ndarray
    normals: np.ndarray
    bvh: Bvh
    diagonal: float


class Posed(NamedTuple):
    """Where the vertices of a mesh are in one pose: points (V, 3) float32 and smooth unit normals (V, 3) float32."""

    points: np.ndarray
    normals: np.ndarray


def skin_at_rest(mesh: Mesh, evaluator: Evaluator) -> Skin:
    """The skin of the mesh at rest, remembered by the evaluator."""
    return evaluator.get(_rest, mesh)


def skin_posed(mesh: Mesh, points: np.ndarray, evaluator: Evaluator) -> Skin:
    """The skin with its vertices at `points` (V, 3) float32; the tree is refitted, not rebuilt."""
    rest = skin_at_rest(mesh, evaluator)
    if points is mesh.points:
        return rest
    return rest._replace(
        points=points, normals=mesh_normals(mesh, points), bvh=refit(rest.bvh, points), diagonal=_diagonal(mesh, points)
    )


def distance_field(mesh: Mesh, evaluator: Evaluator) -> DistanceField:
    """The distance field of the mesh at rest, remembered by the evaluator."""
    return evaluator.get(_field, mesh, workers=evaluator.workers)


def distance_field_known(mesh: Mesh, evaluator: Evaluator) -> bool:
    """True when :func:`distance_field` would answer at once."""
    return evaluator.knows(_field, mesh, workers=evaluator.workers)


def signed_skin(mesh: Mesh, evaluator: Evaluator) -> SignedSkin:
    """Exact signed distances to the mesh at rest, remembered by the evaluator."""
    return evaluator.get(_signed, mesh)


def _rest(mesh: Mesh) -> Skin:
    triangles = triangulate(mesh)
    return Skin(
        mesh, triangles, mesh.points, mesh_normals(mesh), build_bvh(mesh.points, triangles.vertices),
        _diagonal(mesh, mesh.points),
    )


def _field(mesh: Mesh, workers: Workers) -> DistanceField:
    longest = float(np.ptp(mesh.points[mesh.corners].astype(np.float64), axis=0).max())
    return build_distance_field(mesh.points, triangulate(mesh).vertices, longest / FIELD_CELLS, workers=workers)


def _signed(mesh: Mesh) -> SignedSkin:
    return build_signed_skin(mesh.points, triangulate(mesh).vertices)


def _diagonal(mesh: Mesh, points: np.ndarray) -> float:
    used = points[mesh.corners].astype(np.float64)  # vertices no face uses may lie anywhere
    return float(np.linalg.norm(np.ptp(used, axis=0))) if len(used) else 0.0

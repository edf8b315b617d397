"""What the hairs of a coat are kept out of: one skin in one pose, and hairs settled on it row by row."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.evaluator import Evaluator
from core.groom.settle import inside_segments, settle, settle_exactly
from core.mesh.distance_field import DistanceField, build_distance_field
from core.mesh.edges import is_closed
from core.mesh.mesh import Mesh
from core.mesh.signed_distance import SignedSkin, build_signed_skin
from core.mesh.skin import distance_field, signed_skin, skin_at_rest
from core.workers import Workers

INSIDE_TOLERANCE = 1e-5  # of the bounding-box diagonal: what float32 roots may lie under the skin


class Collision(NamedTuple):
    """A skin to settle hairs on.

    points : (V, 3) float32, its vertices; whoever holds hairs on the very same array may settle them.
    signed : exact distances, None where the skin is not closed and has no inside.
    tolerance : metres below the skin that still count as on it.
    """

    points: NDArray[np.float32]
    field: DistanceField
    signed: SignedSkin | None
    tolerance: float


def collision(mesh: Mesh, points: NDArray[np.float32], evaluator: Evaluator) -> Collision:
    """The skin of `mesh` with its vertices at `points`; takes a good part of a second, so not while a hand moves."""
    rest, closed = skin_at_rest(mesh, evaluator), is_closed(mesh)
    if points is mesh.points:
        signed = signed_skin(mesh, evaluator) if closed else None
        return Collision(points, distance_field(mesh, evaluator), signed, INSIDE_TOLERANCE * rest.diagonal)
    vertices = rest.triangles.vertices
    used = points[mesh.corners].astype(np.float64)  # vertices no face uses may lie anywhere
    diagonal = float(np.linalg.norm(np.ptp(used, axis=0))) if len(used) else 0.0
    signed = build_signed_skin(points, vertices)
    field = build_distance_field(points, vertices, workers=evaluator.workers, skin=signed)
    return Collision(points, field, signed if closed else None, INSIDE_TOLERANCE * diagonal)


def settle_rows(
    hairs: NDArray[np.float32], rows: NDArray[np.int32] | None, skin: Collision, workers: Workers | None = None
) -> None:
    """Lift these rows (all when None) of hairs (N, 3, P) float32 out of the skin, in place.

    Every hair by itself: settled in slices they come out as they do all at once, to the bit.
    """
    part = hairs if rows is None else hairs[rows]
    settle(part, skin.field, workers=workers)
    if skin.signed is not None:
        settle_exactly(part, skin.field, skin.signed, skin.tolerance, workers)
    if rows is not None:
        hairs[rows] = part


def strands_inside(
    points: NDArray[np.float32], skin: Collision, workers: Workers | None = None
) -> NDArray[np.bool_]:
    """Which strands (G, P, 3) run inside the skin anywhere beyond their roots; none where it has no inside."""
    if skin.signed is None or len(points) == 0:
        return np.zeros(len(points), np.bool_)
    hairs = np.ascontiguousarray(np.swapaxes(points, 1, 2))
    return np.asarray(inside_segments(hairs, skin.field, skin.signed, skin.tolerance, workers).any(axis=1))

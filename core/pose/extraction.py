"""From a sculpt on the posed surface to the correction before skinning that gives it.

The skin carries a vertex by x = A y + b. Where A is well conditioned the correction is exactly A^-1 of what is
missing. Beyond, as between two joints twisted half a turn apart where A flattens the vertex, no correction before
skinning can give the sculpt: it is added after skinning, in the frame of the rotation nearest to A.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.pose.rig import Rig
from core.pose.rotation import polar_rotation
from core.pose.skinning import carried
from core.transform import Array

MOST_CONDITION = 30.0  # beyond it a correction before skinning is too large to be interpolated
LOST_CONDITION = 1e6  # beyond it A has no nearest rotation, and that of the strongest joint is taken


class Affine(NamedTuple):
    """What the skin does at a pose to some vertices: x = turn @ y + move; `strongest` is the joint of most weight."""

    turn: Array
    move: Array
    strongest: NDArray[np.int64]


def skin_affine(rig: Rig, matrices: Array, vertices: NDArray[np.int32]) -> Affine:
    """The affine maps (n, 3, 3) and (n, 3) of vertices (n,) under skin matrices (J, 4, 4).

    Linear blends are summed in float64; dual quaternions, affine in the point as well, are probed at four points.
    """
    n = len(vertices)
    joints, weights = rig.skin.joints[vertices], rig.skin.weights[vertices]
    if not joints.shape[1]:
        return Affine(np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)), np.zeros(n, np.int64))
    strongest = np.take_along_axis(joints, weights.argmax(axis=1)[:, None], axis=1)[:, 0].astype(np.int64)
    if rig.skinning == "linear":
        rows = np.hstack([matrices[:, :3, :3].reshape(-1, 9), matrices[:, :3, 3]])
        total = np.zeros((n, 12))
        for k in range(joints.shape[1]):
            total += weights[:, k, None] * rows.take(joints[:, k], axis=0)
        return Affine(total[:, :9].reshape(n, 3, 3), total[:, 9:], strongest)
    move, x, y, z = (
        carried(np.tile(np.float32(p), (n, 1)), rig, matrices, vertices=vertices).astype(np.float64)
        for p in np.vstack([np.zeros(3), np.eye(3)])
    )
    return Affine(np.stack([x - move, y - move, z - move], axis=2), move, strongest)


def condition_numbers(matrices: Array) -> Array:
    """Largest over smallest stretch (n,) of matrices (n, 3, 3); infinite where they flatten.

    From the eigenvalues of A^T A in closed form (Smith 1961) where that is accurate, by decomposition beyond.
    """
    square = np.einsum("nji,njk->nik", matrices, matrices)
    mean = np.trace(square, axis1=1, axis2=2) / 3.0
    off = square - mean[:, None, None] * np.eye(3)
    spread = np.sqrt(np.einsum("nij,nij->n", off, off) / 6.0)
    unit = off / np.where(spread > 0.0, spread, 1.0)[:, None, None]
    angle = np.arccos(np.clip(0.5 * _determinant(unit), -1.0, 1.0)) / 3.0
    largest = mean + 2.0 * spread * np.cos(angle)
    smallest = mean + 2.0 * spread * np.cos(angle + 2.0 * np.pi / 3.0)
    safe = smallest > 1e-2 * largest
    out = np.full(len(matrices), np.inf)
    out[safe] = np.sqrt(largest[safe] / smallest[safe])
    if not safe.all():
        sizes = np.linalg.svd(matrices[~safe], compute_uv=False)
        flat = sizes[:, 2] <= 0.0
        out[~safe] = np.where(flat, np.inf, sizes[:, 0] / np.where(flat, 1.0, sizes[:, 2]))
    return out


def undo(matrices: Array, vectors: Array) -> Array:
    """A^-1 v (n, 3) by the adjugate, refined once; only for matrices that are well conditioned."""
    adjugate = np.stack([
        np.cross(matrices[:, 1], matrices[:, 2]), np.cross(matrices[:, 2], matrices[:, 0]),
        np.cross(matrices[:, 0], matrices[:, 1]),
    ], axis=2)
    inverse = adjugate / _determinant(matrices)[:, None, None]
    found = np.einsum("nij,nj->ni", inverse, vectors)
    missing = vectors - np.einsum("nij,nj->ni", matrices, found)
    return found + np.einsum("nij,nj->ni", inverse, missing)


def surface_rotations(affine: Affine, matrices: Array) -> Array:
    """The rotation (n, 3, 3) nearest to each map, of the strongest joint where the map has none. Never NaN."""
    out = polar_rotation(affine.turn)
    lost = ~(condition_numbers(affine.turn) < LOST_CONDITION)
    if lost.any():
        out[lost] = polar_rotation(matrices[affine.strongest[lost], :3, :3])
    return out


def before_skinning(affine: Affine, missing: Array) -> tuple[Array, Array]:
    """Corrections (n, 3) before skinning that move the posed surface by `missing` (n, 3), and the conditions (n,).

    0 where the condition is above :data:`MOST_CONDITION`; use :func:`after_skinning` there.
    """
    condition = condition_numbers(affine.turn)
    good = condition <= MOST_CONDITION
    delta = np.zeros_like(missing)
    delta[good] = undo(affine.turn[good], missing[good])
    return delta, condition


def after_skinning(affine: Affine, matrices: Array, missing: Array) -> Array:
    """Corrections (n, 3) to be added after skinning, in the frame of the surface."""
    found: Array = np.einsum("nji,nj->ni", surface_rotations(affine, matrices), missing)
    return found


def _determinant(m: Array) -> Array:
    found: Array = np.einsum("ni,ni->n", m[:, 0], np.cross(m[:, 1], m[:, 2]))
    return found

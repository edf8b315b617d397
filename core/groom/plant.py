"""Plant guides: one, along a line, or a scatter; shaped like their neighbours or straight."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from core.groom.collide import push_out
from core.groom.guides import Guides
from core.groom.rows import append_guides
from core.mesh.bvh import closest_points
from core.mesh.distance_field import DistanceField
from core.mesh.scatter import Density, count_for_density, scatter
from core.mesh.skin import Skin
from core.mesh.surface import place_roots, root_positions
from core.transform import minimal_rotation, normalized

Array = NDArray[np.float64]


def plant(
    guides: Guides,
    skin: Skin,
    triangle: NDArray[np.int32],
    barycentric: NDArray[np.float32],
    *,
    length: float | NDArray[np.float64] | None = None,
    direction: ArrayLike | None = None,
    lean: float = 0.0,
    inherit: int = 4,
    field: DistanceField | None = None,
) -> Guides:
    """Add guides at places of the skin at rest.

    Parameters
    ----------
    triangle, barycentric : (N,) int32 and (N, 3) float32, places on `skin.triangles`.
    length : metres, one for all or (N,); by default that of the neighbours, else a 20th of the skin's diagonal.
    direction : (3,) or (N, 3), object space, the way guides lean where they have no neighbours to follow.
    lean : radians from the normal toward `direction`.
    inherit : how many of the nearest guides give a new one its shape; 0 plants straight ones.
    field : signed distance to the skin, to keep the new ones out of it; None ignores it.

    Returns
    -------
    Guides with the new ones last, ids from `next_id` on.
    """
    triangle = np.atleast_1d(np.asarray(triangle, np.int32))
    barycentric = np.asarray(barycentric, np.float32).reshape(-1, 3)
    if len(triangle) == 0:
        return guides
    normals = skin.normals if skin.points is skin.mesh.points else None
    roots = place_roots(skin.mesh, skin.triangles, triangle, barycentric, normals)
    positions = root_positions(skin.mesh, roots)
    root_normals = roots.frames[:, 2].astype(np.float64)
    joints = guides.points.shape[1] - 1
    if len(guides) and inherit > 0:
        segments = inherited_segments(guides, positions, root_normals, inherit)
        if length is not None:
            now = np.linalg.norm(segments, axis=-1).sum(axis=1)
            factor = np.broadcast_to(length, now.shape) / np.where(now > 0.0, now, 1.0)
            segments = segments * factor[:, None, None]
    else:
        wanted = np.broadcast_to(skin.diagonal / 20.0 if length is None else length, (len(triangle),))
        straight = leaning(root_normals, direction, lean) * (wanted / joints)[:, None]
        segments = np.repeat(straight[:, None], joints, axis=1)
    points = np.empty((len(triangle), joints + 1, 3), np.float32)
    points[:, 0] = positions
    points[:, 1:] = positions[:, None].astype(np.float64) + np.cumsum(segments, axis=1)
    out = append_guides(guides, roots, points)
    if field is None:
        return out
    mask = np.arange(len(out)) >= len(guides)
    if out.selected.any():  # new ones are not selected, but these are not yet under the artist's hand either
        alone = out.replace(selected=np.zeros(len(out), np.bool_))
        return push_out(alone, field, mask=mask).replace(selected=out.selected)
    return push_out(out, field, mask=mask)


def leaning(normals: Array, direction: ArrayLike | None, lean: float) -> Array:
    """Unit vectors (N, 3) tilted by `lean` radians from the normals toward `direction` (along the skin)."""
    if direction is None or lean == 0.0:
        return normals
    d = np.broadcast_to(np.asarray(direction, np.float64), normals.shape)
    along = normalized(d - np.sum(d * normals, axis=1, keepdims=True) * normals)
    flat = np.abs(along).max(axis=1, keepdims=True) > 0.0
    return np.where(flat, np.cos(lean) * normals + np.sin(lean) * along, normals)


def inherited_segments(guides: Guides, positions: NDArray[np.float32], normals: Array, count: int) -> Array:
    """Segments (N, P - 1, 3) of strands at `positions` like the nearest guides, by inverse square distance.

    Neighbours are turned by the smallest rotation from their normal to the new one (tangents may jump at seams).
    Those on skin that faces the other way (a thin ear) count only where there are no others. Directions and segment
    lengths are averaged apart, so that strands of different directions do not shorten.
    """
    k = min(count, len(guides))
    distance, near = cKDTree(guides.points[:, 0].astype(np.float64)).query(positions.astype(np.float64), k=k)
    distance, near = distance.reshape(len(positions), k), near.reshape(len(positions), k)
    other = guides.roots.frames[:, 2].astype(np.float64)[near]
    same_side = np.einsum("nkc,nc->nk", other, normals) > 0.0
    same_side |= ~same_side.any(axis=1, keepdims=True)
    nearest = np.maximum(distance.min(axis=1, keepdims=True), 1e-12)
    weights = same_side / np.maximum(distance, 1e-3 * nearest + 1e-12) ** 2
    weights /= weights.sum(axis=1, keepdims=True)
    steps = np.diff(guides.points.astype(np.float64), axis=1)[near]
    lengths = np.linalg.norm(steps, axis=-1)
    turn = minimal_rotation(other, normals[:, None])
    directions = np.einsum("nkab,nkjb->nkja", turn, steps / np.where(lengths > 0.0, lengths, 1.0)[..., None])
    mean = np.einsum("nk,nkja->nja", weights, directions)
    first = directions[np.arange(len(near)), np.argmax(weights, axis=1)]
    mean = np.where(np.linalg.norm(mean, axis=-1, keepdims=True) > 1e-6, mean, first)
    return normalized(mean) * np.einsum("nk,nkj->nj", weights, lengths)[..., None]


def places_along(skin: Skin, line: ArrayLike, spacing: float) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Places every `spacing` metres along a polyline (K, 3) drawn on the skin, its ends included where they fit.

    Returns
    -------
    triangle (N,) int32 and barycentric (N, 3) float32, for :func:`plant`.
    """
    p = np.asarray(line, np.float64).reshape(-1, 3)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    at = np.arange(0.0, arc[-1] * (1.0 + 1e-9) + 1e-12, max(spacing, 1e-9))
    places = np.stack([np.interp(at, arc, p[:, k]) for k in range(3)], axis=1)
    triangle, barycentric, _ = closest_points(skin.bvh, places.astype(np.float32))
    found = triangle >= 0
    return triangle[found], barycentric[found]


def plant_scatter(
    guides: Guides,
    skin: Skin,
    count: int | None = None,
    *,
    per_square_metre: float | None = None,
    region: Density | None = None,
    seed: int = 0,
    **shape: Any,
) -> Guides:
    """Plant exactly `count` guides (or as many as make a density) spread evenly over the skin or a painted region.

    Parameters
    ----------
    region : 0 .. 1, (V,) float32 per vertex or a function of places (see :func:`core.mesh.scatter.scatter`).
    shape : as of :func:`plant`.
    """
    points, triangles = skin.mesh.points, skin.triangles.vertices
    if count is None:
        count = count_for_density(points, triangles, per_square_metre or 0.0, region)
    places = scatter(points, triangles, count, seed, region)
    return plant(guides, skin, places.triangle, places.barycentric, **shape)

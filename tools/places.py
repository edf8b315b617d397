"""Places on the skin under the pointer, for tools that plant: they are found in the pose shown and kept at rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.mesh.bvh import cast_rays
from core.mesh.surface import place_roots, root_frames
from tools.skin_ground import SkinGround


class Places(NamedTuple):
    """N places on the skin.

    triangle : (N,) int32, -1 beside the animal. barycentric : (N, 3) float32.
    shown : (N, 3) where they are in the pose shown; rest : (N, 3) at rest. normals : (N, 3) at rest.
    """

    triangle: NDArray[np.int32]
    barycentric: NDArray[np.float32]
    shown: NDArray[np.float64]
    rest: NDArray[np.float64]
    normals: NDArray[np.float64]


def places_under(ground: SkinGround, pixels: ArrayLike) -> Places:
    """What lies under pixels (N, 2)."""
    origins, directions = ground.rays(np.asarray(pixels, np.float64))
    _, triangle, barycentric = cast_rays(ground.skin.bvh, origins.astype(np.float32), directions.astype(np.float32))
    corners = ground.skin.triangles.vertices[np.maximum(triangle, 0)]
    weights = barycentric.astype(np.float64)
    shown, rest, normals = (
        np.einsum("nk,nkc->nc", weights, values[corners].astype(np.float64))
        for values in (ground.skin.points, ground.rest.points, ground.rest.normals)
    )
    return Places(triangle, barycentric, shown, rest, normals)


def directions_at_rest(
    ground: SkinGround, triangle: NDArray[np.int32], barycentric: NDArray[np.float32], directions: ArrayLike
) -> NDArray[np.float64]:
    """Directions (N, 3) of the pose shown, as the skin at those places has them at rest."""
    d = np.asarray(directions, np.float64)
    if ground.skin is ground.rest:
        return d
    rest, skin = ground.rest, ground.skin
    roots = place_roots(rest.mesh, rest.triangles, triangle, barycentric, rest.normals)
    posed = root_frames(rest.mesh, roots, skin.points, skin.normals).astype(np.float64)
    return np.einsum("nba,nb->na", roots.frames.astype(np.float64), np.einsum("nab,nb->na", posed, d))

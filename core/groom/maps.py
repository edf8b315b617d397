"""Distribution maps: an image addressed by UV, or one value per vertex, read anywhere on the skin."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.groom.groom import Map
from core.mesh.mesh import Mesh, Triangles


def sample_vertex_map(
    values: NDArray[np.float32], triangles: Triangles, triangle: NDArray[np.int32], weights: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Values (N,) float32 of a map given per vertex, (V,), at points (triangle (N,), barycentric weights (N, 3))."""
    return np.einsum("nk,nk->n", weights, values[triangles.vertices[triangle]]).astype(np.float32)


def sample_image_map(
    image: NDArray[np.float32], mesh: Mesh, triangles: Triangles, triangle: NDArray[np.int32],
    weights: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Values (N,) float32 of an image (H, W) at the UVs of points on the skin, bilinear, repeating beyond 0..1.

    V runs upward (the top row of the image is v = 1), as in OBJ, USD and every paint program's export.
    """
    if mesh.uvs is None:
        raise UserError("an image map needs UVs and this mesh has none; paint per vertex or unwrap the mesh first")
    uv = np.einsum("nk,nkc->nc", weights, mesh.uvs[triangles.corners[triangle]])
    return sample_image(image, uv)


def sample_image(image: NDArray[np.float32], uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """Bilinear values (N,) float32 of an image (H, W) at uv (N, 2); texel centres at (i + 0.5) / size."""
    height, width = image.shape
    x = uv[:, 0].astype(np.float64) * width - 0.5
    y = (1.0 - uv[:, 1].astype(np.float64)) * height - 0.5
    x0, y0 = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    fx, fy = x - x0, y - y0
    left, right, up, down = x0 % width, (x0 + 1) % width, y0 % height, (y0 + 1) % height
    top = image[up, left] * (1 - fx) + image[up, right] * fx
    bottom = image[down, left] * (1 - fx) + image[down, right] * fx
    return np.asarray(top * (1 - fy) + bottom * fy, np.float32)


def sample_map(
    item: Map, mesh: Mesh, triangles: Triangles, triangle: NDArray[np.int32], weights: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Values (N,) float32 of either kind of map at points on the skin."""
    if item.values is not None:
        return sample_vertex_map(item.values, triangles, triangle, weights)
    assert item.image is not None  # Map holds exactly one of the two
    return sample_image_map(item.image, mesh, triangles, triangle, weights)


def density_at(
    item: Map | None, mesh: Mesh, triangles: Triangles
) -> Callable[[NDArray[np.int32], NDArray[np.float32]], NDArray[np.float32]] | None:
    """The density a scatter asks for at its candidates, 0 .. 1, from a map; None without one."""
    if item is None:
        return None
    return lambda triangle, weights: np.clip(sample_map(item, mesh, triangles, triangle, weights), 0.0, 1.0)


def at_vertices(item: Map, mesh: Mesh) -> NDArray[np.float32]:
    """A map as one value for each vertex, (V,) float32: its own, or an image read at the UVs of the corners there."""
    if item.values is not None:
        return item.values
    assert item.image is not None  # Map holds exactly one of the two
    if mesh.uvs is None:
        raise UserError("an image map needs UVs and this mesh has none; paint per vertex or unwrap the mesh first")
    count = np.bincount(mesh.corners, minlength=len(mesh.points))
    total = np.bincount(mesh.corners, sample_image(item.image, mesh.uvs), len(mesh.points))
    return (total / np.maximum(count, 1)).astype(np.float32)

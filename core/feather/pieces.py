"""What a feather is drawn and written as: triangles with a direction of fibre, a colour and how they take the light."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


class Optics(NamedTuple):
    """What is one for a whole feather: the wash of the underside (linear RGB, strength) and the thin film."""

    under: tuple[float, float, float, float] = (0.5, 0.5, 0.5, 0.0)
    film_index: float = 1.56
    film_spread: float = 0.5


class FeatherMesh(NamedTuple):
    """Triangles in the feather's frame, metres; V vertices.

    points, normals, fibres : (V, 3) float32; fibres are unit, along the barb, hair or shaft.
    colors : (V, 3) float32, linear. light : (V, 4) float32: gloss, roughness in radians, anisotropy, transmission.
    film : (V, 2) float32: strength of the iridescence and thickness in nanometres. opacity : (V,) float32.
    flat : (V, 2) float32, across and along in the flat feather, in shaft lengths (-1 .. 1, 0 .. 1.2).
    triangles : (T, 3) int32. optics : of the whole feather.
    picture : (H, W, 4) uint8 or None, sRGB and opacity of a card, over `flat` from `corner` with `extent`.
    """

    points: Floats
    normals: Floats
    fibres: Floats
    colors: Floats
    light: Floats
    film: Floats
    opacity: Floats
    flat: Floats
    triangles: NDArray[np.int32]
    optics: Optics = Optics()
    picture: NDArray[np.uint8] | None = None
    corner: tuple[float, float] = (0.0, 0.0)
    extent: tuple[float, float] = (1.0, 1.0)


def unit(vectors: NDArray[Any]) -> NDArray[Any]:
    """Vectors (..., 3) with length 1; zeros stay zeros."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-20))


def joined(parts: list[FeatherMesh]) -> FeatherMesh:
    """Several meshes as one, with the optics of the first."""
    starts = np.cumsum([0, *(len(part.points) for part in parts[:-1])])
    points, normals, fibres, colors, light, film, opacity, flat = (
        np.concatenate(column) for column in zip(*(part[:8] for part in parts), strict=True)
    )
    triangles = np.concatenate([part.triangles + np.int32(at) for part, at in zip(parts, starts, strict=True)])
    return FeatherMesh(
        points, normals, fibres, colors, light, film, opacity, flat, triangles, parts[0].optics
    )  # fmt: skip


def strips(count: int, points: int) -> NDArray[np.int32]:
    """Triangles of `count` strips whose vertices are numbered (strip, point, left or right)."""
    first = 2 * np.arange(points - 1)[None, :, None] + 2 * points * np.arange(count)[:, None, None]
    quads = np.concatenate([first + np.array([0, 3, 1]), first + np.array([0, 2, 3])], axis=-1)
    return np.asarray(quads.reshape(-1, 3), np.int32)


def grid_triangles(rows: int, columns: int) -> NDArray[np.int32]:
    """Triangles of a grid of vertices, row by row, that face the side from which rows run up and columns right."""
    at = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1, 1)
    quads = np.concatenate([at + np.array([0, 1, columns + 1]), at + np.array([0, columns + 1, columns])], axis=-1)
    return np.asarray(quads.reshape(-1, 3), np.int32)


def tangents(curves: NDArray[Any]) -> NDArray[Any]:
    """Unit directions (B, P, 3) along curves (B, P, 3)."""
    return unit(np.gradient(curves, axis=1))


def ribbons(
    curves: Floats, across: NDArray[Any], half: NDArray[Any], round_by: float, other_half: NDArray[Any] | None = None
) -> tuple[Floats, Floats, Floats, NDArray[np.int32]]:
    """Flat ribbons along curves (B, P, 3): points, normals and fibres (B * P * 2, 3), and triangles.

    across : (B, P, 3) unit, square to the curves. half : (B, P) half the width, metres; `other_half` that towards
        `across` where it differs.
    round_by : how far normals lean outwards at the edges, so that a ribbon takes the light as a round fibre would.
    """
    along = tangents(curves)
    normal = unit(np.cross(along, across))
    other = half if other_half is None else other_half
    points = np.stack([curves - across * half[..., None], curves + across * other[..., None]], axis=2)
    normals = unit(np.stack([normal - round_by * across, normal + round_by * across], axis=2))
    fibres = np.repeat(along[:, :, None], 2, axis=2)
    count, length = curves.shape[:2]
    flat = [np.ascontiguousarray(a.reshape(-1, 3), np.float32) for a in (points, normals, fibres)]
    return flat[0], flat[1], flat[2], strips(count, length)

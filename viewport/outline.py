"""What bounds a scene: a few dozen of its points, remembered as long as its arrays are the same."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewport.kept import same
from viewport.scene import Scene, all_points

DIRECTIONS = 80  # over half a sphere: none is more than 0.25 radians from one of them or its opposite
POINTS_AT_ONCE = 1 << 10  # that stay in the cache; products so small are made without waiting for other threads


def _half_sphere(count: int) -> NDArray[np.float32]:
    """(count, 3) unit directions, spread evenly over a half sphere by the golden angle."""
    i = np.arange(count) + 0.5
    z, angle = i / count, i * np.pi * (3.0 - np.sqrt(5.0))
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1).astype(np.float32)


_SPREAD = np.concatenate([np.eye(3, dtype=np.float32), _half_sphere(DIRECTIONS)])


def outline_points(scene: Scene) -> NDArray[np.float32]:
    """(M, 3): the outermost points of :func:`viewport.scene.all_points` along even directions; none of an empty scene.

    Along the axes of the world they bound the scene exactly; along any other direction to a fiftieth of its size.
    """
    arrays = [np.asarray(points, np.float32) for points in all_points(scene) if len(points)]
    if not arrays:
        return np.zeros((0, 3), np.float32)
    points = np.concatenate(arrays)
    across = np.ptp(points[:: 1 + len(points) // POINTS_AT_ONCE], axis=0)
    spread = _SPREAD / np.maximum(across, 1e-6 * max(float(across.max()), 1e-30))  # as even for flat and long scenes
    return _outermost(_outermost(points, spread), spread)


def _outermost(points: NDArray[np.float32], spread: NDArray[np.float32]) -> NDArray[np.float32]:
    """Those of the points (N, 3) that lie farthest along a direction (K, 3) or against it among POINTS_AT_ONCE."""
    found = []
    for start in range(0, len(points), POINTS_AT_ONCE):
        part = points[start : start + POINTS_AT_ONCE]
        along = spread @ part.T
        found.append(part[np.unique(np.concatenate([along.argmin(axis=1), along.argmax(axis=1)]))])
    return np.concatenate(found)


class Outline:
    """The outline of the scene asked for last."""

    def __init__(self) -> None:
        self._key: tuple[np.ndarray, ...] | None = None
        self._points = np.zeros((0, 3), np.float32)

    def of(self, scene: Scene) -> NDArray[np.float32]:
        """See :func:`outline_points`."""
        key = (
            *(surface.points for surface in scene.surfaces), *(coat.points for coat in scene.coats),
            *(lines.points for lines in scene.guides),
            *(mesh.points for mesh in scene.quick_feathers or scene.feathers),
        )
        if not same(self._key, key):
            self._key, self._points = key, outline_points(scene)
        return self._points

    def changed(self) -> None:
        """An array was written to in place."""
        self._key = None


def extent(points: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest corner (3,) of points (M, 3); a unit box when there are none."""
    if len(points) == 0:
        return np.full(3, -0.5), np.full(3, 0.5)
    return points.min(axis=0).astype(np.float64), points.max(axis=0).astype(np.float64)

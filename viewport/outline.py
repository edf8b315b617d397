"""What bounds a scene: a few dozen of its points, remembered as long as its arrays are the same."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewport.kept import same
from viewport.scene import Scene, bounding_points, point_arrays

DIRECTIONS = 80  # over half a sphere: none is more than 0.25 radians from one of them or its opposite
POINTS_AT_ONCE = 1 << 10  # that stay in the cache; products so small are made without waiting for other threads


def _half_sphere(count: int) -> NDArray[np.float32]:
    """(count, 3) unit directions, spread evenly over a half sphere by the golden angle."""
    i = np.arange(count) + 0.5
    z, angle = i / count, i * np.pi * (3.0 - np.sqrt(5.0))
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1).astype(np.float32)


_SPREAD = np.concatenate([np.eye(3, dtype=np.float32), _half_sphere(DIRECTIONS)])


def outline_points(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """(M, 3): the outermost of some points (N, 3) along even directions; none of none.

    Along the axes of the world they bound them exactly; along any other direction to a fiftieth of their size.
    """
    if len(points) == 0:
        return np.zeros((0, 3), np.float32)
    across = np.ptp(points[:: 1 + len(points) // POINTS_AT_ONCE], axis=0)
    spread = _SPREAD / np.maximum(across, 1e-6 * max(float(across.max()), 1e-30))  # as even for what is flat or long
    return _outermost(_outermost(np.asarray(points, np.float32), spread), spread)


def _outermost(points: NDArray[np.float32], spread: NDArray[np.float32]) -> NDArray[np.float32]:
    """Those of the points (N, 3) that lie farthest along a direction (K, 3) or against it among POINTS_AT_ONCE."""
    found = []
    for start in range(0, len(points), POINTS_AT_ONCE):
        part = points[start : start + POINTS_AT_ONCE]
        along = spread @ part.T
        found.append(part[np.unique(np.concatenate([along.argmin(axis=1), along.argmax(axis=1)]))])
    return np.concatenate(found)


class Outline:
    """The outline of the scene asked for last: of an array that is still the same it is remembered."""

    def __init__(self) -> None:
        self._parts: list[tuple[np.ndarray, NDArray[np.float32]]] = []  # arrays of the scene and their outlines
        self._points: NDArray[np.float32] | None = None

    def of(self, scene: Scene) -> NDArray[np.float32]:
        """(M, 3): the outermost points of everything, as :func:`outline_points` gives them."""
        arrays = point_arrays(scene)
        if self._points is None or not same(tuple(array for array, _ in self._parts), tuple(arrays)):
            known = {id(array): points for array, points in self._parts}
            self._parts = [
                (array, known[id(array)] if id(array) in known else outline_points(bounding_points(array)))
                for array in arrays]
            parts = [points for _, points in self._parts]
            self._points = outline_points(np.concatenate([np.zeros((0, 3), np.float32), *parts]))
        return self._points

    def changed(self, points: np.ndarray) -> None:
        """One of the arrays was written to in place."""
        self._parts = [part for part in self._parts if part[0] is not points]
        self._points = None


def extent(points: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest corner (3,) of points (M, 3); a unit box when there are none."""
    if len(points) == 0:
        return np.full(3, -0.5), np.full(3, 0.5)
    return points.min(axis=0).astype(np.float64), points.max(axis=0).astype(np.float64)

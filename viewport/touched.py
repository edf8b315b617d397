"""Where on the screen hair has moved: coarse cells, and which strands may reach into any of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera, project

CELL = 16  # pixels on a side
MOVED_MARGIN, REACH_MARGIN = 24.0, 12.0  # pixels around a strand that moved, and around one that may be drawn again


class Touched:
    """Cells of a picture of `size` (width, height) pixels in which something moved."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        self.cells = np.zeros((-(-size[1] // CELL), -(-size[0] // CELL)), np.bool_)

    def add(self, points: np.ndarray, rows: NDArray[np.integer], camera: Camera) -> None:
        """These rows of strands (N, 3, P) or (N, P, 3) moved; one that passes the eye touches everything."""
        if len(rows) == 0:
            return
        xy, depth = project(camera, _ends(points, rows), *self.size)
        if (depth <= camera.near).any():
            self.cells[:] = True
            return
        left, top, right, bottom = self._cells_of(xy, MOVED_MARGIN)
        steps = np.zeros((self.cells.shape[0] + 1, self.cells.shape[1] + 1), np.int32)
        for y, x, step in ((top, left, 1), (top, right, -1), (bottom, left, -1), (bottom, right, 1)):
            np.add.at(steps, (y, x), step)
        self.cells |= steps.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0

    def reached_by(self, points: np.ndarray, camera: Camera) -> NDArray[np.integer]:
        """Rows of strands (N, 3, P) or (N, P, 3) of which a part may lie in a touched cell."""
        left, top, right, bottom = self._cells_of(
            project(camera, _ends(points, np.arange(len(points))), *self.size).xy, REACH_MARGIN)
        before = np.zeros((self.cells.shape[0] + 1, self.cells.shape[1] + 1), np.int32)
        before[1:, 1:] = self.cells.cumsum(axis=0).cumsum(axis=1)
        inside = before[bottom, right] - before[top, right] - before[bottom, left] + before[top, left]
        return np.flatnonzero(inside > 0)

    def _cells_of(self, xy: NDArray[np.float64], margin: float) -> tuple[NDArray[np.intp], ...]:
        """First and one past the last column and row of cells around places (k, n, 2): left, top, right, bottom, (n,).

        What lies outside the picture has no cells.
        """
        rows, columns = self.cells.shape
        most = 2.0 * CELL * np.array([columns, rows])  # far outside is outside
        low = np.floor(np.clip(xy.min(axis=0) - margin, -most, most) / CELL).astype(np.intp)
        high = np.floor(np.clip(xy.max(axis=0) + margin, -most, most) / CELL).astype(np.intp) + 1
        return (
            np.clip(low[:, 0], 0, columns), np.clip(low[:, 1], 0, rows),
            np.clip(high[:, 0], 0, columns), np.clip(high[:, 1], 0, rows),
        )


def _ends(points: np.ndarray, rows: NDArray[np.integer]) -> np.ndarray:
    """(3, n, 3): root, middle and tip of these rows of strands."""
    at = [0, (points.shape[2] if points.shape[1] == 3 else points.shape[1]) // 2, -1]
    return np.stack([points[rows][:, :, k] if points.shape[1] == 3 else points[rows, k] for k in at])

"""Places on a polygon mesh that stay on the skin when it deforms."""

from __future__ import annotations

import numpy as np

from core.record import Record, column


class Roots(Record):
    """Points bound to a mesh: face + weights of three of that face's corners + UV + rest frame.

    faces : (N,) int32, face of the mesh.
    corners : (N, 3) int32, which corners of that face (0 .. its corner count - 1).
    weights : (N, 3) float32, of those corners, summing to 1.
    uvs : (N, 2) float32 (zero where the mesh has none).
    frames : (N, 3, 3) float32, rest frame, rows tangent, bitangent, normal in object space.
    """

    faces: np.ndarray
    corners: np.ndarray
    weights: np.ndarray
    uvs: np.ndarray
    frames: np.ndarray

    def __post_init__(self) -> None:
        column(self, "faces", np.int32, (None,))
        n = len(self.faces)
        column(self, "corners", np.int32, (n, 3))
        column(self, "weights", np.float32, (n, 3))
        column(self, "uvs", np.float32, (n, 2))
        column(self, "frames", np.float32, (n, 3, 3))

    def take(self, rows: np.ndarray) -> Roots:
        """The roots of the given rows (indices or mask), in that order."""
        return Roots(
            faces=self.faces[rows], corners=self.corners[rows], weights=self.weights[rows],
            uvs=self.uvs[rows], frames=self.frames[rows],
        )

    def join(self, other: Roots) -> Roots:
        """These roots followed by the `other` ones."""
        return Roots(
            faces=np.concatenate([self.faces, other.faces]), corners=np.concatenate([self.corners, other.corners]),
            weights=np.concatenate([self.weights, other.weights]), uvs=np.concatenate([self.uvs, other.uvs]),
            frames=np.concatenate([self.frames, other.frames]),
        )

"""A polygon mesh as a record: what the artist brought, polygons kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.record import Record, column


class Mesh(Record, kw_only=True):
    """Polygons with per-corner UVs.

    points : (V, 3) float32, metres, object space, at rest.
    counts : (F,) int32, corners of each face (>= 3).
    corners : (C,) int32, the vertex of each corner, faces one after another, C = sum of counts.
    uvs : (C, 2) float32 or None; seams survive because UVs belong to corners.
    parts : (F,) int32, index into `part_names` of each face (OBJ groups, USD prims, glTF nodes).
    part_names : at least one name when there are faces.
    """

    points: np.ndarray
    counts: np.ndarray
    corners: np.ndarray
    uvs: np.ndarray | None = None
    parts: np.ndarray
    part_names: tuple[str, ...]

    def __post_init__(self) -> None:
        column(self, "points", np.float32, (None, 3))
        column(self, "counts", np.int32, (None,))
        column(self, "corners", np.int32, (int(self.counts.sum(dtype=np.int64)),))
        column(self, "parts", np.int32, (len(self.counts),))
        if self.uvs is not None:
            column(self, "uvs", np.float32, (len(self.corners), 2))
        if len(self.counts) and (self.counts.min() < 3):
            raise ValueError("Mesh.counts holds a face with fewer than 3 corners")
        if len(self.corners) and not (self.corners.min() >= 0 and self.corners.max() < len(self.points)):
            raise ValueError("Mesh.corners names a vertex that does not exist")
        if len(self.parts) and not (self.parts.min() >= 0 and self.parts.max() < len(self.part_names)):
            raise ValueError("Mesh.parts names a part that does not exist")

    @property
    def starts(self) -> NDArray[np.int32]:
        """First corner of each face, (F,) int32."""
        return (np.cumsum(self.counts) - self.counts).astype(np.int32)


class Triangles(Record):
    """The triangulation of a mesh (derived, never in a document).

    vertices : (T, 3) int32, vertices of each triangle.
    corners : (T, 3) int32, the mesh corners (indices into Mesh.corners) of each triangle.
    faces : (T,) int32, the face each triangle is a piece of.
    """

    vertices: np.ndarray
    corners: np.ndarray
    faces: np.ndarray

    def __post_init__(self) -> None:
        column(self, "vertices", np.int32, (None, 3))
        column(self, "corners", np.int32, (len(self.vertices), 3))
        column(self, "faces", np.int32, (len(self.vertices),))

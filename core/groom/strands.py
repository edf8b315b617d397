"""Strands: curves of any lengths as files carry them (interchange, not editing)."""

from __future__ import annotations

import numpy as np

from core.record import Record, column


class Strands(Record):
    """A bundle of curves, flat points and counts; every column but the first two may be None.

    counts : (S,) int32, points of each strand (>= 2).
    points : (sum of counts, 3) float32, metres, Y up, root first.
    widths : (sum of counts,) float32, DIAMETERS in metres, per point.
    ids : (S,) int32, stable ids.
    root_uvs : (S, 2) float32.
    colors : (sum of counts, 3) float32, linear RGB per point.
    guide_ids : (S, 3) int32, ids of the three guides a child was grown from (children only).
    guide_weights : (S, 3) float32.
    """

    counts: np.ndarray
    points: np.ndarray
    widths: np.ndarray | None = None
    ids: np.ndarray | None = None
    root_uvs: np.ndarray | None = None
    colors: np.ndarray | None = None
    guide_ids: np.ndarray | None = None
    guide_weights: np.ndarray | None = None

    def __post_init__(self) -> None:
        column(self, "counts", np.int32, (None,))
        strands, points = len(self.counts), int(self.counts.sum(dtype=np.int64))
        if strands and self.counts.min() < 2:
            raise ValueError("Strands.counts holds a strand with fewer than 2 points")
        column(self, "points", np.float32, (points, 3))
        for name, dtype, shape in (
            ("widths", np.float32, (points,)), ("ids", np.int32, (strands,)),
            ("root_uvs", np.float32, (strands, 2)), ("colors", np.float32, (points, 3)),
            ("guide_ids", np.int32, (strands, 3)), ("guide_weights", np.float32, (strands, 3)),
        ):
            if getattr(self, name) is not None:
                column(self, name, dtype, shape)

    def __len__(self) -> int:
        return len(self.counts)


class GroomStrands(Record):
    """What a groom file holds: guides and children (either may be None), with the groom's name."""

    name: str = "groom"
    guides: Strands | None = None
    children: Strands | None = None

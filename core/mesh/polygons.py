"""What a reader hands over: the faces of a file as they stand there, sound or not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Polygons(NamedTuple):
    """The faces of a file before anything is believed.

    points : (V, 3) float64, any values.
    counts : (F,) int64, corners of each face, any values >= 0.
    corners : (C,) int64, any values.
    uvs : (C, 2) float32, NaN where a corner has none, or None.
    parts : (F,) int32 rows of `part_names`.
    """

    points: np.ndarray
    counts: np.ndarray
    corners: np.ndarray
    uvs: np.ndarray | None
    parts: np.ndarray
    part_names: tuple[str, ...]

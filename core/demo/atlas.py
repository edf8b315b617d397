"""Laying UV islands side by side in the unit square, all at one scale."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.demo.cage import Face

Array = NDArray[np.float64]


def atlas(faces: list[Face], margin: float = 0.008) -> Array:
    """UVs (faces, 4, 2) in 0 .. 1 without overlap, from corners in metres per island.

    Islands stand on shelves, tallest first; the width of the shelves is chosen so that the square is filled best.
    `margin` is kept around each island, as a fraction of the square.
    """
    names = sorted({face.island for face in faces})
    boxes = {}
    for name in names:
        uvs = np.concatenate([face.uvs for face in faces if face.island == name])
        boxes[name] = (uvs.min(axis=0), np.ptp(uvs, axis=0))
    order = sorted(names, key=lambda name: (-boxes[name][1][1], name))
    widest, total = max(box[1][0] for box in boxes.values()), sum(box[1][0] for box in boxes.values())
    best_size, best_places = np.inf, {}
    for width in np.linspace(widest, total, 200):
        gap = margin * width
        places, x, y, shelf, reach = {}, gap, gap, 0.0, 0.0
        for name in order:
            w, h = boxes[name][1]
            if x + w + gap > width + 2.0 * gap and x > gap:
                x, y, shelf = gap, y + shelf + gap, 0.0
            places[name] = np.array([x, y])
            x, shelf = x + w + gap, max(shelf, h)
            reach = max(reach, x)
        size = max(reach, y + shelf + gap)
        if size < best_size:
            best_size, best_places = size, places
    return np.array([(face.uvs - boxes[face.island][0] + best_places[face.island]) / best_size for face in faces])

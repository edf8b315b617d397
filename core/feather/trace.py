"""A feather in a photograph: told from what lies behind it, its shaft and outline measured, its colours sampled.

The feather lies flat, whole and alone on a plain ground. Ground: the median of the picture's rim; feather: what differs
from it (Otsu 1979), its largest piece. Its shaft is taken for straight, from the quill, which is the narrow end.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.feather.attributes import column, limits
from core.feather.outline import fitted_outline
from core.feather.surface import START

SMALL, LARGE = 0.002, 0.9  # of the picture: outside this it shows no feather
SIDE = 1400  # pixels; larger pictures are made smaller first
BINS = 96  # along the shaft
EDGE = 0.985  # of the pixels of a row lie nearer to the shaft than its edge: single barbs that stray do not count
NARROW = 0.06  # of the length: what is measured to tell quill from tip
THIN = 1.6  # times as wide as the quill a row still is the quill
BANDS = (("colorBase", 0.05, 0.3), ("colorMiddle", 0.4, 0.65), ("colorTip", 0.75, 0.98))  # shares of the vane


def traced(image: NDArray[np.uint8], values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Attributes (K,) of a feather like `values`, with the outline and the colours of the one in a photograph.

    Parameters
    ----------
    image : (H, W, 3) uint8 sRGB, top row first.

    Raises
    ------
    UserError
        There is no feather to be told from the ground.
    """
    scale = SIDE / max(image.shape[:2])
    if scale < 1.0:
        image = np.asarray(cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8)
    mask = _feather(image)
    rows, columns = np.nonzero(mask)
    places = _along_and_across(np.stack([columns, -rows], axis=1).astype(np.float64))
    out = np.array(values, np.float32)
    edges = (np.arange(BINS) + 0.5) / BINS
    bins = np.clip((places[:, 1] * BINS).astype(int), 0, BINS - 1)
    wide = np.array([[_edge(places[(bins == k) & ((places[:, 0] > 0) == bool(side)), 0]) for k in range(BINS)]
                     for side in (0, 1)])
    quill = float(np.median(wide.sum(axis=0)[: max(round(NARROW * BINS), 1)]))
    open_rows = np.flatnonzero(wide.sum(axis=0) > THIN * quill)
    first = int(open_rows[0]) if len(open_rows) else 0
    for side in (0, 1):
        line = np.stack([wide[side, first:], edges[first:]], axis=1)
        ends = np.array([[0.0, edges[first] - 0.5 / BINS], [0.0, 1.0]])
        out = fitted_outline(out, side, np.concatenate([ends[:1], line, ends[1:]]))
    return _colored(out, image[rows, columns], places[:, 1])


def _feather(image: NDArray[np.uint8]) -> NDArray[np.bool_]:
    lab = cv2.cvtColor(image, cv2.COLOR_RGB2LAB).astype(np.float32)
    rim = np.concatenate([lab[0], lab[-1], lab[:, 0], lab[:, -1]])
    apart = np.linalg.norm(lab - np.median(rim, axis=0), axis=2)
    apart = np.asarray(np.clip(apart * (255.0 / max(float(apart.max()), 1e-6)), 0, 255), np.uint8)
    _, found = cv2.threshold(apart, 0, 1, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    found = cv2.morphologyEx(found, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(found)
    if count < 2:
        raise UserError("There is no feather in this picture; lay one on a plain ground of another colour.")
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    share = float(stats[largest, cv2.CC_STAT_AREA]) / found.size
    if not SMALL < share < LARGE:
        raise UserError("No feather can be told from the ground; lay one on a plain ground of another colour.")
    return np.asarray(labels == largest)


def _along_and_across(pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pixels (N, 2), x right and y up, as across (right above 0) and along the shaft, in shaft lengths."""
    middle = pixels.mean(axis=0)
    way = np.linalg.svd((pixels - middle)[:: max(len(pixels) // 20_000, 1)], full_matrices=False)[2][0]
    along = (pixels - middle) @ way
    low, high = along.min(), along.max()
    across = (pixels - middle) @ np.array([way[1], -way[0]])
    reach = NARROW * (high - low)
    if np.ptp(across[along > high - reach]) < np.ptp(across[along < low + reach]):  # the quill is the other end
        way = -way
    along = (pixels - middle) @ way
    order = np.argsort(along)
    few = max(len(order) // 400, 3)
    root, tip = (pixels[part].mean(axis=0) for part in (order[:few], order[-few:]))
    way = (tip - root) / max(float(np.linalg.norm(tip - root)), 1e-9)
    along = (pixels - root) @ way
    length = max(float(along.max() - along.min()), 1e-9)
    across = (pixels - root) @ np.array([way[1], -way[0]])
    return np.stack([across, along - along.min()], axis=1) / length


def _edge(across: NDArray[np.float64]) -> float:
    return float(np.quantile(np.abs(across), EDGE)) if len(across) else 0.0


def _colored(
    values: NDArray[np.float32], colors: NDArray[np.uint8], along: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Attributes with the median colours of three bands of the vane."""
    out = values.copy()
    low, high = limits()
    start = float(values[START : START + 2].mean())
    encoded = colors.astype(np.float64) / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    share = (along - start) / max(1.0 - start, 1e-3)
    for name, first, last in BANDS:
        inside = (share > first) & (share < last)
        if inside.any():
            at = column(f"{name}Red")
            out[at : at + 3] = np.clip(np.median(linear[inside], axis=0), low[at : at + 3], high[at : at + 3])
    return out

"""Where things went between two frames that lie far apart: sparse matches that agree with their neighbours.

A camera that jumps, or one that takes a picture a second, moves a pattern further than any search reaches. Corners
with descriptors (Lowe, "Distinctive image features from scale-invariant keypoints", IJCV 60, 2004) are matched both
ways; a match is believed when several of its nearest neighbours moved alike. Nothing is believed over a cut.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from core.image.mix import grey_bytes

LONGEST = 1024  # pixels: larger frames are looked at smaller
MOST_CORNERS = 2000
DISTINCT = 0.8  # distance to the nearest descriptor over that to the second
NEIGHBOURS, AGREE = 10, 4
STRETCH, LOOSE = 0.3, 6.0  # neighbours may move apart by this share of their distance, and so many pixels
FEWEST = 12
AROUND = 8  # matches a place is carried by
REACH = 0.15  # of the longest side: further from all matches nothing is said


class Guide(NamedTuple):
    """Matches (M, 2) between two frames, in pixels; reach is how far from one the others are believed."""

    first: NDArray[np.float64]
    second: NDArray[np.float64]
    reach: float


def guide_between(first: NDArray[np.float32], second: NDArray[np.float32]) -> Guide | None:
    """Matches between two frames (H, W, C), or None when too few agree."""
    longest = max(first.shape[:2])
    scale = min(1.0, LONGEST / longest)
    corners, descriptors = zip(*(_corners(image, scale) for image in (first, second)), strict=True)
    if min(len(found) for found in corners) < FEWEST:
        return None
    there = _nearest(descriptors[0], descriptors[1])
    back = _nearest(descriptors[1], descriptors[0])
    rows = np.flatnonzero((there >= 0) & (back[np.maximum(there, 0)] == np.arange(len(there))))
    if len(rows) < FEWEST:
        return None
    a, b = corners[0][rows], corners[1][there[rows]]
    # several corners of one place are one witness
    _, single = np.unique(np.round(a / 2.0), axis=0, return_index=True)
    a, b = a[single], b[single]
    agreed = _agreeing(a, b, LOOSE / scale)
    if agreed.sum() < FEWEST:
        return None
    return Guide(a[agreed], b[agreed], REACH * longest)


def carried_by(guide: Guide, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where points (N, 2) of the first frame lie in the second, and the matrices (N, 2, 2) that turn and scale what is
    around them; not finite where the guide says nothing."""
    places, linear = np.full((len(points), 2), np.nan), np.full((len(points), 2, 2), np.nan)
    near = min(AROUND, len(guide.first))
    distance, index = cKDTree(guide.first).query(points, near)
    for n in np.flatnonzero(distance[:, 0] < guide.reach):
        a, b = guide.first[index[n]], guide.second[index[n]]
        matrix, inliers = cv2.estimateAffinePartial2D(a, b, method=cv2.LMEDS)
        if matrix is None or inliers.sum() < AGREE or not 0.2 < np.hypot(*matrix[:, 0]) < 5.0:
            continue
        places[n] = matrix[:, :2] @ points[n] + matrix[:, 2]
        linear[n] = matrix[:, :2]
    return places, linear


def _corners(image: NDArray[np.float32], scale: float) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    grey = grey_bytes(image)
    if scale < 1.0:
        grey = np.asarray(cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8)
    # a low threshold: dark plates have little contrast
    keys, descriptors = cv2.SIFT.create(nfeatures=MOST_CORNERS, contrastThreshold=0.02).detectAndCompute(grey, None)
    if not keys:
        return np.zeros((0, 2)), np.zeros((0, 128), np.float32)
    places = np.array([key.pt for key in keys], np.float64)
    # pixel centres at whole numbers, at both sizes
    return (places + 0.5) / scale - 0.5, np.sqrt(descriptors / np.maximum(descriptors.sum(axis=1, keepdims=True), 1e-6))


def _nearest(first: NDArray[np.float32], second: NDArray[np.float32]) -> NDArray[np.int64]:
    """For every descriptor of `first` the row of its nearest in `second`, -1 where the second nearest is as near."""
    likeness = first @ second.T  # of unit vectors: Hellinger's kernel (Arandjelovic & Zisserman 2012)
    two = np.argpartition(-likeness, 1, axis=1)[:, :2]
    close = np.take_along_axis(likeness, two, axis=1)
    best = two[np.arange(len(first)), np.argmax(close, axis=1)]
    distance = np.sqrt(np.maximum(2.0 - 2.0 * np.sort(close, axis=1), 0.0))  # second nearest, nearest
    return np.where(distance[:, 1] < DISTINCT * distance[:, 0], best, -1)


def _agreeing(a: NDArray[np.float64], b: NDArray[np.float64], loose: float) -> NDArray[np.bool_]:
    """Matches several of whose neighbours moved alike, told apart twice: the second time among believed ones."""
    good = np.ones(len(a), np.bool_)
    for _ in range(2):
        rows = np.flatnonzero(good)
        if len(rows) <= AGREE:
            return np.zeros(len(a), np.bool_)
        distance, index = cKDTree(a[rows]).query(a[rows], min(NEIGHBOURS + 1, len(rows)))
        moved = b[rows] - a[rows]
        apart = np.linalg.norm(moved[index[:, 1:]] - moved[:, None], axis=2)
        like = (apart < STRETCH * distance[:, 1:] + loose).sum(axis=1)
        good[rows] = like >= AGREE
    return good

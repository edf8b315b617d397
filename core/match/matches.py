"""The same places found in photographs: features of every picture, matched between pairs, joined into tracks.

(Lowe, "Distinctive Image Features from Scale-Invariant Keypoints", 2004; the root of the descriptors by Arandjelovic
and Zisserman, "Three things everyone should know to improve object retrieval", 2012.)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Array = NDArray[np.float64]

RATIO = 0.8  # of the distances of the nearest and the next feature
NEAR = 3.0  # pixels from the epipolar line
LEAST = 20  # matches of a pair


class Features(NamedTuple):
    """xy : (N, 2) float64 pixels, centres at whole numbers. words : (N, 128) float32 descriptors."""

    xy: Array
    words: NDArray[np.float32]


def features(grey: NDArray[np.uint8], most: int = 4000) -> Features:
    """The strongest features of a picture (H, W) uint8."""
    points, words = cv2.SIFT.create(most, contrastThreshold=0.02).detectAndCompute(grey, None)
    if words is None or not len(points):
        return Features(np.zeros((0, 2)), np.zeros((0, 128), np.float32))
    words = np.sqrt(words / np.maximum(words.sum(axis=1, keepdims=True), 1e-9)).astype(np.float32)
    xy = np.array([point.pt for point in points], np.float64)
    _, first = np.unique(xy.round(2), axis=0, return_index=True)  # one place has one feature, whatever its directions
    return Features(xy[np.sort(first)], words[np.sort(first)])


def matched(a: Features, b: Features) -> NDArray[np.int64]:
    """(M, 2) rows of features of two pictures that are alike, nearest to each other, and agree with one epipolar
    geometry; none when fewer than `LEAST` are left."""
    none = np.zeros((0, 2), np.int64)
    if min(len(a.xy), len(b.xy)) < LEAST:
        return none
    alike = a.words @ b.words.T  # unit vectors: the nearest has the largest product
    there, back = alike.argmax(axis=1), alike.argmax(axis=0)
    two = -np.partition(-alike, 1, axis=1)[:, :2]
    near = np.sqrt(np.maximum(2.0 - 2.0 * two, 0.0))
    rows = np.flatnonzero((back[there] == np.arange(len(there))) & (near[:, 0] < RATIO * near[:, 1]))
    pairs = np.stack([rows, there[rows]], axis=1)
    if len(pairs) < LEAST:
        return none
    cv2.setRNGSeed(1)
    found, good = cv2.findFundamentalMat(
        a.xy[pairs[:, 0]], b.xy[pairs[:, 1]], cv2.USAC_MAGSAC, NEAR, 0.999, 2000,
    )
    if found is None or good is None:
        return none
    pairs = pairs[good.ravel() > 0]
    return pairs if len(pairs) >= LEAST else none


class Seen(NamedTuple):
    """N places: photograph (N,) and track (N,) int32, xy (N, 2) pixels, sorted by photograph. tracks : their number."""

    photograph: NDArray[np.int32]
    track: NDArray[np.int32]
    xy: Array
    tracks: int


def joined(found: Sequence[Features], pairs: dict[tuple[int, int], NDArray[np.int64]]) -> Seen:
    """Tracks through photographs from matches of pairs; one that meets a photograph twice is given up."""
    start = np.cumsum([0, *(len(one.xy) for one in found)])
    links = [start[[i, j]] + rows for (i, j), rows in pairs.items() if len(rows)]
    edges = np.concatenate(links) if links else np.zeros((0, 2), np.int64)
    graph = coo_array((np.ones(len(edges), np.int8), (edges[:, 0], edges[:, 1])), shape=(start[-1], start[-1]))
    group = connected_components(graph, directed=False)[1]
    picture = np.repeat(np.arange(len(found)), np.diff(start))
    key = group.astype(np.int64) * len(found) + picture
    twice = np.bincount(group, minlength=1) > np.bincount(np.unique(key) // len(found), minlength=1)
    kept = (np.bincount(group, minlength=1)[group] >= 2) & ~twice[group]
    names, track = np.unique(group[kept], return_inverse=True)
    xy = np.concatenate([one.xy for one in found]) if len(found) else np.zeros((0, 2))
    return Seen(picture[kept].astype(np.int32), track.astype(np.int32), np.ascontiguousarray(xy[kept]), len(names))


def matched_photographs(pictures: Sequence[NDArray[np.uint8]], most: int = 4000) -> Seen:
    """Tracks through grey photographs (H, W) uint8, every pair compared."""
    found = [features(picture, most) for picture in pictures]
    pairs = {
        (i, j): matched(found[i], found[j]) for i in range(len(found)) for j in range(i + 1, len(found))
    }
    return joined(found, pairs)

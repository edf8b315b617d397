"""Gaps of tracks filled by optical flow: from both ends, blended by how sure they are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.match.flow import Flow, flow_between
from core.match.join import Piece, between
from core.match.track import Track, gaps_of
from core.record import freeze
from core.workers import serial_ranges

Image = NDArray[np.float32]
FILLED = 0.5  # likeness that is written for a frame whose pattern was not seen


def fill_gaps(
    tracks: tuple[Track, ...],
    read: Callable[[int], Image | None],
    *,
    ranges: Any = serial_ranges,
    progress: Callable[[float], object] = lambda share: None,
    cancel: Callable[[], bool] | None = None,
) -> tuple[Track, ...]:
    """The tracks with what lies in their gaps foretold by the flow from frame to frame.

    read : gives a frame (H, W, C) float32 as tracking looks at it, or None for a missing one; there the flow ends. What
    is filled has the covariance of all the flow it hangs on, and where the ends do not meet, what they miss by; its own
    is all of it, so a solve weighs it as little as it deserves. A gap that flow does not reach stays.
    """
    pieces: dict[tuple[int, int, int], Piece] = {}
    steps = {(k, k + 1) for track in tracks for first, last in gaps_of(track) for k in range(first, last)}
    for direction in (1, -1):
        pairs = sorted(steps, reverse=direction < 0)
        image, at = None, None
        for n, pair in enumerate(pairs):
            if cancel is not None and cancel():
                return tracks
            here, there = pair[::direction]
            image = read(here) if at != here else image
            onward = read(there)
            if image is not None and onward is not None and image.shape == onward.shape:
                _carry(tracks, pieces, here, there, flow_between(image, onward, ranges=ranges, cancel=cancel))
            image, at = onward, there
            progress((n + 1 + (len(pairs) if direction < 0 else 0)) / (2 * len(pairs)))
    return tuple(_with_filled(track, pieces) for track in tracks)


def _carry(
    tracks: tuple[Track, ...], pieces: dict[tuple[int, int, int], Piece], here: int, there: int, flow: Flow
) -> None:
    """Every track that is in a gap between two frames one frame on."""
    direction = there - here
    for track in tracks:
        for gap in gaps_of(track):
            if not (gap[0] <= min(here, there) and max(here, there) <= gap[1]):
                continue
            key = (track.id, gap[0], direction)
            start = gap[0] if direction > 0 else gap[1]
            if here == start:
                row = int(np.flatnonzero(track.frames == here)[0])
                point, covariance = track.points[row], track.covariance[row]
                pieces[key] = Piece(track.id, start, direction, np.zeros(3))
            elif key in pieces and pieces[key].frames[-1:] == [here]:
                found = pieces[key].rows()[here]
                point, covariance = found[:2], found[2:5]
            else:
                continue
            if (at := _moved(flow, point)) is not None:
                whole = covariance + at[2:]
                pieces[key].add(there, point + at[:2], whole, whole, FILLED)


def _moved(flow: Flow, point: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Vector and covariance (5,) of the flow at a place between pixels; None outside."""
    height, width = flow.vectors.shape[:2]
    x, y = float(point[0]), float(point[1])
    if not (0.0 <= x <= width - 1 and 0.0 <= y <= height - 1):
        return None
    i, j = min(int(x), width - 2), min(int(y), height - 2)
    s, t = x - i, y - j
    weights = np.array([[(1 - s) * (1 - t), s * (1 - t)], [(1 - s) * t, s * t]])
    part = np.s_[j : j + 2, i : i + 2]
    values = np.concatenate((flow.vectors[part], flow.covariance[part]), axis=2).astype(np.float64)
    return np.asarray(np.einsum("yx,yxc->c", weights, values))


def _with_filled(track: Track, pieces: dict[tuple[int, int, int], Piece]) -> Track:
    rows: dict[int, NDArray[np.float64]] = {}
    for first, last in gaps_of(track):
        ends = {
            f: list(track.points[int(np.flatnonzero(track.frames == f)[0])]) for f in (first, last)}
        rows |= between(first, last, ends, pieces.get((track.id, first, 1)), pieces.get((track.id, first, -1)))
    if not rows:
        return track
    new = np.array(sorted(rows), np.int32)
    made = np.array([rows[int(f)] for f in new])
    order = np.argsort(np.concatenate((track.frames, new)), kind="stable")

    def joined(old: NDArray[Any], more: NDArray[Any]) -> NDArray[Any]:
        return freeze(np.ascontiguousarray(np.concatenate((old, more.astype(old.dtype)))[order]))

    return track.replace(
        frames=joined(track.frames, new), points=joined(track.points, made[:, :2]),
        covariance=joined(track.covariance, made[:, 2:5]), own=joined(track.own, made[:, 5:8]),
        score=joined(track.score, made[:, 8]))

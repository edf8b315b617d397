"""Frames between two frames of a plate, by the flow both ways: slow motion, to look at or to write.

The flow of either frame is carried along itself to the time between, where certain vectors count for more and what
comes to lie on one place is averaged; there it says where each pixel is taken from in both frames. What only one of
them shows is taken from that one. Baker et al., "A database and evaluation methodology for optical flow", IJCV 92,
2011, section 3.3.2.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from core.match.flow import Flow, flow_between
from core.match.flow_kernels import splat
from core.workers import serial_ranges

Field = NDArray[np.float32]
SURE = np.float32(0.01)  # px^2: flows more certain than this count alike
SEEN = 0.25  # of the weight of a whole pixel: with less, a frame does not show what is there
HOLE = 9  # pixels: side of the first neighbourhood that holes are filled from


class FlowPair(NamedTuple):
    """Flow from a frame to the next one, and back."""

    ahead: Flow
    back: Flow


def flow_pair(first: Field, second: Field, ranges: Any = serial_ranges, cancel: Any = None) -> FlowPair:
    """Both flows of two frames (H, W, C) float32."""
    return FlowPair(
        flow_between(first, second, ranges=ranges, cancel=cancel),
        flow_between(second, first, ranges=ranges, cancel=cancel))


def frames_at_speed(first: int, last: int, speed: float) -> list[float]:
    """The places on a plate, between its frames too, that its frames at another speed show."""
    count = int(np.floor((last - first) / speed + 1e-9)) + 1
    places = first + speed * np.arange(count)
    whole = np.rint(places)
    return [float(p) for p in np.where(np.abs(places - whole) < 1e-6, whole, places)]


def frame_between(first: NDArray[Any], second: NDArray[Any], pair: FlowPair, share: float) -> NDArray[Any]:
    """The frame at `share` of the way, 0 to 1, from the first (H, W, C) to the second; of their dtype.

    Shares of 0 and 1 give the frames themselves. Whole numbers are rounded.
    """
    if share <= 0.0 or share >= 1.0:
        return first if share <= 0.0 else second
    ahead = _carried(pair.ahead, share, 1.0)
    back = _carried(pair.back, 1.0 - share, -1.0)
    vectors = _filled(ahead + back)
    one = _taken(first, vectors, -share)
    two = _taken(second, vectors, 1.0 - share)
    here, there = ((1.0 - share) * _shown(ahead), share * _shown(back))
    weight = (here + 1e-3 * (1.0 - share)) / (here + there + 1e-3)
    out = weight[:, :, None] * one + (1.0 - weight[:, :, None]) * two
    if first.dtype.kind == "u":
        out = np.clip(np.rint(out), 0, np.iinfo(first.dtype).max)
    return np.asarray(out, first.dtype)


def _carried(flow: Flow, share: float, sign: float) -> Field:
    """Vectors and weights (H, W, 3), summed where they are at a share of the way; back ones turned about."""
    spread = 0.5 * (flow.covariance[:, :, 0] + flow.covariance[:, :, 2])
    weight = np.asarray(SURE / (SURE + spread), np.float32)
    out = np.empty((*weight.shape, 3), np.float32)
    splat(np.ascontiguousarray(flow.vectors, np.float32), weight, np.float32(share), out)
    out[:, :, :2] *= np.float32(sign)
    return out


def _filled(sums: Field) -> Field:
    """Vectors (H, W, 2) by sums of vectors and weights; holes from around, from wider and wider."""
    side, wide = HOLE, sums
    while not (wide[:, :, 2] > 1e-4).all():
        around = np.asarray(cv2.blur(sums, (side, side)), np.float32)
        wide = np.where(wide[:, :, 2:] > 1e-4, wide, around)
        if side > 2 * max(sums.shape[:2]):
            wide = wide + np.array([0.0, 0.0, 1.0], np.float32)  # nothing is known anywhere: it stands still
        side *= 2
    return np.asarray(wide[:, :, :2] / wide[:, :, 2:], np.float32)


def _taken(image: NDArray[Any], vectors: Field, share: float) -> Field:
    """A frame looked up at every pixel plus a share of its vector."""
    y, x = np.mgrid[0 : vectors.shape[0], 0 : vectors.shape[1]].astype(np.float32)
    at = np.float32(share) * vectors
    pixels = image.astype(np.float32)
    found = cv2.remap(pixels, x + at[:, :, 0], y + at[:, :, 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(found, np.float32).reshape(image.shape)


def _shown(sums: Field) -> Field:
    """1 where a frame shows what is there at the time between, less where it is hidden by what moves."""
    seen = np.asarray(cv2.blur(sums[:, :, 2], (3, 3)), np.float32)
    return np.minimum(seen / np.float32(SEEN), np.float32(1.0))

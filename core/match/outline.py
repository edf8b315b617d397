"""Outlines: closed shapes drawn on a plate, and the masks made of them that hold tracks off."""

from __future__ import annotations

from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.field import field
from core.record import Record, column, freeze, number, text

MOST_POINTS = 4096
BEND = 8  # straight pieces between two points of a curve
EIGHTHS = 3  # bits of a pixel that outlines are filled with


class Mask(Record):
    """A shape on a plate that holds tracks off, keyed over its frames.

    frames : (K,) int32 rising, K >= 1; as the files of the plate are counted. Before the first and after the last the
        shape stays as it is there, between two its points go straight.
    points : (K, P, 2) float64, P >= 3; pixels, the closed outline at every key.
    """

    id: int
    name: str
    frames: np.ndarray
    points: np.ndarray
    plate_id: int = 0
    smooth: Annotated[
        bool, field("Curve", "The outline is a smooth curve through its points instead of straight lines.")
    ] = False
    inverted: Annotated[bool, field("Inverted", "Holds tracks off everywhere but inside.")] = False
    hidden: bool = False
    locked: bool = False

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", "plate_id", least=0, most=2**31 - 1)
        column(self, "frames", np.int32, (None,))
        column(self, "points", np.float64, (len(self.frames), None, 2))
        if not len(self.frames) or (np.diff(self.frames) <= 0).any():
            raise ValueError("Mask.frames must hold a frame or more that rise")
        if not 3 <= self.points.shape[1] <= MOST_POINTS:
            raise ValueError(f"Mask.points must be 3 to {MOST_POINTS} at every key")


def outline_at(mask: Mask, frame: float) -> NDArray[np.float64]:
    """The points (P, 2) of a mask at a frame."""
    after = int(np.searchsorted(mask.frames, frame))
    if after == 0:
        return np.asarray(mask.points[0])
    if after == len(mask.frames):
        return np.asarray(mask.points[-1])
    first, last = int(mask.frames[after - 1]), int(mask.frames[after])
    way = (frame - first) / (last - first)
    return np.asarray((1.0 - way) * mask.points[after - 1] + way * mask.points[after])


def key_mask(mask: Mask, frame: int, points: NDArray[np.float64]) -> Mask:
    """The mask with that outline (P, 2) at `frame`; P is that of its other keys."""
    if points.shape != mask.points.shape[1:]:
        raise UserError(f"Mask {mask.name} has {mask.points.shape[1]} points at every key; move those it has.")
    rest = mask.frames != frame
    frames = np.append(mask.frames[rest], np.int32(frame))
    shapes = np.concatenate((mask.points[rest], [points]))
    order = np.argsort(frames)
    return mask.replace(frames=freeze(frames[order]), points=freeze(shapes[order]))


def unkey_mask(mask: Mask, frame: int) -> Mask:
    """The mask without its key at `frame`; the last key stays."""
    rest = mask.frames != frame
    if not rest.any():
        raise UserError(f"Mask {mask.name} has no other key; delete the mask itself.")
    return mask.replace(frames=freeze(mask.frames[rest]), points=freeze(mask.points[rest]))


def curve_through(points: NDArray[np.float64], pieces: int = BEND) -> NDArray[np.float64]:
    """The closed centripetal Catmull-Rom curve through points (P, 2), as P * pieces points (Yuksel et al. 2011)."""
    before, after, beyond = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0), np.roll(points, -2, axis=0)
    knots = [np.sqrt(np.linalg.norm(b - a, axis=1))[:, None, None] + 1e-9
             for a, b in ((before, points), (points, after), (after, beyond))]  # fmt: skip
    t0 = -knots[0]
    t2, t3 = knots[1], knots[1] + knots[2]
    t = t2 * (np.arange(pieces) / pieces)[:, None]
    p0, p1, p2, p3 = (p[:, None, :] for p in (before, points, after, beyond))
    a1 = (-t * p0 + (t - t0) * p1) / -t0
    a2 = ((t2 - t) * p1 + t * p2) / t2
    a3 = ((t3 - t) * p2 + (t - t2) * p3) / (t3 - t2)
    b1 = ((t2 - t) * a1 + (t - t0) * a2) / (t2 - t0)
    b2 = ((t3 - t) * a2 + t * a3) / t3
    return np.asarray((((t2 - t) * b1 + t * b2) / t2).reshape(-1, 2))


def filled(points: NDArray[np.float64], smooth: bool, height: int, width: int) -> NDArray[np.bool_]:
    """Pixels (H, W) whose centres lie inside a closed outline (P, 2), or within an eighth of a pixel of it."""
    out = np.zeros((height, width), np.uint8)
    corners = curve_through(points) if smooth else points
    # far outside the picture nothing is filled, and whole numbers of 32 bits must not run over
    corners = np.clip(corners, -16.0 * max(height, width), 16.0 * max(height, width))
    fixed = np.round(corners * (1 << EIGHTHS)).astype(np.int32)
    cv2.fillPoly(out, [fixed.reshape(-1, 1, 2)], 1, lineType=cv2.LINE_8, shift=EIGHTHS)
    return out.astype(np.bool_)


def held_off(masks: tuple[Mask, ...], frame: int, height: int, width: int) -> NDArray[np.bool_] | None:
    """Where masks hold tracks off at a frame (H, W), or None where there are none; hidden ones hold off too."""
    if not masks:
        return None
    out = np.zeros((height, width), np.bool_)
    for mask in masks:
        out |= filled(outline_at(mask, frame), mask.smooth, height, width) ^ mask.inverted
    return out

"""A shape drawn freely on the plate, as a roto mask or a pattern begins."""

from __future__ import annotations

from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray

from core.field import field
from core.overlay import Overlays, Polyline, Tone
from core.record import Record
from tools.ground import Pointer
from tools.match.craft import MatchGround

LEAST = 3  # points of a shape


class ShapeParams(Record):
    """What a drawn shape becomes."""

    smooth: Annotated[bool, field(
        "Curve", "New shapes are smooth curves through their points instead of straight lines.")] = True
    detail: Annotated[float, field(
        "Detail", "How far, in pixels of the view, a new shape may be off the way of the hand.", "px",
        (1.0, 12.0), (0.5, 40.0), step=0.5)] = 4.0


class Way:
    """The way of the hand over the plate, closed at the release.

    color : of the line that shows it.
    """

    def __init__(self, params: ShapeParams, ground: MatchGround, pointer: Pointer, color: Tone) -> None:
        self._params, self._ground, self._color = params, ground, color
        self._places = [ground.place(pointer)]

    def extend(self, pointers: tuple[Pointer, ...]) -> None:
        """The hand went on."""
        self._places += [self._ground.place(pointer) for pointer in pointers]

    @property
    def span(self) -> float:
        """The longer side of the box around it, in pixels of the plate."""
        return float(np.ptp(np.array(self._places), axis=0).max())

    def outline(self) -> NDArray[np.float64] | None:
        """As few points (P, 2) as keep near the way of the hand, or None when they make no shape."""
        off = self._params.detail / self._ground.scale
        way = np.array(self._places, np.float32).reshape(-1, 1, 2)
        points = cv2.approxPolyDP(way, off, True).reshape(-1, 2).astype(np.float64)
        return points if len(points) >= LEAST else None

    def overlays(self) -> Overlays:
        """The way so far."""
        there = self._ground.in_view(np.array(self._places))
        return (Polyline(there, self._color, 1.5, closed=True, dashed=True),)

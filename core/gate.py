"""The film gate: the picture of a film camera within the wider one of a view."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from core.camera import Camera, pixel_scale
from core.record import Record, number

HD = 16.0 / 9.0
AROUND = 1.08  # how much more than the gate a view shows that was opened for it
# parts of the gate that every screen shows: SMPTE ST 2046-1:2009, action and titles
SAFE = (0.93, 0.90)


class Gate(Record):
    """What a film camera takes of a view.

    aspect : width over height. height : of its picture at a distance of 1 (twice the tangent of half its vertical
        angle), of a camera with parallel rays in metres. orthographic : which of these it is.
    """

    aspect: float = HD
    height: float = 0.5
    orthographic: bool = False

    def __post_init__(self) -> None:
        number(self, "aspect", least=1e-3, most=1e3)
        number(self, "height", least=1e-9, most=1e12)


class Box(NamedTuple):
    """A rectangle in pixels, from the left upper to the right lower end."""

    left: float
    top: float
    right: float
    bottom: float


def gate_of(camera: Camera, aspect: float) -> Gate:
    """The gate of a camera whose own picture has an aspect."""
    return Gate(aspect=aspect, height=_height(camera), orthographic=camera.orthographic)


def gate_within(camera: Camera, aspect: float, window_aspect: float) -> Gate:
    """The largest gate of an aspect that a view shows with some room around it."""
    most = min(1.0, window_aspect / aspect) / AROUND
    return Gate(aspect=aspect, height=_height(camera) * most, orthographic=camera.orthographic)


def seen_through(gate: Gate, camera: Camera) -> Camera:
    """The camera where a view's stands whose whole picture, of the gate's aspect, is what the gate takes."""
    if gate.orthographic != camera.orthographic:
        return camera
    if gate.orthographic:
        return camera.replace(height=gate.height)
    return camera.replace(field_of_view=float(2.0 * np.arctan(0.5 * gate.height)))


def gate_box(gate: Gate, camera: Camera, width: int, height: int) -> Box | None:
    """Where the gate is in the picture of a view; None when one has a lens and the other parallel rays."""
    if gate.orthographic != camera.orthographic:
        return None
    tall = gate.height * pixel_scale(camera, height)
    x, y, wide = 0.5 * width - 0.5, 0.5 * height - 0.5, tall * gate.aspect
    return Box(x - 0.5 * wide, y - 0.5 * tall, x + 0.5 * wide, y + 0.5 * tall)


def safe_boxes(box: Box) -> tuple[Box, Box]:
    """The parts of a gate in which action and titles are safe."""
    x, y = 0.5 * (box.left + box.right), 0.5 * (box.top + box.bottom)
    wide, tall = 0.5 * (box.right - box.left), 0.5 * (box.bottom - box.top)
    action, title = (Box(x - part * wide, y - part * tall, x + part * wide, y + part * tall) for part in SAFE)
    return action, title


def _height(camera: Camera) -> float:
    return camera.height if camera.orthographic else float(2.0 * np.tan(0.5 * camera.field_of_view))

"""Qt's events of mouse and pen as pointers of the hand, in pixels of the real framebuffer."""

from __future__ import annotations

import math

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QMouseEvent, QPointingDevice, QTabletEvent

from tools.ground import Pointer

MODIFIER_NAMES = (
    (Qt.KeyboardModifier.ControlModifier, "Ctrl"), (Qt.KeyboardModifier.AltModifier, "Alt"),
    (Qt.KeyboardModifier.ShiftModifier, "Shift"), (Qt.KeyboardModifier.MetaModifier, "Meta"),
)
BUTTON_NAMES = {
    Qt.MouseButton.LeftButton: "LMB", Qt.MouseButton.MiddleButton: "MMB", Qt.MouseButton.RightButton: "RMB",
}
LEAST_PRESSURE = 1e-3  # a pen that touches presses, however lightly


def modifier_names(modifiers: Qt.KeyboardModifier) -> tuple[str, ...]:
    """Held modifiers by the names, and in the order, that keymaps use."""
    return tuple(name for modifier, name in MODIFIER_NAMES if modifiers & modifier)


def mouse_pointer(event: QMouseEvent, ratio: float) -> Pointer:
    """A sample of the mouse. `ratio` : device pixels for one of Qt's."""
    place = event.position()
    # a mouse names the pixel of the screen it is on, divided by the ratio; the centre of that pixel is meant
    return _pointer(place.x() * ratio, place.y() * ratio, event.modifiers(), event.timestamp())


def pen_pointer(event: QTabletEvent, ratio: float) -> Pointer:
    """A sample of a pen, with its pressure, tilt and the end it is held by."""
    place = event.position()  # of the tip, between pixels too, from the corner of the first one
    pointer = _pointer(place.x() * ratio - 0.5, place.y() * ratio - 0.5, event.modifiers(), event.timestamp())
    return pointer._replace(
        pressure=min(max(float(event.pressure()), LEAST_PRESSURE), 1.0), tilt_x=math.radians(event.xTilt()),
        tilt_y=math.radians(event.yTilt()), eraser=event.pointerType() == QPointingDevice.PointerType.Eraser,
    )


def place_pointer(place: QPointF, ratio: float, modifiers: Qt.KeyboardModifier) -> Pointer:
    """Where a hovering mouse is, when no event of its own says so."""
    return _pointer(place.x() * ratio, place.y() * ratio, modifiers, 0)


def _pointer(x: float, y: float, modifiers: Qt.KeyboardModifier, milliseconds: int) -> Pointer:
    return Pointer(
        x, y, shift=bool(modifiers & Qt.KeyboardModifier.ShiftModifier),
        ctrl=bool(modifiers & Qt.KeyboardModifier.ControlModifier),
        alt=bool(modifiers & Qt.KeyboardModifier.AltModifier), time=1e-3 * milliseconds,
    )

"""A plate at the scale of the screen: ``python -m tests.window.match.pick_scaled`` ends with 1 where what is picked is
not what is seen. A process of its own, because a scale (QT_SCALE_FACTOR) is for a whole process.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from PySide6.QtCore import QCoreApplication, QEvent, QPointF, Qt
from PySide6.QtGui import QImage, QMouseEvent

from core.document import Document
from core.image.plate_view import plate_points, view_points
from tests.window.alone import hand_at
from tests.window.hand import LEFT, NONE, Hand
from tools.plate_edits import set_plate

SIZE = (860, 560)  # fits the screen of the tests at twice the scale, too
WIDE, TALL = 240, 160
DOTS = np.array([[60.3, 50.0], [180.0, 40.7], [118.6, 81.2], [40.0, 120.5], [200.4, 130.0]])
SPREAD = 2.5  # pixels of the plate
NEAR = 0.1  # pixels of the plate: the screen shows whole steps of light, and squares of whole pixels


def dots() -> np.ndarray:
    """A plate of bright dots at known places."""
    x, y = np.meshgrid(np.arange(WIDE), np.arange(TALL))
    sums = sum(np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2.0 * SPREAD**2)) for u, v in DOTS)
    return np.asarray(np.clip(np.round(255.0 * sums), 0, 255), np.uint8)


def seen(image: QImage, near: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """The middle of the light about a place, in pixels of the framebuffer with centres at whole numbers."""
    image = image.convertToFormat(QImage.Format.Format_Grayscale8)
    light = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    low = np.maximum(np.floor(near - reach).astype(int), 0)
    high = np.ceil(near + reach).astype(int) + 1
    part = light[low[1]:high[1], low[0]:high[0]].astype(np.float64)
    y, x = np.mgrid[low[1]:low[1] + part.shape[0], low[0]:low[0] + part.shape[1]]
    return np.array([(part * x).sum(), (part * y).sum()]) / part.sum()


def wrong_at(hand: Hand, aspect: float) -> list[str]:
    """What went wrong with pixels of one aspect."""
    window, view, desk, eye = hand.window, hand.view, hand.window.desk, hand.window.match.eye
    desk.edit("Plate", set_plate, desk.document.plates[0].id, pixel_aspect=aspect)
    desk.set_workspace(view=desk.workspace.view.replace(hud=False))
    ratio, found, looked_at = view.devicePixelRatio(), [], 0
    for notches in (0, 3, 6):
        eye.fit()
        width, height = view.pixels()
        view.eye.wheel("dolly", notches, 0.4 * width, 0.6 * height)
        view._pointer = None
        view.redraw()
        hand.rest()
        image = view.grabFramebuffer()
        if (image.width(), image.height()) != (width, height):
            found.append(f"the picture is {image.width()} x {image.height()}, not {width} x {height}")
        scale = height / eye.camera.height
        for dot in DOTS:
            at = view_points(eye.camera, aspect, dot, width, height)[0]
            reach = 3.5 * SPREAD * scale * np.array([aspect, 1.0])
            if (at < reach).any() or (at > np.array([width, height]) - 1 - reach).any():
                continue
            looked_at += 1
            off = float(np.abs((seen(image, at, reach) - at) / (scale * aspect, scale)).max())
            if off > NEAR:
                found.append(f"aspect {aspect}, zoom {scale:.2f}: the dot {dot} is {off:.3f} of its pixels off")
    window.commands.run("match.natural")
    # a pixel of the screen, between those of Qt where they are larger: a mouse names it, divided by the ratio
    pixel = np.round(view_points(eye.camera, aspect, DOTS[2], *view.pixels())[0]) + np.array([1.0, 3.0])
    spot = pixel / ratio
    for kind in (QEvent.Type.MouseButtonPress, QEvent.Type.MouseButtonRelease):
        there = QPointF(*spot)
        down = LEFT if kind == QEvent.Type.MouseButtonPress else Qt.MouseButton.NoButton
        QCoreApplication.sendEvent(view, QMouseEvent(kind, there, view.mapToGlobal(there), LEFT, down, NONE))
    hand.painted()
    made = desk.document.tracks[-1].points[0]
    truth = plate_points(eye.camera, aspect, pixel, *view.pixels())[0]
    if np.abs(made - truth).max() > 1e-6:
        found.append(f"aspect {aspect}: a click on {pixel} makes a track at {made}, not {truth}")
    desk.session.undo()
    return found if looked_at >= 6 else [*found, "too few dots are in view"]


def wrong() -> list[str]:
    """What went wrong."""
    with tempfile.TemporaryDirectory() as folder:
        plate = Path(folder) / "dots"
        plate.mkdir()
        for frame in (1, 2):
            cv2.imwrite(str(plate / f"dots.{frame:04d}.png"), dots())
        hand = hand_at(Document(), SIZE)
        hand.window.opening.open(plate)
        hand.until(lambda: bool(hand.window.desk.document.plates))
        hand.rest()
        found = [words for aspect in (1.0, 2.0) for words in wrong_at(hand, aspect)]
        hand.window.close_unasked()
    return found


if __name__ == "__main__":
    said = wrong()
    print("\n".join(said), file=sys.stderr)
    sys.exit(bool(said))

"""Words in the window's own font for a picture that OpenGL draws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QImage, QPainter

from app.window.theme import look_of, text_font
from viewport.overlay_drawing import Byte3


def letters(words: str, pixels: float, color: Byte3) -> NDArray[np.uint8]:
    """Words in the window's own font: (H, W, 4) uint8, red green blue and opacity (see viewport.hud)."""
    font = text_font(look_of(), max(round(pixels), 1))
    probe = QImage(1, 1, QImage.Format.Format_RGBA8888)
    painter = QPainter(probe)
    painter.setFont(font)
    width, height, rise = (
        painter.fontMetrics().horizontalAdvance(words), painter.fontMetrics().height(), painter.fontMetrics().ascent())
    painter.end()
    image = QImage(max(width, 1) + 2, max(height, 1), QImage.Format.Format_RGBA8888_Premultiplied)
    image.fill(Qt.GlobalColor.transparent)
    painter = QPainter(image)
    painter.setFont(font)
    painter.setPen(QColor(255, 255, 255))
    painter.drawText(1, rise, words)
    painter.end()
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    opacity = rows[:, 3 : 4 * image.width() : 4]
    letters_of = np.empty((*opacity.shape, 4), np.uint8)
    letters_of[..., :3], letters_of[..., 3] = color, opacity
    return letters_of

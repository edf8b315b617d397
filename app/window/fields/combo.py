"""A list that drops down, with the chevron of our own icons in the colours of the theme."""

from __future__ import annotations

from PySide6.QtCore import QRectF
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QComboBox, QWidget

from app.window.icons import paint_icon
from app.window.theme import look_of


class Combo(QComboBox):
    """The style sheet leaves the arrow out, as Qt draws it with a bevel of its own.

    It is as wide as there is room; a long word is cut short in it rather than making a column of panels wider.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(6)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        look, painter = look_of(), QPainter(self)
        side = float(look.text)
        place = QRectF(self.width() - side - look.grid, (self.height() - side) / 2, side, side)
        paint_icon(painter, "chevron-down", place, look.theme.colour("dim"))
        painter.end()

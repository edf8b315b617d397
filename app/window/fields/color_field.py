"""Colours: stored as linear red, green and blue, shown and chosen as the screen shows them (sRGB)."""

from __future__ import annotations

import re
from typing import Any

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QColorDialog, QWidget

from app.window.fields.field_widget import FieldWidget
from app.window.theme import look_of
from core.errors import UserError
from core.field import Field

Colour = tuple[float, float, float]
_HEX = re.compile(r"#?([0-9a-fA-F]{6}|[0-9a-fA-F]{3})")


def encoded(linear: float) -> float:
    """Linear light to sRGB (IEC 61966-2-1), 0 .. 1, held within it."""
    value = min(max(linear, 0.0), 1.0)
    return 12.92 * value if value <= 0.0031308 else 1.055 * float(value ** (1.0 / 2.4)) - 0.055


def decoded(value: float) -> float:
    """sRGB to linear light."""
    return value / 12.92 if value <= 0.04045 else float(((value + 0.055) / 1.055) ** 2.4)


def shown_colour(linear: Colour) -> QColor:
    """The colour of the screen for linear red, green and blue."""
    return QColor.fromRgbF(*(encoded(c) for c in linear))


def linear_colour(colour: QColor) -> Colour:
    """Linear red, green and blue, to a millionth, of a colour of the screen."""
    red, green, blue = (round(decoded(c), 6) for c in (colour.redF(), colour.greenF(), colour.blueF()))
    return red, green, blue


class ColorField(FieldWidget):
    """A swatch with its sRGB number; a click opens the choice of colours beside the work, which goes on."""

    def __init__(
        self, known: Field, value: Colour, default: Colour | None = None, parent: QWidget | None = None,
    ) -> None:
        super().__init__(known, value, default, parent)
        self.dialog: QColorDialog | None = None
        self.value_shown()

    def words(self) -> str:
        return self.words_of(self._value)

    def words_of(self, value: Any) -> str:
        brightest = max(value)
        return shown_colour(value).name() + (f" × {brightest:.3g}" if brightest > 1.0 else "")

    def clipboard_text(self) -> str:
        return shown_colour(self._value).name()

    def from_text(self, text: str) -> Colour:
        match = _HEX.fullmatch(text.strip())
        if match is None:
            raise UserError(f"{self.known.label} is written like #c08040; {text.strip()[:40]!r} is no colour.")
        return linear_colour(QColor(f"#{match[1]}"))

    def teaching(self) -> str:
        red, green, blue = self._value
        return super().teaching().replace("<br>", f"<br>Linear {red:.3f}, {green:.3f}, {blue:.3f}.<br>", 1)

    def gestures(self) -> str:
        return "Click to choose, Ctrl-C and Ctrl-V carry it · right button for more"

    def choose(self) -> None:
        """Open the choice of colours; the change is one edit, from opening to closing."""
        if self.dialog is not None:
            self.dialog.raise_()
            return
        dialog = QColorDialog(shown_colour(self._value), self)
        dialog.setWindowTitle(self.known.label)
        dialog.setOption(QColorDialog.ColorDialogOption.DontUseNativeDialog)
        dialog.setModal(False)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.currentColorChanged.connect(lambda colour: self.preview(linear_colour(colour)))
        dialog.finished.connect(self._chosen)
        self.dialog = dialog
        self.begin()
        dialog.show()

    def _chosen(self, result: int) -> None:
        self.dialog = None
        if result:
            self.finish()
        else:
            self.cancel()

    def takes(self, event: QKeyEvent) -> bool:
        return event.key() in (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter) or super().takes(event)

    def focusOutEvent(self, event: Any) -> None:
        if self.dialog is None:
            super().focusOutEvent(event)
        else:  # the hand is in the dialog
            QWidget.focusOutEvent(self, event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.choose()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.choose()
        else:
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        inside = self.frame(painter, look)
        swatch = QRectF(inside.left() + 3, inside.top() + 3, inside.width() * 0.5, inside.height() - 6)
        painter.setPen(look.theme.colour("line"))
        painter.setBrush(shown_colour(self._value))
        painter.drawRoundedRect(swatch, 3.0, 3.0)
        painter.setPen(self.ink(look))
        painter.drawText(inside.adjusted(8, 0, -7, 0), Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter,
                         self.words())

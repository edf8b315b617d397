"""Line icons of the project's own: SVG files of resources/icons, drawn in the colours of the theme at any ratio."""

from __future__ import annotations

from functools import cache
from importlib import resources

from PySide6.QtCore import QByteArray, QEvent, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPaintEvent, QPixmap
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QToolButton, QWidget

from app.window.theme import Look, look_of

RATIOS = (1.0, 1.25, 1.5, 1.75, 2.0, 3.0)  # pixels of the screen per pixel of Qt that menus are given pictures for


def icon_names() -> tuple[str, ...]:
    """The names of all icons there are."""
    folder = resources.files("resources") / "icons"
    return tuple(sorted(file.name[:-4] for file in folder.iterdir() if file.name.endswith(".svg")))


def paint_icon(painter: QPainter, name: str, area: QRectF, colour: QColor) -> None:
    """Draw an icon into an area, as sharp as the device is. KeyError when there is none of that name."""
    source = _source(name).replace(b"currentColor", colour.name().encode())
    painter.save()
    painter.setOpacity(painter.opacity() * colour.alphaF())
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    QSvgRenderer(QByteArray(source)).render(painter, area)
    painter.restore()


def icon_pixmap(name: str, size: int, colour: QColor, ratio: float = 1.0) -> QPixmap:
    """An icon of `size` pixels of Qt for a screen with `ratio` device pixels to each."""
    _source(name)  # an unknown name must not fail with a painter open: Qt dies of it
    pixels = round(size * ratio)
    pixmap = QPixmap(pixels, pixels)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    paint_icon(painter, name, QRectF(0.0, 0.0, pixels, pixels), colour)
    painter.end()
    pixmap.setDevicePixelRatio(ratio)
    return pixmap


def icon(name: str, look: Look | None = None) -> QIcon:
    """An icon for menus and item views, with its disabled and checked states. Make it anew when the theme changes."""
    look = look or look_of()
    made = QIcon()
    for mode, state, colour in (
        (QIcon.Mode.Normal, QIcon.State.Off, look.theme.colour("text")),
        (QIcon.Mode.Disabled, QIcon.State.Off, look.theme.colour("dim", 0.6)),
        (QIcon.Mode.Normal, QIcon.State.On, look.theme.colour("accent")),
        (QIcon.Mode.Selected, QIcon.State.Off, look.theme.colour("text")),
    ):
        for ratio in RATIOS:
            made.addPixmap(icon_pixmap(name, look.icon, colour, ratio), mode, state)
    return made


class IconButton(QToolButton):
    """A square button with an icon alone, drawn in the theme of the moment; in the accent colour when checked.

    Parameters
    ----------
    tooltip : what it does; it is also what a screen reader says. side : in pixels; None for the height of a row.
    """

    def __init__(self, name: str, tooltip: str, parent: QWidget | None = None, side: int | None = None) -> None:
        super().__init__(parent)
        _source(name)
        self._name, self._side = name, side
        self.setToolTip(tooltip)
        self.setAccessibleName(tooltip)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)

    def set_icon(self, name: str) -> None:
        """Show another icon."""
        if name != self._name:
            _source(name)
            self._name = name
            self.update()

    def sizeHint(self) -> QSize:
        side = self._side or look_of().row
        return QSize(side, side)

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    def changeEvent(self, event: QEvent) -> None:
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self.updateGeometry()
        super().changeEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        area = QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5)
        ground = "accent_ground" if self.isChecked() else "line" if self.isDown() else "hover"
        if self.isChecked() or (self.isEnabled() and (self.underMouse() or self.isDown())):
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(look.theme.colour(ground))
            painter.drawRoundedRect(area, 5.0, 5.0)
        if self.hasFocus():
            painter.setPen(look.theme.colour("accent"))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(area, 5.0, 5.0)
        name = "accent" if self.isChecked() else "text" if self.underMouse() else "dim"
        colour = look.theme.colour(name, 1.0 if self.isEnabled() else 0.4)
        side = min(float(look.icon), self.width() - 4.0)
        if self._side is not None and self._side >= look.shelf:
            side = float(look.icon + 4)
        place = QRectF((self.width() - side) // 2, (self.height() - side) // 2, side, side)
        paint_icon(painter, self._name, place, colour)


@cache
def _source(name: str) -> bytes:
    file = resources.files("resources") / "icons" / f"{name}.svg"
    if not file.is_file():
        raise KeyError(f"there is no icon named {name!r} in resources/icons")
    return file.read_bytes()

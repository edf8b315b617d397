"""The radial menu: up to eight commands around the hand, each always in the same direction.

It is a window of its own, because the viewport is a native one that no widget can be drawn over. Press, flick, release:
the direction chooses, how far does not matter, and nothing needs to be read once the hand knows it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from PySide6.QtCore import QLineF, QPoint, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import (
    QGuiApplication,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPainterPath,
    QPainterPathStroker,
    QPaintEvent,
    QPen,
    QRegion,
)
from PySide6.QtWidgets import QWidget

from app.window.icons import paint_icon
from app.window.theme import Theme, look_of

MOST = 8
# the order in which entries are given out: up, right, down, left, then between; a menu that grows keeps its directions
DIRECTIONS = ((0, -1), (1, 0), (0, 1), (-1, 0), (1, -1), (1, 1), (-1, 1), (-1, -1))
DEAD = 14.0  # pixels about the middle in which nothing is chosen
RADIUS = 92.0  # pixels from the middle to the entries above and below
# places in radii: words are wide, so those aside stand further out, and no two share a line
ASIDE, BETWEEN = 1.4, (1.15, 0.6)


class Entry(NamedTuple):
    """One direction of the menu.

    icon : file in resources/icons without suffix, or None. reason : why it cannot run now, or None.
    """

    name: str
    label: str
    icon: str | None = None
    reason: str | None = None


class RadialMenu(QWidget):
    """Opens under the hand; `chosen` carries the name of the entry it was released on.

    Released near the middle (a short press) it stays open and the next click chooses; Esc or a click in the middle
    leaves.
    """

    chosen = Signal(str)

    def __init__(self, parent: QWidget, entries: Sequence[Entry | None]) -> None:
        """`entries` : at most eight in the order of DIRECTIONS; None leaves a direction empty."""
        if len(entries) > MOST:
            raise ValueError(f"a radial menu has at most {MOST} entries, not {len(entries)}")
        super().__init__(parent, Qt.WindowType.Popup | Qt.WindowType.FramelessWindowHint)
        self.setAttribute(Qt.WidgetAttribute.WA_TranslucentBackground)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setMouseTracking(True)
        self._entries = tuple(entries)
        self._hand = QPointF()
        self._pressed: QPointF | None = None  # on the screen, while what opened the menu is down
        self._size = self.fontMetrics().height() / 15.0  # grows with the size of the text
        widest = max((self.fontMetrics().horizontalAdvance(e.label) for e in entries if e), default=0) + 48.0
        half_width = ASIDE * RADIUS * self._size + widest / 2 + 8
        half_height = RADIUS * self._size + 32 * self._size
        self.resize(math.ceil(2 * half_width), math.ceil(2 * half_height))

    def open_at(self, place: QPoint) -> None:
        """Open with the middle at a place of the screen, moved as little as keeps it on the screen.

        Directions count from that place, moved or not, so that the hand can flick without looking.
        """
        screen = QGuiApplication.screenAt(place) or self.screen()
        free = screen.availableGeometry()
        x = min(max(place.x() - self.width() // 2, free.left()), free.right() - self.width() + 1)
        y = min(max(place.y() - self.height() // 2, free.top()), free.bottom() - self.height() + 1)
        self.move(x, y)
        self._hand, self._pressed = self._middle(), QPointF(place)
        self._cut_out()
        self.show()
        self.activateWindow()
        self.setFocus()

    def entry_at(self, place: QPointF) -> Entry | None:
        """The entry in whose direction a place (of this widget) lies from the middle."""
        way = place - self._middle()
        if math.hypot(way.x(), way.y()) < DEAD * self._size:
            return None
        best = max(
            range(MOST), key=lambda i: (way.x() * DIRECTIONS[i][0] + way.y() * DIRECTIONS[i][1])
            / math.hypot(*DIRECTIONS[i]))
        return self._entries[best] if best < len(self._entries) else None

    def point_to(self, place_on_screen: QPoint) -> None:
        """The hand moved; called while the button or key that opened the menu is still down."""
        if self._pressed is None:
            self._hand = QPointF(self.mapFromGlobal(place_on_screen))
        else:
            self._hand = self._middle() + QPointF(place_on_screen) - self._pressed
        self._cut_out()
        self.update()

    def let_go(self) -> None:
        """A button or key was released: choose. In the middle the first release stays, a later one leaves."""
        first, self._pressed = self._pressed is not None, None
        if math.hypot(*(self._hand - self._middle()).toTuple()) >= DEAD * self._size or not first:
            self._choose()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Point with the hand."""
        self.point_to(event.globalPosition().toPoint())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Point; the release chooses, so that no release is left over for what lies below."""
        self.point_to(event.globalPosition().toPoint())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """The release of the button that opened the menu, or of a later click."""
        self.point_to(event.globalPosition().toPoint())
        self.let_go()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Esc leaves."""
        if event.key() == Qt.Key.Key_Escape:
            self.close()

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """The release of the key that opened the menu."""
        if not event.isAutoRepeat():
            self.let_go()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Entries as rounded words about a small ring, and a line towards the hand."""
        painter, theme = QPainter(self), look_of().theme
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        middle, under = self._middle(), self.entry_at(self._hand)
        painter.setPen(QPen(theme.colour("line"), 6.0 * self._size))
        painter.setBrush(theme.colour("panel"))
        painter.drawEllipse(middle, DEAD * self._size, DEAD * self._size)
        line = self._line()
        if line is not None:
            painter.setPen(QPen(theme.colour("accent"), 2.0, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
            painter.drawLine(line)
        for i, entry in enumerate(self._entries):
            if entry is not None:
                self._draw(painter, self._place(i), entry, theme, entry is under and entry.reason is None)
        painter.end()

    def _icon_room(self, entry: Entry) -> float:
        return 0.0 if entry.icon is None else 20.0 * self._size

    def _box(self, place: QPointF, entry: Entry) -> QRectF:
        metrics = self.fontMetrics()
        width = metrics.horizontalAdvance(entry.label) + self._icon_room(entry) + 20.0
        height = metrics.height() + 12.0
        return QRectF(place.x() - width / 2, place.y() - height / 2, width, height)

    def _line(self) -> QLineF | None:
        """From the ring towards the hand, not under the entries; None while the hand is in the middle."""
        middle, way = self._middle(), self._hand - self._middle()
        length = math.hypot(way.x(), way.y())
        if length <= DEAD * self._size:
            return None
        reach = min(length, (RADIUS - 24.0) * self._size) / length
        return QLineF(middle + way * (DEAD * self._size / length), middle + way * reach)

    def _cut_out(self) -> None:
        """Be a window only where something is drawn: without a compositor the rest would be black."""
        ring = (DEAD + 4.0) * self._size
        region = QRegion(
            QRectF(self._middle().x() - ring, self._middle().y() - ring, 2 * ring, 2 * ring).toAlignedRect(),
            QRegion.RegionType.Ellipse)
        for i, entry in enumerate(self._entries):
            if entry is not None:
                path = QPainterPath()
                path.addRoundedRect(self._box(self._place(i), entry).adjusted(-1.0, -1.0, 1.0, 1.0), 6.0, 6.0)
                region += QRegion(path.toFillPolygon().toPolygon())
        line = self._line()
        if line is not None:
            path = QPainterPath(line.p1())
            path.lineTo(line.p2())
            pen = QPainterPathStroker()
            pen.setWidth(4.0)
            region += QRegion(pen.createStroke(path).toFillPolygon().toPolygon())
        self.setMask(region)

    def _draw(self, painter: QPainter, place: QPointF, entry: Entry, theme: Theme, chosen: bool) -> None:
        icon, box = self._icon_room(entry), self._box(place, entry)
        words = theme.colour("accent" if chosen else "dim" if entry.reason else "text")
        painter.setPen(QPen(theme.colour("accent" if chosen else "line"), 1.0))
        painter.setBrush(theme.colour("accent_ground" if chosen else "panel"))
        painter.drawRoundedRect(box, 5.0, 5.0)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if entry.icon is not None:
            side = 16.0 * self._size
            paint_icon(painter, entry.icon, QRectF(box.left() + 8, place.y() - side / 2, side, side), words)
        painter.setPen(words)
        painter.drawText(box.adjusted(icon + 10.0, 0.0, -10.0, 0.0), Qt.AlignmentFlag.AlignVCenter, entry.label)

    def _choose(self) -> None:
        entry = self.entry_at(self._hand)
        self.close()
        if entry is not None and entry.reason is None:
            self.chosen.emit(entry.name)

    def _middle(self) -> QPointF:
        return QPointF(self.width() / 2.0, self.height() / 2.0)

    def _place(self, i: int) -> QPointF:
        x, y = DIRECTIONS[i]
        far, (wide, high) = RADIUS * self._size, BETWEEN if x and y else (ASIDE, 1.0)
        return self._middle() + QPointF(wide * x * far, high * y * far)

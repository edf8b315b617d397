"""Several number bars at once: press on one, go down or up over others, then sideways; or let go and type."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QPointF, Qt, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from app.window.fields.number_bar import FINE, NumberBar

SIDEWAYS = 10.0  # pixels across, after the last bar was reached, that begin to change them


class BarsTogether(QObject):
    """Watches the bars of one form.

    All bars change by the same share of their range and their edit ends as one; a typed number is that of all.

    ended : an edit of several bars is over.
    """

    ended = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._bars: list[NumberBar] = []
        self._labels: dict[QObject, NumberBar] = {}
        self._first: NumberBar | None = None
        self._gathered: list[NumberBar] = []
        self._typed: list[NumberBar] = []
        self._from = QPointF()
        self._anchor = self._last = 0.0
        self._dragging = False

    def add(self, bar: NumberBar, label: QLabel) -> None:
        """Watch a bar; a press on its label is one on the bar."""
        self._bars.append(bar)
        self._labels[label] = bar
        label.setCursor(Qt.CursorShape.SizeHorCursor)
        label.installEventFilter(self)
        bar.installEventFilter(self)
        bar.edited.connect(lambda value, final, bar=bar: self._edited(bar, value, final))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if isinstance(event, QMouseEvent) and watched in self._labels:
            return self._hand_on(self._labels[watched], event)
        if not isinstance(watched, NumberBar):
            return False
        if isinstance(event, QMouseEvent):
            if event.type() == QEvent.Type.MouseButtonPress and event.button() == Qt.MouseButton.LeftButton:
                self._first, self._from = watched, event.globalPosition()
            elif event.type() == QEvent.Type.MouseMove and self._first is watched:
                return self._moved(event)
            elif event.type() == QEvent.Type.MouseButtonRelease and self._first is watched:
                return self._released()
        elif (isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress and self._gathered
              and event.key() == Qt.Key.Key_Escape):
            self._end(cancel=True)
            return True
        return False

    def _hand_on(self, bar: NumberBar, event: QMouseEvent) -> bool:
        """Give what happens over a label to its bar."""
        left = (event.buttons() | event.button()) & Qt.MouseButton.LeftButton
        if not (left and bar.isVisible() and bar.isEnabled()):
            return False
        if event.type() == QEvent.Type.MouseButtonPress:
            bar.setFocus(Qt.FocusReason.MouseFocusReason)
        place = event.globalPosition()
        QApplication.sendEvent(bar, QMouseEvent(
            event.type(), QPointF(bar.mapFromGlobal(place)), place, event.button(), event.buttons(), event.modifiers()))
        return True

    def _moved(self, event: QMouseEvent) -> bool:
        first = self._first
        if first is None or (first.editing and not self._dragging):
            return False
        here, way = event.globalPosition(), event.globalPosition() - self._from
        if not self._dragging:
            reached = self._between(self._from.y(), here.y()) if self._gathered or abs(way.y()) > abs(way.x()) else []
            if len(reached) < 2 and not self._gathered:
                return False
            if reached != self._gathered:
                self._gather(reached or [first])
                self._anchor = here.x()
            first.let_go()
            if abs(here.x() - self._anchor) <= SIDEWAYS:
                return True
            self._dragging, self._last = True, here.x()
        share = (here.x() - self._last) / max(first.width() - 2, 1)
        self._last = here.x()
        for bar in self._gathered:
            bar.begin()
        for bar in self._gathered:
            bar.slide(share * (FINE if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 1.0),
                      bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier))
        return True

    def _released(self) -> bool:
        first, gathered = self._first, list(self._gathered)
        if first is None or not gathered:
            self._first = None
            return False
        if self._dragging:
            self._end(cancel=False)
            return True
        self._first = None
        first.start_typing()
        if first.line is not None:
            self._typed = gathered
            for bar in gathered:
                if bar is not first:
                    bar.begin()  # so that all of it is one edit
            first.line.destroyed.connect(self._typing_ended)
        return True

    def _edited(self, bar: NumberBar, value: float, final: bool) -> None:
        if final and bar in self._typed:
            others, self._typed = [other for other in self._typed if other is not bar], []
            for other in others:
                other.preview(other.made(value))
            for other in others:
                other.finish()
            self.ended.emit()

    def _typing_ended(self) -> None:
        """Nothing was typed, or what was is in all bars."""
        for bar in self._typed:
            bar.finish()
        self._typed = []
        self._gather([])

    def _end(self, cancel: bool) -> None:
        for bar in self._gathered:
            if cancel:
                bar.cancel()
            else:
                bar.finish()
        self._gather([])
        self._first, self._dragging = None, False
        self.ended.emit()

    def _gather(self, bars: list[NumberBar]) -> None:
        for bar in self._bars:
            bar.set_gathered(bar in bars)
        self._gathered = bars

    def _between(self, start: float, end: float) -> list[NumberBar]:
        """Bars that a way from one height of the screen to another goes over."""
        low, high = min(start, end), max(start, end)
        found = []
        for bar in self._bars:
            top = bar.mapToGlobal(QPointF(0.0, 0.0)).y()
            if bar.isVisible() and bar.isEnabled() and top <= high and top + bar.height() >= low:
                found.append(bar)
        return found

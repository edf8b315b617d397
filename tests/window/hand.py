"""A hand at the real window: events of mouse, keys and pen, and waiting for what they cause."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QInputDevice, QPointingDevice, QPointingDeviceUniqueId, QTabletEvent
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from app.window.main import MainWindow

LEFT, MIDDLE, RIGHT = Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton, Qt.MouseButton.RightButton
NONE = Qt.KeyboardModifier.NoModifier
SHIFT, CTRL, ALT = (
    Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.AltModifier)
Place = tuple[float, float]


class Hand:
    """Works on the viewport of a window; places are fractions of its width and height."""

    def __init__(self, window: MainWindow, qtbot: QtBot) -> None:
        self.window, self.view, self._bot = window, window.viewport, qtbot
        self._pens: dict[bool, QPointingDevice] = {}

    def at(self, place: Place) -> QPoint:
        """The pixel of a place."""
        return QPoint(round(place[0] * self.view.width()), round(place[1] * self.view.height()))

    def press(self, place: Place, button: Qt.MouseButton = LEFT, modifiers: Qt.KeyboardModifier = NONE) -> None:
        QTest.mousePress(self.view, button, modifiers, self.at(place))

    def move(self, place: Place) -> None:
        QTest.mouseMove(self.view, self.at(place))

    def release(self, place: Place, button: Qt.MouseButton = LEFT, modifiers: Qt.KeyboardModifier = NONE) -> None:
        QTest.mouseRelease(self.view, button, modifiers, self.at(place))

    def drag(
        self, start: Place, end: Place, button: Qt.MouseButton = LEFT, modifiers: Qt.KeyboardModifier = NONE,
        steps: int = 8,
    ) -> None:
        """Press, go there in steps with a picture after each, release."""
        self.press(start, button, modifiers)
        for step in range(1, steps + 1):
            part = step / steps
            self.move((start[0] + part * (end[0] - start[0]), start[1] + part * (end[1] - start[1])))
            self.painted()
        self.release(end, button, modifiers)

    def key(self, key: Qt.Key, modifiers: Qt.KeyboardModifier = NONE) -> None:
        QTest.keyClick(self.view, key, modifiers)

    def pen(
        self, kind: QEvent.Type, place: Place, pressure: float, tilt: tuple[float, float] = (0.0, 0.0),
        eraser: bool = False,
    ) -> bool:
        """One event of a pen, as Qt would hand it over; True when it was accepted."""
        where = QPointF(place[0] * self.view.width(), place[1] * self.view.height())
        down = Qt.MouseButton.NoButton if kind == QEvent.Type.TabletRelease else LEFT
        button = Qt.MouseButton.NoButton if kind == QEvent.Type.TabletMove else LEFT
        event = QTabletEvent(
            kind, self._pen(eraser), where, QPointF(self.view.mapToGlobal(where)), pressure, *tilt, 0.0, 0.0, 0.0,
            NONE, button, down)
        QCoreApplication.sendEvent(self.view, event)
        return event.isAccepted()

    def painted(self) -> None:
        """Wait until what was caused has been painted."""
        self.until(lambda: not self.view.pending)

    def rest(self) -> None:
        """Wait until nothing goes on that changes what is shown; the picture may still become finer."""
        self.until(self._calm, 240_000)

    def finish(self) -> None:
        """Wait until everything is finished, the picture too."""
        self.until(lambda: self.window.settled, 240_000)

    def until(self, true: Callable[[], bool], milliseconds: int = 15_000) -> None:
        self._bot.waitUntil(true, timeout=milliseconds)

    def _calm(self) -> bool:
        desk, picture = self.window.desk, self.view.picture
        if desk.jobs.running or desk.session.stroking or self.view.pending:
            return False
        return picture is None or not picture.growing

    def _pen(self, eraser: bool) -> QPointingDevice:
        if eraser not in self._pens:
            kind = QPointingDevice.PointerType.Eraser if eraser else QPointingDevice.PointerType.Pen
            able = QInputDevice.Capability
            self._pens[eraser] = QPointingDevice(
                "pen of the tests", 7 + eraser, QInputDevice.DeviceType.Stylus, kind,
                able.Position | able.Pressure | able.XTilt | able.YTilt, 1, 3, "",
                QPointingDeviceUniqueId.fromNumericId(7 + eraser))
        return self._pens[eraser]

"""Playback: the frame that time asks for, one at a time; frames there is no time for are left out."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from app.window.desk import Desk

SHORTEST = 1  # ms between two looks at the clock, so that the window's own events come first
AVERAGED = 0.2  # weight of the newest frame in the rate that is reached


class Playback(QObject):
    """Plays the timeline of the desk in a loop, at the rate of the document.

    A frame is set only after everything the one before it caused was dealt with (drawing above all), and it is the one
    whose time it is: a slow picture drops frames and never falls behind. A stroke holds it.

    speed : gives how many frames pass in the time of one; below 1, places between frames are shown.
    changed : it began or ended. reached : frames a second that are really shown.
    """

    changed = Signal()

    def __init__(
        self, desk: Desk, parent: QObject | None = None, clock: Callable[[], float] = time.perf_counter,
        speed: Callable[[], float] = lambda: 1.0,
    ) -> None:
        super().__init__(parent or desk)
        self._desk, self._clock, self._speed = desk, clock, speed
        self._timer = QTimer(self, singleShot=True)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self.tick)
        self._since = 0.0  # when `_from` was shown
        self._from = self._shown = 0.0
        self._last = 0.0
        self._basis: tuple[float, int, int, float] = (24.0, 0, 0, 1.0)
        self.reached = 0.0
        desk.session_replaced.connect(self.pause)

    @property
    def playing(self) -> bool:
        """True between :meth:`play` and :meth:`pause`."""
        return self._timer.isActive()

    def play(self) -> None:
        """Play from the current frame, from the first one when that lies outside the timeline."""
        document, frame = self._desk.document, self._desk.workspace.frame
        if not document.first_frame <= frame <= document.last_frame:
            self._desk.set_workspace(frame=float(document.first_frame))
        self._begin()
        self.reached = 0.0
        self._timer.start(SHORTEST)
        self.changed.emit()

    def pause(self) -> None:
        """Stop where it is."""
        if self.playing:
            self._timer.stop()
            self.changed.emit()

    def toggle(self) -> None:
        """Play, or stop."""
        if self.playing:
            self.pause()
        else:
            self.play()

    def tick(self) -> None:
        """Show the frame whose time it is, and wait for the next."""
        document, workspace, now = self._desk.document, self._desk.workspace, self._clock()
        speed = self._speed()
        basis = document.fps, document.first_frame, document.last_frame, speed
        if self._desk.session.stroking or workspace.frame != self._shown or basis != self._basis:
            self._begin()  # held by a stroke, or somebody moved the frame or the timeline: go on from there
        else:
            passed = int((now - self._since) * document.fps + 1e-6)
            length = document.last_frame - document.first_frame + 1
            start = int(self._from) - document.first_frame
            along = start + passed if speed == 1.0 else _place(start, passed, speed)
            wanted = min(document.first_frame + along % length, document.last_frame)
            if wanted != self._shown:
                self._shown = float(wanted)
                rate = 1.0 / max(now - self._last, 1e-6)
                self.reached += (rate - self.reached) * (AVERAGED if self.reached else 1.0)
                self._last = now
                self._desk.set_workspace(frame=self._shown)
        due = self._since + (int((now - self._since) * document.fps + 1e-6) + 1) / document.fps
        self._timer.start(max(SHORTEST, min(1000, round(1000.0 * (due - self._clock())))))

    def _begin(self) -> None:
        document = self._desk.document
        self._since = self._last = self._clock()
        self._from = self._shown = self._desk.workspace.frame
        self._basis = document.fps, document.first_frame, document.last_frame, self._speed()


def _place(start: int, passed: int, speed: float) -> float:
    """Where it is after so many pictures; whole frames above a speed of 1."""
    place = round(start + passed * speed, 6)
    return float(int(place)) if speed > 1.0 else place

"""Rings of objects are collected by the thread of the window only.

Python collects them on whichever thread makes the next object. A ring with a widget in it that is collected on a worker
thread ends the program (its timers cannot be stopped from there), so the collector is turned off and run by a timer.
"""

from __future__ import annotations

import gc

from PySide6.QtCore import QObject, Qt, QTimer

EVERY = 1000  # ms


class Garbage(QObject):
    """From its making to :meth:`stop` this is the collector of the program. Lives on the thread of the window."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._was_on = gc.isenabled()
        gc.disable()
        self._frozen = False
        self._timer = QTimer(self, interval=EVERY)
        self._timer.setTimerType(Qt.TimerType.VeryCoarseTimer)
        self._timer.timeout.connect(self.look)
        self._timer.start()

    def look(self) -> None:
        """Collect what is young, and every so often everything; next to nothing to do while nothing was made.

        The first look leaves alone for ever what is there by then: the imports. So everything else is little and is
        looked over long before Python would: closed windows and documents lie in the oldest generation.
        """
        if not self._frozen:
            self._frozen = True
            gc.freeze()  # going over all of it each time would stall the hand
        (young, times, _), (most, often, _) = gc.get_count(), gc.get_threshold()
        if times > often:
            gc.collect()
        elif young > most:
            gc.collect(0)

    def stop(self) -> None:
        """Leave it to Python again."""
        self._timer.stop()
        if self._frozen:
            gc.unfreeze()
        if self._was_on:
            gc.enable()

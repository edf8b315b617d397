"""Frames of the plate as the screen shows them: read and coloured on another thread, held within a budget."""

from __future__ import annotations

from concurrent.futures import CancelledError
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.window.desk import Desk
from app.window.jobs import Asked, Cancelled, Progress
from app.window.match.reel import Reel
from core.image.frame_cache import GivenUp, no_pixels
from core.image.plate import Plate
from core.image.plate_view import plate_size

BUDGET = 2 << 30  # bytes of frames, where nobody says otherwise


class Shown(NamedTuple):
    """A frame on the screen. frame : as files count. words : what is wrong with it, or ""."""

    frame: int
    pixels: NDArray[np.uint8]
    words: str = ""


class PlateScreen(QObject):
    """The frames of the plate in view.

    fresh : a frame that was asked for is there. budget : bytes that all frames held may take.
    """

    fresh = Signal()

    def __init__(self, desk: Desk) -> None:
        super().__init__(desk)
        self._desk = desk
        self.budget = BUDGET
        self._reel: Reel | None = None
        self._key: tuple[Any, ...] = ()
        self._asked: int | None = None
        self._last: Shown | None = None
        self._nothing: dict[tuple[int, int], NDArray[np.uint8]] = {}

    @property
    def waiting(self) -> bool:
        """True while a frame is read."""
        return self._asked is not None

    def picture(self, plate: Plate, frame: int) -> Shown | None:
        """The frame, or while it is read the one before; None before there is any. Never waits."""
        reel = self._opened(plate)
        if frame not in plate.frames:
            return Shown(frame, self._blank(plate), f"The plate has frames {plate.first} to {plate.last}.")
        if reel.shown.knows(frame):
            pixels = reel.shown.get(frame)
            words = "" if pixels is not None else f"Frame {frame}: {reel.shown.broken.get(frame, 'it is missing.')}"
            self._last = Shown(frame, self._blank(plate) if pixels is None else pixels, words)
            return self._last
        if self._asked is None:
            self._ask(reel, frame)
        return self._last

    def held(self) -> tuple[int, ...]:
        """Frames of the desk that are in memory."""
        reel = self._reel
        return () if reel is None else tuple(
            f + reel.plate.offset for f in reel.plate.frames if reel.shown.knows(f))

    def pixels(self, plate: Plate, frame: int) -> NDArray[np.uint8] | None:
        """A frame that is in memory, without asking for it."""
        reel = self._opened(plate)
        return reel.shown.get(frame) if frame in plate.frames and reel.shown.knows(frame) else None

    def reel(self, plate: Plate) -> Reel:
        """Where frames of a plate come from, for a job: those that were looked at are there already."""
        return self._opened(plate)

    def set_budget(self, size: int) -> None:
        """Hold so many bytes of frames, from the next picture on."""
        if size != self.budget:
            self.budget = size
            self.close()

    def want(self, plate: Plate, frame: int) -> None:
        """Read a frame when nothing else is asked for."""
        reel = self._opened(plate)
        if frame in plate.frames and self._asked is None and not reel.shown.knows(frame):
            self._ask(reel, frame)

    def close(self) -> None:
        """Give everything back."""
        if self._reel is not None:
            self._reel.close()
        self._reel, self._asked, self._last = None, None, None

    def _ask(self, reel: Reel, frame: int) -> None:
        self._asked, frames = frame, reel.shown

        def done(found: Any) -> None:
            if self._reel is reel:
                self._asked = None
                self.fresh.emit()

        def failed(error: Exception) -> None:
            if self._reel is reel:
                self._asked = None
                if not isinstance(error, Cancelled):
                    self._desk.error(error)
                elif reel.shown is not frames:  # it is looked at in another way by now, and to be asked for again
                    self.fresh.emit()

        def read(progress: Progress, cancelled: Asked) -> None:
            try:
                frames.get(frame, cancelled)
            except (GivenUp, CancelledError):
                raise Cancelled from None

        self._desk.jobs.start(f"Read frame {frame}", read, done, failed, self)

    def _opened(self, plate: Plate) -> Reel:
        path = self._desk.session.path
        root = None if path is None else path.parent
        look = self._desk.workspace.plate_look
        key = (plate.path, plate.first, plate.last, plate.width, plate.height, plate.crop, plate.color_space,
               plate.offset, root)
        if self._reel is None or key != self._key:
            self.close()
            self._reel, self._key = Reel(plate, root, self.budget, look), key
        self._reel.mix = plate.mix
        self._reel.show_with(look)
        return self._reel

    def _blank(self, plate: Plate) -> NDArray[np.uint8]:
        width, height = plate_size(plate)
        if (height, width) not in self._nothing:
            self._nothing = {(height, width): no_pixels(height, width)}
        return self._nothing[height, width]

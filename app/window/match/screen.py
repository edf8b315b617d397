"""Frames of the plate as the screen shows them: read and coloured on another thread, held within a budget."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.window.desk import Desk
from app.window.jobs import Cancelled
from core.formats.frame_decoder import FrameDecoder
from core.formats.plate_file import PlateFrames
from core.image.frame_cache import FrameCache, no_pixels
from core.image.plate import Plate
from core.image.plate_view import plate_size
from viewport.plate_color import PlateColors

BUDGET = 1 << 30  # bytes of frames as shown
AHEAD = 8


class Shown(NamedTuple):
    """A frame on the screen. frame : as files count. words : what is wrong with it, or ""."""

    frame: int
    pixels: NDArray[np.uint8]
    words: str = ""


class _Reel:
    """One opened plate: its frames as they are in the files, and as the screen shows them."""

    def __init__(self, plate: Plate, root: Any) -> None:
        self.plate = plate
        self.colors = PlateColors()
        self.decoder = FrameDecoder()
        self.source = PlateFrames(plate, self.decoder, root=root, ahead=0)
        self.frames = FrameCache(self._read, plate.frames, BUDGET, AHEAD)

    def _read(self, frame: int) -> NDArray[np.uint8]:
        return self.colors.display(self.source.read(frame), self.plate.color_space)

    def close(self) -> None:
        self.frames.close()
        self.source.close()
        self.decoder.close()


class PlateScreen(QObject):
    """The frames of the plate in view.

    fresh : a frame that was asked for is there.
    """

    fresh = Signal()

    def __init__(self, desk: Desk) -> None:
        super().__init__(desk)
        self._desk = desk
        self._reel: _Reel | None = None
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
        if reel.frames.knows(frame):
            pixels = reel.frames.get(frame)
            words = "" if pixels is not None else f"Frame {frame}: {reel.frames.broken.get(frame, 'it is missing.')}"
            self._last = Shown(frame, self._blank(plate) if pixels is None else pixels, words)
            return self._last
        if self._asked is None:
            self._ask(reel, frame)
        return self._last

    def held(self) -> tuple[int, ...]:
        """Frames of the desk that are in memory."""
        reel = self._reel
        return () if reel is None else tuple(
            f + reel.plate.offset for f in reel.plate.frames if reel.frames.knows(f))

    def pixels(self, plate: Plate, frame: int) -> NDArray[np.uint8] | None:
        """A frame that is in memory, without asking for it."""
        reel = self._opened(plate)
        return reel.frames.get(frame) if frame in plate.frames and reel.frames.knows(frame) else None

    def want(self, plate: Plate, frame: int) -> None:
        """Read a frame when nothing else is asked for."""
        reel = self._opened(plate)
        if frame in plate.frames and self._asked is None and not reel.frames.knows(frame):
            self._ask(reel, frame)

    def close(self) -> None:
        """Give everything back."""
        if self._reel is not None:
            self._reel.close()
        self._reel, self._asked, self._last = None, None, None

    def _ask(self, reel: _Reel, frame: int) -> None:
        self._asked = frame

        def done(found: Any) -> None:
            if self._reel is reel:
                self._asked = None
                self.fresh.emit()

        def failed(error: Exception) -> None:
            if self._reel is reel:
                self._asked = None
                if not isinstance(error, Cancelled):
                    self._desk.error(error)

        self._desk.jobs.start(
            f"Read frame {frame}", lambda progress, cancelled: reel.frames.get(frame), done, failed, self)

    def _opened(self, plate: Plate) -> _Reel:
        path = self._desk.session.path
        root = None if path is None else path.parent
        key = (plate.path, plate.first, plate.last, plate.width, plate.height, plate.crop, plate.color_space,
               plate.offset, root)
        if self._reel is None or key != self._key:
            self.close()
            self._reel, self._key = _Reel(plate, root), key
        return self._reel

    def _blank(self, plate: Plate) -> NDArray[np.uint8]:
        width, height = plate_size(plate)
        if (height, width) not in self._nothing:
            self._nothing = {(height, width): no_pixels(height, width)}
        return self._nothing[height, width]

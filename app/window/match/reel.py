"""An opened plate: its frames as the files have them, as the screen shows them, and as tracking sees them."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.frame_decoder import FrameDecoder
from core.formats.plate_file import PlateFrames
from core.image.frame_cache import FrameCache
from core.image.mix import mixed
from core.image.plate import ChannelMix, Plate
from core.workspace import PROXIES, PlateLook
from viewport.plate_color import PlateColors

FILES = 256 << 20  # bytes of frames as the files have them: what both others are made of
AHEAD = 8


class Reel:
    """Frames of one plate, held within `budget` bytes. Closed by who opened it, when no job reads from it any more.

    look : how the screen shows them. shown : as it does, uint8, smaller where a proxy is chosen.
    mix : through which tracking looks at them; what it sees is made along with full frames.
    """

    def __init__(self, plate: Plate, root: Path | None, budget: int, look: PlateLook) -> None:
        self.plate, self.root, self.mix, self.look = plate, root, plate.mix, look
        self._colors = PlateColors()
        self._decoder = FrameDecoder()
        self._source = PlateFrames(plate, self._decoder, root=root, ahead=0, budget=min(FILES, budget // 4))
        self._proxy = self._smaller(look)
        self._half = (budget - min(FILES, budget // 4)) // 2
        self.shown = FrameCache(self._display, plate.frames, self._half, AHEAD)
        self._seen: tuple[ChannelMix, FrameCache] | None = None
        self._lock = threading.Lock()
        self._readers, self._closing = 0, False

    @property
    def bytes(self) -> int:
        """Of all frames held."""
        seen = self._seen
        return self._source.cache.bytes + self.shown.bytes + (0 if seen is None else seen[1].bytes)

    def show_with(self, look: PlateLook) -> None:
        """Show frames in another way; they are not read again for it, unless as another proxy. Never waits."""
        if look is self.look or look.seen() == self.look.seen():
            self.look = look
            return
        if look.proxy != self.look.proxy:
            if self._proxy is not None:
                self._proxy.close()
            self._proxy = self._smaller(look)
        self.look = look
        self.shown.close(wait=False)
        self.shown = FrameCache(self._display, self.plate.frames, self._half, AHEAD)

    def _smaller(self, look: PlateLook) -> PlateFrames | None:
        smaller = PROXIES.index(look.proxy)
        return None if not smaller else PlateFrames(
            self.plate, self._decoder, root=self.root, ahead=0, proxy=2**smaller, budget=1)

    def seen(self, mix: ChannelMix) -> FrameCache:
        """Frames (H, W, C) float32 as tracking sees them through a mix; others are let go of."""
        with self._lock:
            if self._seen is None or self._seen[0] is not mix:
                if self._seen is not None:
                    self._seen[1].close()
                self._seen = mix, FrameCache(lambda frame: self._mixed(frame, mix), self.plate.frames, self._half, 2)
            return self._seen[1]

    @contextmanager
    def reading(self) -> Iterator[Reel]:
        """Keeps it open for a job on another thread."""
        with self._lock:
            self._readers += 1
        try:
            yield self
        finally:
            with self._lock:
                self._readers -= 1
                last = self._closing and not self._readers
            if last:
                self._end()

    def close(self) -> None:
        """Give everything back, now or when the last job that reads from it ends."""
        with self._lock:
            self._closing = True
            idle = not self._readers
        if idle:
            self._end()

    def _end(self) -> None:
        self.shown.close()
        if self._seen is not None:
            self._seen[1].close()
        self._source.close()
        if self._proxy is not None:
            self._proxy.close()
        self._decoder.close()

    def _display(self, frame: int) -> NDArray[np.uint8]:
        if self._proxy is not None:
            return self._colors.display(self._proxy.read(frame), self.plate.color_space, self.look)
        made = self._colors.display(self._raw(frame), self.plate.color_space, self.look)
        self.seen(self.mix).expect(frame)
        return made

    def _mixed(self, frame: int, mix: ChannelMix) -> NDArray[np.float32]:
        return mixed(self._raw(frame), mix)

    def _raw(self, frame: int) -> NDArray[np.generic]:
        """A frame as the file has it; UserError where it is missing or broken."""
        pixels = self._source.get(frame)
        if pixels is None:
            raise UserError(self._source.broken.get(frame, f"Frame {frame} is missing."))
        return pixels


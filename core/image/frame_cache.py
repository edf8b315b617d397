"""Frames in memory: those used last stay within a budget of bytes, those used next are read ahead."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError

Read = Callable[[int], NDArray[Any]]
DEFAULT_BUDGET = 2 << 30
POLL = 0.02  # s between two looks of somebody who waits whether it is still wanted


class GivenUp(Exception):
    """Somebody who waited for a frame does not want it any more, or who held it is closed."""


class FrameCache:
    """Frames by number; used from any thread, handed in, closed by who made it.

    read : gives the pixels of a frame or raises UserError; only ever called on the thread of the cache.
    frames : those there are. budget : bytes of all frames held. ahead : how many are read before they are asked for.
    broken : the frames that could not be read, with the sentence that says why.
    """

    def __init__(self, read: Read, frames: range, budget: int = DEFAULT_BUDGET, ahead: int = 4) -> None:
        self.frames, self.budget, self.ahead = frames, budget, ahead
        self.broken: dict[int, str] = {}
        self._read = read
        self._held: OrderedDict[int, NDArray[Any]] = OrderedDict()
        self._coming: dict[int, Future[NDArray[Any] | None]] = {}
        self._bytes = self._largest = 0
        self._last: int | None = None
        self._lock = threading.Lock()
        self._closed = False
        self._reader = ThreadPoolExecutor(1, thread_name_prefix="frames")

    def get(self, frame: int, given_up: Callable[[], bool] | None = None) -> NDArray[Any] | None:
        """The pixels of a frame, read-only; None for a broken one. Frames on from here, in the direction of the last
        two calls, are read ahead.

        given_up : asked while the frame is waited for; once it says True, :class:`GivenUp` is raised.
        """
        with self._lock:
            direction = -1 if self._last is not None and frame < self._last else 1
            self._last = frame
            found, coming = self._held.get(frame), None
            if found is not None:
                self._held.move_to_end(frame)
            elif frame not in self.broken:
                coming = self._want(frame)
            for n in range(1, self.ahead + 1):
                near = frame + direction * n
                room = self._bytes + (len(self._coming) + 2) * self._largest <= self.budget or n == 1
                if near in self.frames and near not in self._held and near not in self.broken and room:
                    self._want(near)
        if coming is None:
            return found
        while given_up is not None:
            try:
                return coming.result(POLL)
            except TimeoutError:
                if given_up():
                    raise GivenUp from None
        return coming.result()

    def expect(self, frame: int) -> None:
        """Read a frame soon that is not held yet, if there is room for it; nobody waits."""
        with self._lock:
            room = self._bytes + (len(self._coming) + 1) * self._largest <= self.budget
            if room and not self._closed and frame in self.frames and not (frame in self._held or frame in self.broken):
                self._want(frame)

    def knows(self, frame: int) -> bool:
        """True when :meth:`get` would answer at once."""
        with self._lock:
            return frame in self._held or frame in self.broken

    @property
    def bytes(self) -> int:
        """Bytes of the frames held."""
        return self._bytes

    def close(self, *, wait: bool = True) -> None:
        """Forget everything and end the thread, or without waiting let it end after the frame it reads."""
        with self._lock:
            self._closed = True
        self._reader.shutdown(wait=wait, cancel_futures=True)
        with self._lock:
            self._held.clear()
            self._bytes = 0

    def _want(self, frame: int) -> Future[NDArray[Any] | None]:
        if self._closed:
            raise GivenUp
        if frame not in self._coming:
            self._coming[frame] = self._reader.submit(self._fetch, frame)
        return self._coming[frame]

    def _fetch(self, frame: int) -> NDArray[Any] | None:
        try:
            pixels = self._read(frame)
        except UserError as error:
            with self._lock:
                self.broken[frame] = str(error)
                del self._coming[frame]
            return None
        except BaseException:
            with self._lock:
                del self._coming[frame]
            raise
        pixels.flags.writeable = False
        with self._lock:
            del self._coming[frame]
            if self._closed:
                return pixels
            self._held[frame] = pixels
            self._bytes += pixels.nbytes
            self._largest = max(self._largest, pixels.nbytes)
            while self._bytes > self.budget and len(self._held) > 1:
                _, old = self._held.popitem(last=False)
                self._bytes -= old.nbytes
        return pixels


def no_pixels(height: int, width: int) -> NDArray[np.uint8]:
    """What is shown in place of a broken frame: a checkerboard of two greys."""
    y, x = np.mgrid[0:height, 0:width]
    grey = np.where(((x // 16) + (y // 16)) % 2, 72, 56).astype(np.uint8)
    return np.repeat(grey[:, :, None], 3, axis=2)

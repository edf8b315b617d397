"""Frames of plates from a child process that decodes them, is bounded, and is begun anew when a frame kills it."""

from __future__ import annotations

import os
import selectors
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.frame_child import MOST_PIXELS, FrameAnswer, FrameRequest
from core.formats.sandbox import child_paths

BOOT = "import sys; sys.path[:0] = sys.argv[2:]; from core.formats.frame_child import main; main(int(sys.argv[1]))"
DTYPES = {"|u1", "<u2", "<f2", "<f4"}
SECONDS = 60.0  # for one frame
MEMORY = 8 << 30
LONGEST_HEAD = 1 << 16
POLL_SECONDS = 0.1


class Decoded(NamedTuple):
    """pixels : (H, W, 1 or 3) uint8, uint16, float16 or float32. facts : what the file says of itself."""

    pixels: NDArray[Any]
    facts: dict[str, float]


class FrameDecoder:
    """Decodes frames one after another; used from any thread, closed by who made it."""

    def __init__(self, seconds: float = SECONDS, memory: int = MEMORY) -> None:
        self._seconds, self._memory = seconds, memory
        self._child: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()

    def decode(
        self,
        path: Path,
        frame: int = 1,
        *,
        movie: bool = False,
        proxy: int = 1,
        cancel: Callable[[], bool] | None = None,
    ) -> Decoded:
        """The pixels of a picture, or of a frame of a movie (the first one is 1).

        Raises
        ------
        UserError
            The file is missing, damaged, takes too long or too much memory; the next call works again.
        """
        if not path.is_file():
            raise UserError(f"{path.name} is missing.")
        request = FrameRequest(path=str(path.resolve()), frame=frame, movie=movie, proxy=proxy)
        with self._lock:
            try:
                answer, pixels = self._ask(request, path.name, cancel)
            except BaseException:  # what the child would still say belongs to nobody
                self._end()
                raise
        if answer.error is not None:
            raise UserError(answer.error)
        return Decoded(pixels, answer.facts)

    def close(self) -> None:
        """End the child."""
        with self._lock:
            self._end()

    def _ask(
        self, request: FrameRequest, name: str, cancel: Callable[[], bool] | None
    ) -> tuple[FrameAnswer, NDArray[Any]]:
        if self._child is not None and self._child.poll() is not None:
            self._end()
        if self._child is None:
            self._child = subprocess.Popen(  # our own interpreter and fixed words
                [sys.executable, "-I", "-c", BOOT, str(self._memory), *child_paths()],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL, bufsize=0,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONIOENCODING": "utf-8"},
            )  # fmt: skip
        died = UserError(f"{name} could not be read: it is damaged and its decoder failed.")
        assert self._child.stdin is not None
        try:
            self._child.stdin.write(msgspec.json.encode(request) + b"\n")
        except OSError:
            raise died from None
        deadline = time.monotonic() + self._seconds
        with selectors.DefaultSelector() as selector:
            assert self._child.stdout is not None
            pipe = self._child.stdout.fileno()
            selector.register(pipe, selectors.EVENT_READ)

            def wait() -> None:
                while True:
                    if cancel is not None and cancel():
                        raise UserError(f"Reading {name} was cancelled.")
                    if selector.select(POLL_SECONDS):
                        return
                    if time.monotonic() > deadline:
                        raise UserError(
                            f"{name} took longer than {self._seconds:g} seconds to read; it may be damaged."
                        )

            head = b""
            while not head.endswith(b"\n"):
                wait()
                byte = os.read(pipe, 1)
                if not byte or len(head) > LONGEST_HEAD:
                    raise died
                head += byte
            try:
                answer = msgspec.json.decode(head, type=FrameAnswer)
            except msgspec.DecodeError:
                raise died from None
            if answer.error is not None:
                return answer, np.zeros((0, 0, 0), np.uint8)
            height, width, channels = answer.shape
            if answer.dtype not in DTYPES or min(answer.shape) < 1 or height * width > MOST_PIXELS or channels > 3:
                raise died
            pixels = np.empty(answer.shape, np.dtype(answer.dtype))
            room = memoryview(pixels.reshape(-1).view(np.uint8).data)
            while room:
                wait()
                got = os.readv(pipe, [room])
                if not got:
                    raise died
                room = room[got:]
        return answer, pixels

    def _end(self) -> None:
        child, self._child = self._child, None
        if child is None:
            return
        child.kill()
        child.wait()
        for pipe in (child.stdin, child.stdout):
            if pipe is not None:
                pipe.close()

"""Pictures over time into files: a numbered sequence, or a movie. What is there is whole, also after a cancel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.atomic import atomic_write
from core.formats.frame_file import frame_path
from viewport.picture import write_png

Picture = Callable[[float], NDArray[np.uint8]]  # (height, width, 3) sRGB, top row first, at a frame
Progress = Callable[[int], None]  # called before every picture with the number of those that are done
MOVIE_SUFFIXES = (".mp4", ".mov", ".mkv")
CODECS = ("libx264", "mpeg4")  # the first one the library has
QUALITY = {"libx264": {"crf": "18", "preset": "medium"}, "mpeg4": {"qmin": "2", "qmax": "4"}}
BT709 = 1  # matrix, primaries and transfer of HD, in the numbers of ISO/IEC 23091-2
LIMITED = 1  # video levels


def write_sequence(pattern: Path, frames: Sequence[int], picture: Picture, progress: Progress) -> list[Path]:
    """Write one PNG for every frame; returns the files.

    What `picture` or `progress` raises passes through; the pictures that were finished stay.

    Raises
    ------
    UserError
        A file cannot be written.
    """
    if pattern.suffix.lower() != ".png":
        raise UserError(f"{pattern.name}: pictures are written as PNG; give a name that ends in .png.")
    written = []
    for number, frame in enumerate(frames):
        progress(number)
        path = frame_path(pattern, frame)
        write_png(path, picture(float(frame)))
        written.append(path)
    return written


def write_movie(
    path: Path, frames: Sequence[int], fps: float, picture: Picture, progress: Progress,
    stopped: type[Exception] | tuple[type[Exception], ...] = (),
) -> int:
    """Write the frames as one movie (H.264 where the library has it, else MPEG-4); returns how many it shows.

    Parameters
    ----------
    stopped : exceptions of `picture` and `progress` that mean "that is enough": what was drawn becomes a shorter movie,
        then the exception passes on. After any other nothing is written, and an earlier file is as it was.

    Raises
    ------
    UserError
        An unknown suffix, or the file cannot be written.
    """
    if path.suffix.lower() not in MOVIE_SUFFIXES:
        raise UserError(f"{path.name}: movies are written as {', '.join(MOVIE_SUFFIXES)}.")
    if not frames:
        raise UserError("There are no frames to write; give a first and a last one.")
    enough: Exception | None = None
    done = 0
    with atomic_write(path) as beside:
        writer = _Writer(beside, fps)
        try:
            for frame in frames:
                progress(done)
                writer.add(picture(float(frame)))
                done += 1
        except stopped as error:
            if not done:
                raise
            enough = error
        finally:
            writer.close()
    if enough is not None:
        raise enough
    return done


class _Writer:
    """One stream of video into a file."""

    def __init__(self, path: Path, fps: float) -> None:
        import av

        self._av = av
        self._rate = Fraction(fps).limit_denominator(1001)
        self._container = av.open(str(path), "w")
        self._stream: Any = None
        self._size = (0, 0)

    def add(self, pixels: NDArray[np.uint8]) -> None:
        """Add a picture; all are of the size of the first."""
        if self._stream is None:
            self._begin(pixels.shape[1], pixels.shape[0])
        if pixels.shape[1::-1] != self._size:
            raise ValueError(f"a movie of {self._size} was given a picture of {pixels.shape[1::-1]}")
        odd = (pixels.shape[0] % 2, pixels.shape[1] % 2)
        if any(odd):  # half of the colour is kept, so sides are even: the last row or column twice
            pixels = np.pad(pixels, ((0, odd[0]), (0, odd[1]), (0, 0)), mode="edge")
        frame = self._av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), format="rgb24")
        frame = frame.reformat(format="yuv420p", dst_colorspace=BT709, dst_color_range=LIMITED)
        self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        """Write what is outstanding and end the file."""
        try:
            if self._stream is not None:
                self._container.mux(self._stream.encode(None))
        finally:
            self._container.close()

    def _begin(self, width: int, height: int) -> None:
        codec = next(name for name in CODECS if name in self._av.codecs_available)
        stream = self._container.add_stream(codec, rate=self._rate, options=QUALITY[codec])
        stream.width, stream.height = width + width % 2, height + height % 2
        stream.pix_fmt = "yuv420p"
        context = stream.codec_context
        context.colorspace = context.color_primaries = context.color_trc = BT709
        context.color_range = LIMITED
        self._stream, self._size = stream, (width, height)

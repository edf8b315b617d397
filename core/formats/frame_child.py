"""The child that decodes frames of plates: OpenImageIO and FFmpeg, inside limits, one request after another.

Requests are lines of JSON on standard input, answers a line of JSON and the raw pixels on standard output.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.sandbox import bound_process

MOST_PIXELS = 1 << 27
CPU_SECONDS = 24 * 3600.0  # a plate may be long; the parent's clock bounds every single frame


class FrameRequest(msgspec.Struct):
    """path: of a picture or a movie; frame: of a movie, from 1; proxy: 2 halves the sides, 4 quarters them."""

    path: str
    frame: int = 1
    movie: bool = False
    proxy: int = 1


class FrameAnswer(msgspec.Struct):
    """shape and dtype of the bytes that follow; facts about the file; or an error and no bytes."""

    shape: tuple[int, int, int] = (0, 0, 0)
    dtype: str = "|u1"
    facts: dict[str, float] = {}
    error: str | None = None


def main(memory: int) -> None:
    """Answer requests until standard input ends."""
    bound_process(CPU_SECONDS, memory)
    movies: dict[str, Any] = {}
    out = sys.stdout.buffer
    for line in sys.stdin.buffer:
        request = msgspec.json.decode(line, type=FrameRequest)
        name = Path(request.path).name
        try:
            pixels, facts = _movie(request, movies) if request.movie else _still(request)
            if request.proxy > 1:
                pixels = _smaller(pixels, request.proxy)
            pixels = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder("<"))
            answer = FrameAnswer(shape=pixels.shape, dtype=pixels.dtype.str, facts=facts)
        except UserError as error:
            pixels, answer = np.zeros(0, np.uint8), FrameAnswer(error=str(error))
        except MemoryError:
            pixels, answer = np.zeros(0, np.uint8), FrameAnswer(error=f"{name} needs too much memory.")
        except Exception as error:  # whatever a native decoder throws becomes one sentence here
            reason = " ".join(str(error).split())[:160].rstrip(".") or type(error).__name__
            pixels, answer = np.zeros(0, np.uint8), FrameAnswer(error=f"{name} could not be read ({reason}).")
        out.write(msgspec.json.encode(answer) + b"\n")
        if pixels.size:
            out.write(pixels.reshape(-1).view(np.uint8).data)
        out.flush()


def _still(request: FrameRequest) -> tuple[NDArray[Any], dict[str, float]]:
    import OpenImageIO as oiio

    oiio.attribute("threads", 1)
    name = Path(request.path).name
    source = oiio.ImageInput.open(request.path)
    if source is None:
        raise UserError(f"{name} could not be read ({' '.join(oiio.geterror().split())[:160].rstrip('.')}).")
    try:
        spec = source.spec()
        if spec.width * spec.height > MOST_PIXELS or spec.depth > 1 or min(spec.width, spec.height) < 1:
            raise UserError(f"{name} has {spec.width} x {spec.height} pixels, more than a plate may have.")
        kinds = {"uint8": oiio.UINT8, "uint16": oiio.UINT16, "half": oiio.HALF}
        kind = kinds.get(str(spec.format), oiio.UINT8 if spec.format == oiio.INT8 else oiio.FLOAT)
        pixels = source.read_image(0, 0, 0, min(spec.nchannels, 3), kind)
        if pixels is None:
            raise UserError(f"{name} is damaged ({' '.join(source.geterror().split())[:160].rstrip('.')}).")
        facts = {"pixel_aspect": spec.get_float_attribute("PixelAspectRatio", 1.0)}
        for fact, key in (("focal_mm", "Exif:FocalLength"), ("focal_35mm", "Exif:FocalLengthIn35mmFilm")):
            value = spec.getattribute(key)
            if isinstance(value, int | float) and value > 0:
                facts[fact] = float(value)
    finally:
        source.close()
    pixels = pixels.reshape(spec.height, spec.width, -1)
    if spec.nchannels == 2:  # grey with alpha
        pixels = pixels[:, :, :1]
    return pixels, facts


def _movie(request: FrameRequest, movies: dict[str, Any]) -> tuple[NDArray[Any], dict[str, float]]:
    name = Path(request.path).name
    movie = movies.get(request.path)
    if movie is None:
        movie = movies[request.path] = _Movie(request.path)
    frame = movie.at(request.frame - 1)
    if frame is None:
        raise UserError(f"{name} ends before its frame {request.frame}.")
    if frame.width * frame.height > MOST_PIXELS:
        raise UserError(f"{name} has {frame.width} x {frame.height} pixels, more than a plate may have.")
    deep = any(part.bits > 8 for part in frame.format.components)
    return frame.to_ndarray(format="rgb48le" if deep else "rgb24"), {"fps": movie.fps, "frames": float(movie.count)}


class _Movie:
    """A movie that gives its frames by number; forward is quick, back seeks to a key frame."""

    def __init__(self, path: str) -> None:
        import av

        self._container = av.open(path)
        if not self._container.streams.video:
            raise UserError(f"{Path(path).name} has no pictures.")
        self._stream = self._container.streams.video[0]
        self._stream.thread_type = "NONE"
        self.fps = float(self._stream.average_rate or self._stream.guessed_rate or 24)
        # the time of every frame, from the packets alone: containers lie about counts and begin anywhere
        times = sorted({p.pts for p in self._container.demux(self._stream) if p.pts is not None})
        if not times:
            raise UserError(f"{Path(path).name} has no pictures.")
        self._times, self.count = times, len(times)
        self._frames: Any = None
        self._next = -1

    def at(self, index: int) -> Any:
        if not 0 <= index < self.count:
            return None
        if self._frames is None or not self._next <= index <= self._next + 48:
            self._container.seek(self._times[index], stream=self._stream)
            self._frames = self._container.decode(self._stream)
        for frame in self._frames:
            if frame.pts is not None and frame.pts >= self._times[index]:
                self._next = index + 1
                return frame
        self._frames = None
        return None


def _smaller(pixels: NDArray[Any], times: int) -> NDArray[Any]:
    import cv2

    height, width = max(1, pixels.shape[0] // times), max(1, pixels.shape[1] // times)
    half = pixels.dtype == np.float16
    small = cv2.resize(pixels.astype(np.float32) if half else pixels, (width, height), interpolation=cv2.INTER_AREA)
    return small.reshape(height, width, -1).astype(pixels.dtype)

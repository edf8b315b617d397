"""Plates from files: folders and patterns of numbered pictures, stills, movies. Nothing here ever writes."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.frame_decoder import FrameDecoder
from core.image.frame_cache import DEFAULT_BUDGET, FrameCache
from core.image.plate import FilmBack, Plate, frame_name

PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".dpx", ".exr", ".ppm", ".pgm")
MOVIES = (".mp4", ".mov", ".mkv", ".avi", ".m4v", ".webm", ".mxf", ".mpg")
MOST_FRAMES = 1_000_000


def is_plate(path: Path) -> bool:
    """True for what can only be meant as a plate: a folder, a movie or a pattern of numbered files."""
    return path.is_dir() or path.suffix.lower() in MOVIES or "#" in path.name or "%" in path.name


def read_plate(path: str | Path, decoder: FrameDecoder, *, plate_id: int = 1) -> Plate:
    """Look at a plate: which frames it has, and what its first readable one says of itself.

    Parameters
    ----------
    path : a folder with one sequence (the longest is taken), a pattern (plate.####.exr, plate.%04d.exr, or a file of
        the sequence), a still or a movie.

    Raises
    ------
    UserError
        Nothing is there, or none of it can be read.
    """
    path = Path(path)
    if path.suffix.lower() in MOVIES and path.is_file():
        return _movie(path, decoder, plate_id)
    pattern, numbers = _sequence(path)
    first_error: UserError | None = None
    for number in numbers[:8]:
        file = Path(frame_name(pattern, number))
        try:
            pixels, facts = decoder.decode(file)
            break
        except UserError as error:
            first_error = first_error or error
    else:
        raise first_error if first_error is not None else UserError(f"{path.name} holds no frames.")
    there = set(numbers)
    missing = tuple(n for n in range(numbers[0], numbers[-1] + 1) if n not in there)
    return Plate(
        id=plate_id,
        name=_name(path),
        path=Path(pattern).as_posix(),
        first=numbers[0],
        last=numbers[-1],
        width=pixels.shape[1],
        height=pixels.shape[0],
        digest=_digest(file),
        missing=missing,
        focal_mm=facts.get("focal_mm"),
        film_back=_film_back(facts, pixels.shape[1], pixels.shape[0]),
        pixel_aspect=float(np.clip(facts.get("pixel_aspect", 1.0) or 1.0, 0.1, 10.0)),
    )


class PlateFrames:
    """The frames of a plate, decoded in the child, cut to the crop, held within a budget and read ahead."""

    def __init__(
        self,
        plate: Plate,
        decoder: FrameDecoder,
        *,
        root: Path | None = None,
        proxy: int = 1,
        budget: int = DEFAULT_BUDGET,
        ahead: int = 4,
    ) -> None:
        self.plate, self.proxy = plate, proxy
        self._decoder, self._root = decoder, root
        self.cache = FrameCache(self.read, plate.frames, budget, ahead)

    def get(self, frame: int) -> NDArray[Any] | None:
        """Pixels (H, W, 1 or 3) of the frame the files call `frame`, read-only; None where it is missing or broken."""
        return self.cache.get(frame)

    @property
    def broken(self) -> dict[int, str]:
        """Frames that were asked for and could not be read, with the reason."""
        return self.cache.broken

    def close(self) -> None:
        self.cache.close()

    def read(self, frame: int) -> NDArray[Any]:
        """As :meth:`get` without holding it; UserError when the frame is missing, broken or of another size."""
        plate = self.plate
        path = Path(frame_name(plate.path, frame))
        if self._root is not None:
            path = self._root / path
        pixels = self._decoder.decode(path, frame, movie=plate.movie, proxy=self.proxy).pixels
        size = (max(1, plate.height // self.proxy), max(1, plate.width // self.proxy))
        if pixels.shape[:2] != size:
            raise UserError(
                f"frame {frame} is {pixels.shape[1]} x {pixels.shape[0]} pixels, the plate {size[1]} x {size[0]}; "
                "it is left out."
            )
        left, top, right, bottom = (side // self.proxy for side in plate.crop)
        return np.ascontiguousarray(pixels[top : size[0] - bottom, left : size[1] - right])


def _film_back(facts: dict[str, Any], width: int, height: int) -> FilmBack | None:
    """What the light fell on, from the focal length and the one alike on 36 x 24 mm, which is by the diagonal."""
    focal, alike = facts.get("focal_mm"), facts.get("focal_35mm")
    if not focal or not alike or not 0.01 <= focal <= 100_000.0:
        return None
    scale = float(np.hypot(36.0, 24.0) * focal / alike / np.hypot(width, height))
    film = FilmBack(round(width * scale, 3), round(height * scale, 3))
    return film if all(0.01 <= side <= 10_000.0 for side in film) else None


def _movie(path: Path, decoder: FrameDecoder, plate_id: int) -> Plate:
    pixels, facts = decoder.decode(path, 1, movie=True)
    return Plate(
        id=plate_id,
        name=_name(path),
        path=path.as_posix(),
        first=1,
        last=max(1, int(facts["frames"])),
        width=pixels.shape[1],
        height=pixels.shape[0],
        digest=_digest(path),
        fps=float(np.clip(facts["fps"], 0.001, 100_000.0)),
        movie=True,
    )


def _sequence(path: Path) -> tuple[str, list[int]]:
    """A pattern with #s and the numbers of its files, rising."""
    import fileseq
    import fileseq.exceptions

    if path.is_dir():
        found = [s for s in fileseq.findSequencesOnDisk(str(path)) if s.extension().lower() in PICTURES]
        if not found:
            raise UserError(f"{path} holds no pictures; name a folder of {', '.join(PICTURES)}.")
        best = max(found, key=len)
    elif "#" in path.name or re.search(r"%\d*d", path.name):
        try:
            best = fileseq.findSequenceOnDisk(str(path))
        except (fileseq.exceptions.FileSeqException, OSError):
            raise UserError(f"no file fits {path.name} in {path.parent}.") from None
    elif path.is_file():
        if path.suffix.lower() not in PICTURES:
            raise UserError(f"{path.name} is no plate; name a folder, a pattern like plate.####.exr or a movie.")
        digits = re.search(r"(-?\d+)(?=\.[^.]+$)", path.name)
        if digits is None:
            return str(path), [1]
        start = digits.start()
        return _sequence(path.with_name(path.name[:start] + "#" * len(digits.group().lstrip("-")) + path.suffix))
    else:
        raise UserError(f"{path} does not exist; name a folder, a pattern like plate.####.exr or a movie.")
    numbers = sorted({int(n) for n in best.frameSet() or ()})
    if not numbers:
        return str(best), [1]
    if numbers[-1] - numbers[0] > MOST_FRAMES:
        raise UserError(f"{path.name} spans more than {MOST_FRAMES:,} frames; name a shorter range.")
    return f"{best.dirname()}{best.basename()}{'#' * max(1, best.zfill())}{best.extension()}", numbers


def _name(path: Path) -> str:
    name = path.resolve().name if path.is_dir() else re.sub(r"[._-]?(#+|%\d*d|-?\d+)?$", "", path.stem)
    return "".join(c for c in name if c.isprintable())[:255] or "plate"


def _digest(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        digest.update(file.read(1 << 20))
    digest.update(str(path.stat().st_size).encode())
    return digest.hexdigest()

"""Every file of 2D tracks: one table of formats, found by suffix and by what the file begins with."""

from __future__ import annotations

from pathlib import Path

from core.errors import UserError
from core.formats.tracks_json import LARGEST_FILE, Tracks, read_tracks_json, write_tracks_json

READERS = {".json": read_tracks_json}
WRITERS = {".json": write_tracks_json}
SUFFIXES = tuple(WRITERS)


def read_tracks(path: Path, size: tuple[int, int] | None = None) -> Tracks:
    """Read a file of tracks; `size` of the plate for formats that count from below or in parts of the picture.

    Raises
    ------
    UserError
        The file is missing, of a kind that is not known, or damaged.
    """
    try:
        length = path.stat().st_size
    except OSError as error:
        raise UserError(f"{path} cannot be opened ({error.strerror}).") from None
    if length > LARGEST_FILE:
        raise UserError(f"{path.name} is larger than {LARGEST_FILE >> 30} GB.")
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise UserError(f"{path.name} is no file of tracks; there are {', '.join(READERS)}.")
    return reader(path)


def write_tracks(path: Path, tracks: Tracks, suffix: str) -> None:
    """Write tracks in the format of `suffix` to the (temporary) path given."""
    WRITERS[suffix.lower()](path, tracks)

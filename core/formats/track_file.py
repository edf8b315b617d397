"""Every file of 2D tracks: one table of formats by suffix; .txt is told by what it begins with."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from core.errors import UserError
from core.formats import tracks_blender, tracks_nuke
from core.formats import tracks_text as text
from core.formats.tracks_json import LARGEST_FILE, Tracks, read_tracks_json, write_tracks_json
from core.match.track import Track

READERS: dict[str, Callable[[str, tuple[int, int], str], Tracks]] = {
    ".3de": text.read_3de, ".2dt": text.read_pftrack, ".boujou": text.read_boujou, ".syntheyes": text.read_syntheyes,
    ".uv": text.read_uv, ".nk": tracks_nuke.read_nuke, ".py": tracks_blender.read_blender,
}  # fmt: skip
WRITERS: dict[str, Callable[[tuple[Track, ...], tuple[int, int]], str]] = {
    ".3de": text.write_3de, ".txt": text.write_3de, ".2dt": text.write_pftrack, ".boujou": text.write_boujou,
    ".syntheyes": text.write_syntheyes, ".uv": text.write_uv, ".nk": tracks_nuke.write_nuke,
    ".py": tracks_blender.write_blender,
}  # fmt: skip
SUFFIXES = (".json", *WRITERS)


def read_tracks(path: Path, size: tuple[int, int]) -> Tracks:
    """Read a file of tracks; `size` of the plate is needed for formats that count from below or in parts of it.

    Raises
    ------
    UserError
        The file is missing, of a kind that is not known, or damaged.
    """
    try:
        length = path.stat().st_size
        if length > LARGEST_FILE:
            raise UserError(f"{path.name} is larger than {LARGEST_FILE >> 30} GB.")
        suffix = path.suffix.lower()
        if suffix == ".json":
            return read_tracks_json(path)
        words = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise UserError(f"{path} cannot be opened ({error.strerror}).") from None
    reader = _of_text(words) if suffix == ".txt" else READERS.get(suffix)
    if reader is None:
        raise UserError(f"{path.name} is no file of tracks; there are .json, .txt, {', '.join(READERS)}.")
    return reader(words, size, path.name)


def write_tracks(path: Path, tracks: Tracks, suffix: str) -> None:
    """Write tracks in the format of `suffix` to the (temporary) path given; .txt is 3DEqualizer's."""
    if suffix.lower() == ".json":
        write_tracks_json(path, tracks)
    else:
        path.write_text(WRITERS[suffix.lower()](tracks.tracks, tracks.size or (1, 1)), encoding="utf-8")


def _of_text(words: str) -> Callable[[str, tuple[int, int], str], Tracks]:
    first = words.lstrip()[:200]
    if first.startswith('"') or first.startswith('# "Name"'):
        return text.read_pftrack
    if first.split("\n", 1)[0].strip().isdigit():
        return text.read_3de
    return text.read_boujou

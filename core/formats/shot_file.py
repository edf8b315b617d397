"""Every file of a solved camera: one table of doors by suffix; COLMAP's model is named by its file of cameras,
that of OpenSfM reconstruction.json."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from core.errors import UserError
from core.formats import alembic_solve, shot_models, shot_sfm, shot_text, usd_solve
from core.formats.atomic import atomic_write
from core.formats.lens_file import lens_text
from core.match.solve.shot import Shot

COLMAP = ("cameras.txt", "cameras.bin")
TEXTS: dict[str, Callable[[Shot], str]] = {
    ".nk": shot_text.nuke_text, ".chan": shot_text.chan_text, ".ma": shot_text.maya_text,
    ".py": shot_text.blender_text, ".txt": lambda shot: lens_text(shot.lens, shot.size),
    ".out": shot_sfm.bundler_text, ".json": shot_sfm.opensfm_text,
}  # fmt: skip
WRITTEN = (
    *usd_solve.SUFFIXES, alembic_solve.SUFFIX, *(suffix for suffix in TEXTS if suffix != ".json"), *COLMAP,
    shot_sfm.OPENSFM,
)
READ = (*usd_solve.SUFFIXES, alembic_solve.SUFFIX, ".nk", ".chan", ".out", ".json", *COLMAP)


def check_writable(path: Path) -> None:
    """Refuse a name no shot is written as."""
    if path.suffix.lower() == ".bin" and path.name.lower() not in COLMAP:
        raise UserError(f"{path.name}: a camera is written as .bin for COLMAP alone; give the name cameras.bin.")
    if path.name.lower() not in WRITTEN and path.suffix.lower() not in WRITTEN:
        raise UserError(f"{path.name}: a camera is written as {', '.join(WRITTEN)}; choose one of these")


def write_shot(path: Path, shot: Shot, said: dict[str, Any]) -> None:
    """Write a shot as its name says, each file as a whole; `said` is more that USD keeps."""
    suffix = path.suffix.lower()
    if path.name.lower() in COLMAP:
        shot_models.write_colmap(path, shot)
    elif suffix in TEXTS:
        text = TEXTS[suffix](shot)
        with atomic_write(path) as beside:
            beside.write_text(text, encoding="utf-8")
    elif suffix == alembic_solve.SUFFIX:
        with atomic_write(path) as beside:
            alembic_solve.write(beside, shot)
    else:
        with atomic_write(path) as beside:
            usd_solve.write(beside, shot, said)


def read_shot(path: Path, size: tuple[int, int] | None) -> Shot:
    """Read a shot; `size` of the plate is needed where the file does not say.

    Raises
    ------
    UserError
        The file is missing, damaged, of a kind that is not read, or the size is missing.
    """
    if not path.is_file():
        raise UserError(f"{path} is not there; give the name of a file.")
    suffix = path.suffix.lower()
    if suffix in usd_solve.SUFFIXES:
        return usd_solve.read_shot(path)
    if suffix == alembic_solve.SUFFIX:
        return alembic_solve.read_shot(path)
    if path.name.lower() in COLMAP:
        return shot_models.read_colmap(path)
    if suffix == ".bin":
        raise UserError(f"{path.name}: of .bin files only COLMAP's models are read; choose the cameras.bin of one.")
    if path.stat().st_size > shot_models.LARGEST:
        raise UserError(f"{path.name} is larger than {shot_models.LARGEST >> 30} GB.")
    if suffix == ".json":
        return shot_sfm.read_opensfm(path.read_bytes(), path.name)
    readers = {".nk": shot_text.read_nuke, ".chan": shot_text.read_chan, ".out": shot_sfm.read_bundler}
    if suffix not in readers:
        raise UserError(f"{path.name} is no file of a camera path; there are {', '.join(READ)}.")
    if size is None:
        raise UserError(f"{path.name} does not say how large the plate is; give --size 1920x1080.")
    return readers[suffix](path.read_text(encoding="utf-8", errors="replace"), size, path.name)

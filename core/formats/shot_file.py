"""Every file of a solved camera: one table of doors by suffix; COLMAP's model is named by its file of cameras."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from core.errors import UserError
from core.formats import lens_file, usd_solve
from core.match.solve.shot import Shot

WRITTEN = (*usd_solve.SUFFIXES, ".txt")


def check_writable(path: Path) -> None:
    """Refuse a name no shot is written as."""
    if path.suffix.lower() not in WRITTEN:
        raise UserError(f"{path.name}: a camera is written as {', '.join(WRITTEN)}; choose one of these suffixes")


def write_shot(path: Path, suffix: str, shot: Shot, said: dict[str, Any]) -> None:
    """Write a shot in the format of `suffix` to the (temporary) path given; `said` is more that USD keeps."""
    if suffix in usd_solve.SUFFIXES:
        usd_solve.write(path, shot, said)
    else:
        path.write_text(lens_file.lens_text(shot.lens, shot.size), encoding="utf-8")

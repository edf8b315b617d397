"""What the commands that take any file share: is it there, does it hold curves, a rig.

USD and Alembic files may hold a groom or only meshes; curves are looked for first.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from core.document import Document
from core.errors import UserError
from core.formats import curve_file, mesh_file, rig_file
from core.formats.curve_file import CurveFile
from core.formats.rig_assembly import NoRig

Say = Callable[[str], None]
PROJECT = (".filo", ".filo1")


def must_exist(path: Path) -> None:
    if not path.is_file():
        raise UserError(f"there is no file {path}" if not path.exists() else f"{path} is a folder; name a file")


def curves_in(path: Path, unit: str | None = None, up: str | None = None) -> CurveFile | None:
    """The groom in a file, None when it is a mesh file or has no curves."""
    suffix = path.suffix.lower()
    if suffix not in curve_file.READ_SUFFIXES:
        return None
    if suffix not in mesh_file.READ_SUFFIXES:
        return curve_file.read_curve_file(path, unit, up)
    try:
        return curve_file.read_curve_file(path, unit, up)
    except UserError as error:
        if "no curves" in str(error):
            return None
        raise


def rig_document(path: Path, unit: str | None, up: str | None, say: Say) -> Document | None:
    """The document of a rig file; None when nothing in it moves, or what moves it cannot be used, which is said."""
    if path.suffix.lower() not in rig_file.READ_SUFFIXES:
        return None
    try:
        return rig_file.document_of(rig_file.read_rig(path, unit=unit, up=up, say=say))
    except NoRig:
        return None
    except UserError as error:
        if path.suffix.lower() not in mesh_file.READ_SUFFIXES:
            raise
        say(f"{error} The mesh is read without its rig.")
        return None

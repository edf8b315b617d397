"""Grooms in and out by the suffix of the file: the one place that knows which formats carry curves."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from core.errors import UserError
from core.formats import alembic_curves, alembic_write, hair, tressfx, usd_curves
from core.formats.atomic import atomic_write
from core.formats.file_space import axis_of, metres_of, scaled, to_metres_y_up
from core.formats.sandbox import run_bounded
from core.groom.strands import GroomStrands, Strands
from core.mesh.mesh import Mesh
from core.record import freeze

Writer = Callable[[Path, GroomStrands, Mesh | None, str, float, str], None]
Reader = Callable[[str], dict[str, Any]]


class Format(NamedTuple):
    """How one format is written (None: it is not) and read; native readers run in a bounded child."""

    name: str
    write: Writer | None
    read: Reader
    native: bool


FORMATS: dict[str, Format] = {
    **dict.fromkeys(usd_curves.SUFFIXES, Format("USD", usd_curves.write, usd_curves.read_in_child, True)),
    **dict.fromkeys(
        alembic_curves.SUFFIXES, Format("Alembic", alembic_write.write, alembic_curves.read_in_child, True)
    ),
    **dict.fromkeys(hair.SUFFIXES, Format("Cem Yuksel hair", hair.write, hair.read, False)),
    **dict.fromkeys(tressfx.SUFFIXES, Format("TressFX", None, tressfx.read, False)),
}
READ_SUFFIXES = tuple(FORMATS)
WRITE_SUFFIXES = tuple(suffix for suffix, made in FORMATS.items() if made.write is not None)


class CurveFile(NamedTuple):
    """A groom file as read, with what had to be decided on the way.

    metres_per_unit, up : the space that was used. notes : sentences for the artist, repairs and assumptions.
    """

    groom: GroomStrands
    format: str
    metres_per_unit: float
    up: str
    notes: tuple[str, ...]


def read_groom(
    path: str | Path, unit: str | None = None, up: str | None = None, sandboxed: bool = True
) -> GroomStrands:
    """The groom of a curve file, in metres and Y up; see :func:`read_curve_file` for what had to be assumed."""
    return read_curve_file(path, unit, up, sandboxed).groom


def read_curve_file(
    path: str | Path, unit: str | None = None, up: str | None = None, sandboxed: bool = True
) -> CurveFile:
    """Read guides and hairs from USD, Alembic, .hair or .tfx.

    Parameters
    ----------
    unit, up : the unit (m, cm, mm, in, ft) and axis (y, z) of a file that does not say; what a file says wins.
    sandboxed : parse native formats in a child process with limits. False only for files of our own making.

    Raises
    ------
    UserError
        When the format is not known, or the file is damaged or holds no curves.
    """
    path = Path(path)
    kind = _format(path)
    if not path.is_file():
        raise UserError(f"There is no file {path}.")
    if kind.native and sandboxed:
        target = f"{kind.read.__module__}:{kind.read.__name__}"
        raw = run_bounded(target, {"path": str(path.resolve())}, what=path.name, seconds=120, memory=8 << 30)
    else:
        try:
            raw = kind.read(str(path))
        except OSError as error:
            raise UserError(f"{path.name} could not be read: {error.strerror}.") from error
    notes = list(raw["notes"])
    said_unit, said_up = raw["metres_per_unit"], raw["up"]
    metres = metres_of(said_unit if said_unit is not None else unit or "m")
    axis = axis_of(said_up if said_up is not None else up or "y")
    if said_unit is None and unit is None:
        notes.append("The file does not say its unit; metres were taken. Give another with --unit.")
    if said_up is None and up is None:
        notes.append("The file does not say which axis is up; Y was taken. Give another with --up.")
    groom = GroomStrands(
        name=raw["name"],
        guides=_strands(raw, "guides", metres, axis, path),
        children=_strands(raw, "children", metres, axis, path),
    )
    if groom.guides is None and groom.children is None:
        raise UserError(" ".join([f"{path.name} holds no curves.", *raw["notes"][:1]]))
    return CurveFile(groom, kind.name, metres, axis, tuple(notes))


def write_groom(
    path: str | Path, groom: GroomStrands, mesh: Mesh | None = None, up: str = "y", metres_per_unit: float = 1.0
) -> None:
    """Write guides and hairs to the format of the suffix of `path`, whole or not at all.

    Parameters
    ----------
    mesh : written beside the curves in USD and Alembic. up, metres_per_unit : the space of the file; points
        are float32-exact in metres and Y up, else rounded once.

    Raises
    ------
    UserError
        When the format is not one that is written, or the disk refuses.
    """
    path = Path(path)
    kind = _format(path)
    if kind.write is None:
        raise UserError(f"{kind.name} files are only read; write one of {', '.join(WRITE_SUFFIXES)}.")
    if groom.guides is None and groom.children is None:
        raise UserError("This groom has neither hairs nor guides to write.")
    axis, metres = axis_of(up), metres_of(metres_per_unit)
    with atomic_write(path) as beside:
        kind.write(beside, groom, mesh, axis, metres, maker())


def curve_info(
    path: str | Path, unit: str | None = None, up: str | None = None, sandboxed: bool = True
) -> dict[str, Any]:
    """What a curve file holds, in words and numbers JSON can say."""
    file = read_curve_file(path, unit, up, sandboxed)
    bundles = {"guides": file.groom.guides, "hairs": file.groom.children}
    present = [strands for strands in bundles.values() if strands is not None]
    points = np.concatenate([strands.points for strands in present])
    columns = ("widths", "ids", "root_uvs", "colors", "guide_ids")
    return {
        "kind": "groom", "format": file.format, "name": file.groom.name,
        **{role: 0 if strands is None else len(strands) for role, strands in bundles.items()},
        "points": len(points), "metres_per_unit": file.metres_per_unit, "up": file.up,
        "bounds": [points.min(axis=0).tolist(), points.max(axis=0).tolist()],
        "columns": [name for name in columns if any(getattr(strands, name) is not None for strands in present)],
        "notes": list(file.notes),
    }  # fmt: skip


def maker() -> str:
    """Name and version of this program, as written into files."""
    try:
        return f"Filoplume {version('filoplume')}"
    except PackageNotFoundError:  # run from a checkout that was never installed
        return "Filoplume"


def _format(path: Path) -> Format:
    found = FORMATS.get(path.suffix.lower())
    if found is None:
        raise UserError(f"{path.name} is not a curve format Filoplume knows; use one of {', '.join(READ_SUFFIXES)}.")
    return found


def _strands(raw: dict[str, Any], role: str, metres: float, axis: str, path: Path) -> Strands | None:
    if f"{role}.counts" not in raw:
        return None
    columns: dict[str, Any] = {name: raw.get(f"{role}.{name}") for name in Strands.__struct_fields__}
    columns["points"] = to_metres_y_up(columns["points"], metres, axis)
    if columns["widths"] is not None:
        columns["widths"] = scaled(columns["widths"], metres)
    frozen: dict[str, Any] = {name: None if values is None else freeze(values) for name, values in columns.items()}
    try:
        return Strands(**frozen)
    except ValueError as error:
        raise UserError(f"{path.name} could not be read: {error}.") from error

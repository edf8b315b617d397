"""Meshes in and out by the suffix of the file: the one place that knows which formats carry polygons."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from core.errors import UserError
from core.formats import alembic_mesh, gltf, obj, off, ply, stl, usd_mesh
from core.formats.atomic import atomic_write
from core.formats.file_space import axis_of, metres_of
from core.formats.given_file import must_be_readable
from core.formats.mesh_pieces import unpack
from core.formats.sandbox import run_bounded
from core.mesh.mesh import Mesh
from core.mesh.polygons import Polygons
from core.mesh.repair import PROBLEMS, Repaired, repair

Say = Callable[[str], None]
SECONDS, MEMORY = 120.0, 8 << 30  # limits of a native reader
LARGEST_FILE = 4 << 30  # bytes
DAMAGE = (ValueError, IndexError, KeyError, OverflowError, RecursionError)


class Format(NamedTuple):
    """How one format is read: in this process, or by the child function `native`; and how it is written.

    metres, up : what the format itself fixes, None where it leaves it open.
    """

    name: str
    read: Callable[[Path], Polygons] | None
    write: Callable[[Path, Mesh], None]
    native: str | None = None
    metres: float | None = None
    up: str | None = None


_USD = Format("USD", None, usd_mesh.write_usd, "core.formats.usd_mesh:read_in_child")
_GLTF = Format("glTF", gltf.read_gltf, gltf.write_glb, metres=1.0, up="y")
FORMATS: dict[str, Format] = {
    ".obj": Format("Wavefront OBJ", obj.read_obj, obj.write_obj),
    ".ply": Format("PLY", ply.read_ply, ply.write_ply),
    ".stl": Format("STL", stl.read_stl, stl.write_stl),
    ".off": Format("OFF", off.read_off, off.write_off),
    ".glb": _GLTF,
    ".gltf": _GLTF,
    ".usd": _USD,
    ".usda": _USD,
    ".usdc": _USD,
    ".usdz": _USD,
    ".abc": Format("Alembic", None, alembic_mesh.write_alembic, "core.formats.alembic_mesh:read_in_child"),
}
READ_SUFFIXES = tuple(FORMATS)
WRITE_SUFFIXES = tuple(suffix for suffix in FORMATS if suffix != ".gltf")
INSTEAD = {
    ".fbx": "FBX", ".ma": "Maya", ".mb": "Maya", ".blend": "Blender", ".max": "3ds Max", ".c4d": "Cinema 4D",
    ".hip": "Houdini", ".hipnc": "Houdini", ".ztl": "ZBrush", ".zpr": "ZBrush", ".dae": "Collada", ".3ds": "3DS",
    ".lwo": "LightWave", ".bgeo": "Houdini", ".geo": "Houdini", ".x3d": "X3D", ".wrl": "VRML", ".3mf": "3MF",
    ".zip": "packed", ".mesh": "MEDIT", ".tfxmesh": "TressFX",
}  # fmt: skip


class MeshFile(NamedTuple):
    """A mesh as read and repaired.

    mesh : metres, Y up. name : of the file, without its suffix.
    metres_per_unit, up : the space that was used. unit_source, up_source : who said so: "file", "given" or "assumed".
    problems : how many of each kind were met (words in ``core.mesh.repair.PROBLEMS``); notes : sentences to show.
    vertices, faces : counts in the file. vertex_of_file, face_of_file : where each went (-1: a face left out).
    closed : the surface has an inside.
    """

    mesh: Mesh
    name: str
    metres_per_unit: float
    up: str
    unit_source: str
    up_source: str
    problems: dict[str, int]
    notes: tuple[str, ...]
    vertices: int
    faces: int
    vertex_of_file: np.ndarray
    face_of_file: np.ndarray
    closed: bool


def read_mesh(
    path: str | Path,
    unit: str | float | None = None,
    up: str | None = None,
    say: Say | None = None,
    sandboxed: bool = True,
    cancel: Callable[[], bool] | None = None,
) -> MeshFile:
    """Read a polygon mesh of any known format; polygons, UVs of corners and named parts are kept.

    Parameters
    ----------
    unit, up : unit (m, cm, mm, in, ft) and up axis (y, z) of a file that does not say; what a file says wins.
    say : called with each sentence of the notes (assumed unit, repairs).
    sandboxed : run native readers in a child process. False only for files this program has just written.
    cancel : asked now and then while a native reader works.

    Raises
    ------
    UserError
        One sentence: an unknown format, a file that is missing, damaged, or without usable faces.
    """
    path = Path(path)
    how = _format_of(path)
    must_be_readable(path, "mesh", LARGEST_FILE)
    metres_given = None if unit is None else metres_of(unit)
    up_given = None if up is None else axis_of(up)
    try:
        polygons, metres, axis = _read(path, how, sandboxed, cancel)
        space = _space(metres, axis, metres_given, up_given)
        repaired = repair(_to_metres(polygons, space.metres, space.up))
    except DAMAGE as error:
        raise UserError(f"{path.name} is damaged and cannot be read; export it again.") from error
    except MemoryError:
        raise UserError(f"{path.name} is too large for the memory of this machine.") from None
    except UserError as error:
        if path.name in str(error):
            raise
        raise UserError(f"{path.name}: {error}") from error
    if len(repaired.mesh.part_names) == 1 and repaired.mesh.part_names[0] == "mesh":
        repaired = repaired._replace(mesh=repaired.mesh.replace(part_names=(path.stem or "mesh",)))
    notes = (*_space_notes(path.name, space, repaired.mesh), *_problem_notes(path.name, repaired))
    for note in notes if say is not None else ():
        assert say is not None
        say(note)
    return MeshFile(
        repaired.mesh, path.stem, space.metres, space.up, space.source, space.up_source, repaired.problems, notes,
        len(polygons.points), len(polygons.counts), repaired.vertex_of_source, repaired.face_of_source,
        repaired.closed,
    )  # fmt: skip


def write_mesh(path: str | Path, mesh: Mesh) -> None:
    """Write `mesh` in the format of the suffix, metres, Y up, replacing the file as a whole or not at all.

    Raises
    ------
    UserError
        An unknown suffix, or a folder that cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in WRITE_SUFFIXES:
        raise UserError(f"{path.name}: meshes can be written as {', '.join(WRITE_SUFFIXES)}.")
    how = FORMATS[path.suffix.lower()]
    with atomic_write(path) as beside:
        how.write(beside, mesh)


def mesh_info(path: str | Path) -> dict[str, Any]:
    """What a mesh file holds, as plain JSON values.

    ``vertices`` and ``faces`` count what the file says; ``problems`` what the repair met; ``size`` is the box in
    metres; ``unit`` the metres of one unit, null where the file does not say.
    """
    found = read_mesh(path)
    mesh = found.mesh
    return {
        "kind": "mesh",
        "format": _format_of(Path(path)).name,
        "name": found.name,
        "parts": len(mesh.part_names),
        "part_names": list(mesh.part_names[:1000]),
        "vertices": found.vertices,
        "faces": found.faces,
        "triangles": int((mesh.counts == 3).sum()),
        "quads": int((mesh.counts == 4).sum()),
        "uvs": mesh.uvs is not None,
        "closed": found.closed,
        "unit": found.metres_per_unit if found.unit_source == "file" else None,
        "up": found.up,
        "size": [round(x, 9) for x in _size(mesh)],
        "problems": found.problems,
    }


class _Space(NamedTuple):
    metres: float
    up: str
    source: str
    up_source: str


def _format_of(path: Path) -> Format:
    suffix = path.suffix.lower()
    if suffix in FORMATS:
        return FORMATS[suffix]
    if suffix in INSTEAD:
        kind = INSTEAD[suffix]
        raise UserError(f"{path.name} is a {kind} file, which is not read; export the mesh as USD, Alembic or OBJ.")
    raise UserError(f"{path.name} is no mesh format that is known; use {', '.join(READ_SUFFIXES)}.")


def _read(
    path: Path, how: Format, sandboxed: bool, cancel: Callable[[], bool] | None
) -> tuple[Polygons, float | None, str | None]:
    if how.native is None:
        assert how.read is not None
        return how.read(path), how.metres, how.up
    if sandboxed:
        answer = run_bounded(
            how.native, {"path": str(path.resolve())}, what=path.name, seconds=SECONDS, memory=MEMORY, cancel=cancel
        )
    else:
        module = usd_mesh if how is _USD else alembic_mesh
        answer = module.read_in_child(str(path.resolve()))
    metres = answer["metres_per_unit"]
    if metres is not None and not 1e-9 < metres < 1e9:
        metres = None
    return unpack(answer), metres, answer["up"] if answer["up"] in ("y", "z") else None


def _space(metres: float | None, up: str | None, metres_given: float | None, up_given: str | None) -> _Space:
    source = "file" if metres is not None else "assumed" if metres_given is None else "given"
    up_source = "file" if up is not None else "assumed" if up_given is None else "given"
    return _Space(
        metres if metres is not None else 1.0 if metres_given is None else metres_given,
        up if up is not None else up_given or "y", source, up_source,
    )  # fmt: skip


def _to_metres(polygons: Polygons, metres: float, up: str) -> Polygons:
    points = polygons.points
    if up == "z":
        points = np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)
    if metres != 1.0:
        with np.errstate(all="ignore"):
            points = points * metres
    return polygons._replace(points=points)


def _space_notes(name: str, space: _Space, mesh: Mesh) -> list[str]:
    missing = [
        (space.source, "metres", "its unit", "--unit"), (space.up_source, "Y up", "its up axis", "--up"),
    ]  # fmt: skip
    assumed = [row for row in missing if row[0] == "assumed"]
    if not assumed:
        return []
    x, y, z = _size(mesh)
    words, lacks, options = (" and ".join(row[i] for row in assumed) for i in (1, 2, 3))
    return [
        f"{name} does not say {lacks.replace(' and ', ' or ')}: {words} assumed, "
        f"which makes it {x:.3g} x {y:.3g} x {z:.3g} m; set {options} to change that."
    ]


def _size(mesh: Mesh) -> list[float]:
    """Width, height and depth of the box around the faces, metres; vertices no face uses do not count."""
    used = np.zeros(len(mesh.points), np.bool_)
    used[mesh.corners] = True
    return list((mesh.points[used].max(axis=0) - mesh.points[used].min(axis=0)).tolist())


def _problem_notes(name: str, repaired: Repaired) -> list[str]:
    met = {kind: count for kind, count in repaired.problems.items() if kind not in ("islands", "missing_uvs")}
    if not met:
        return []
    return [f"{name} was worked around: " + ", ".join(f"{met[kind]} {PROBLEMS[kind]}" for kind in met) + "."]

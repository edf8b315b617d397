"""Documents out of the door: coats and meshes to files, pictures to PNG, by the suffix of the file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from core.camera import Camera, frame_points
from core.document import Document, find_mesh
from core.errors import UserError
from core.evaluator import Evaluator
from core.formats import curve_file, mesh_file
from core.formats.project import write_project
from core.groom.children import Children
from core.groom.export import groom_strands
from core.mesh.skin import skin_at_rest

VIEWS = {
    "three-quarter": (-0.85, -0.35, -1.0), "front": (0.0, -0.08, -1.0), "back": (0.0, -0.08, 1.0),
    "left": (-1.0, -0.08, 0.0), "right": (1.0, -0.08, 0.0), "top": (0.0, -1.0, -0.02),
}


def check_outputs(outputs: list[Path], png: Path | None) -> None:
    """Refuse what cannot be written before any work is done: unknown suffixes, folders that do not exist."""
    known = (".filo", *curve_file.WRITE_SUFFIXES)
    for path in outputs:
        if path.suffix.lower() not in known:
            raise UserError(f"{path.name}: a coat is written as {', '.join(known)}; choose one of these suffixes")
    if png is not None and png.suffix.lower() != ".png":
        raise UserError(f"{png.name}: pictures are written as .png")
    for path in [*outputs, *([png] if png else [])]:
        if not path.resolve().parent.is_dir():
            raise UserError(f"the folder {path.resolve().parent} does not exist; make it first")
        if path.is_dir():
            raise UserError(f"{path} is a folder; name a file")


def deliver(path: Path, document: Document, children: Mapping[int, Children]) -> None:
    """Write the document (``.filo``) or its first coat (USD, Alembic, .hair) to `path`."""
    if path.suffix.lower() == ".filo":
        write_project(path, document)
        return
    if not document.grooms:
        raise UserError(f"there is no groom to write to {path.name}; a mesh alone goes to .obj, .ply or .glb")
    groom = document.grooms[0]
    mesh = find_mesh(document, groom.mesh_id).mesh
    curve_file.write_groom(path, groom_strands(groom, mesh, children[groom.id]), mesh)


def write_mesh_of(path: Path, document: Document) -> None:
    """Write the meshes of a document, the first one, to a mesh file."""
    if not document.meshes:
        raise UserError("this document has no mesh")
    mesh_file.write_mesh(path, document.meshes[0].mesh)


def draw(
    path: Path, document: Document, children: Mapping[int, Children], evaluator: Evaluator,
    size: tuple[int, int] = (1600, 1000), view: str = "three-quarter", camera: Camera | None = None,
) -> None:
    """Draw the document's meshes and coats into a PNG."""
    from viewport.document_scene import scene_of  # GL is loaded only when a picture is asked for
    from viewport.picture import render_png

    skins = {item.id: skin_at_rest(item.mesh, evaluator) for item in document.meshes}
    scene = scene_of(document, skins, children)
    if camera is None:
        camera = frame_points(_bounds(document, children), VIEWS[view], size[0] / size[1])
    render_png(path, scene, camera, size)


def _bounds(document: Document, children: Mapping[int, Children]):  # type: ignore[no-untyped-def]
    import numpy as np

    clouds = [item.mesh.points for item in document.meshes]
    clouds += [np.ascontiguousarray(c.points[:, :, -1]) for c in children.values() if len(c)]
    return np.concatenate(clouds) if clouds else np.zeros((1, 3), np.float32)

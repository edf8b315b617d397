"""Documents out of the door: coats and meshes to files, pictures to PNG, by the suffix of the file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from core.camera import Camera, frame_points
from core.document import Document, find_mesh, visible_grooms
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.pieces import FeatherMesh
from core.formats import curve_file
from core.formats.project import write_project
from core.gate import seen_through
from core.groom.children import Children
from core.groom.export import groom_strands
from core.groom.flow import nose_vertex
from core.groom.groom import Groom
from core.groom.strands import GroomStrands
from core.mesh.skin import Skin, skin_at_rest, skin_posed
from core.posed import points_at
from core.workspace import Workspace

if TYPE_CHECKING:
    from viewport.scene import Scene

# where the camera looks, seen from an animal that faces +z
VIEWS = {
    "three-quarter": (-0.85, -0.35, -1.0), "front": (0.0, -0.08, -1.0), "back": (0.0, -0.08, 1.0),
    "left": (-1.0, -0.08, 0.0), "right": (1.0, -0.08, 0.0), "top": (0.0, -1.0, -0.02),
}


SAVED = "saved"  # the view as a project was left
SIZE = (1600, 1000)


def saved_view(workspace: Workspace, size: tuple[int, int] | None) -> tuple[Camera, tuple[int, int]] | None:
    """The camera a project was left with and the size of its picture: of what its film gate takes, where it is shown.

    size : asked for; the whole gate lies within it. None for one as wide as usual, of the aspect of the gate.
    """
    if not workspace.cameras:
        return None
    camera, gate = workspace.cameras[0], workspace.view.gate if workspace.view.gate_shown else None
    if gate is None:
        return camera, size or SIZE
    if size is None:
        size = SIZE[0], max(round(SIZE[0] / gate.aspect), 1)
    taller = max(1.0, gate.aspect * size[1] / size[0])
    return seen_through(gate.replace(height=gate.height * taller), camera), size


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
    """Write the document (``.filo``) or its first visible coat (USD, Alembic, .hair) to `path`."""
    if path.suffix.lower() == ".filo":
        write_project(path, document)
        return
    if not document.grooms:
        raise UserError(f"there is no groom to write to {path.name}; a mesh alone goes to .obj, .ply or .glb")
    groom = exported_groom(document)
    mesh = find_mesh(document, groom.mesh_id).mesh
    curve_file.write_groom(path, groom_strands(groom, mesh, children[groom.id]), mesh)


def exported_groom(document: Document) -> Groom:
    """The first groom that is not hidden; UserError when all are."""
    shown = visible_grooms(document)
    if not shown:
        raise UserError("Every groom of this document is hidden; show the one to export in the scene panel.")
    return shown[0]


def posed_document(document: Document, frame: float | None, evaluator: Evaluator) -> dict[int, Skin]:
    """The skin of every mesh (by id) at a frame of its clip; at rest without a frame or without a rig."""
    skins = {}
    for item in document.meshes:
        if frame is None or item.rig is None:
            skins[item.id] = skin_at_rest(item.mesh, evaluator)
        else:
            points = points_at(item.mesh, item.rig, item.correctives, frame, evaluator)
            skins[item.id] = skin_posed(item.mesh, points, evaluator)
    return skins


def draw(
    path: Path, document: Document, children: Mapping[int, Children], evaluator: Evaluator,
    size: tuple[int, int] = SIZE, view: str = "three-quarter", skins: Mapping[int, Skin] | None = None,
    camera: Camera | None = None, feathers: tuple[FeatherMesh, ...] = (),
) -> None:
    """Draw the document's meshes and coats into a PNG, at rest or in the pose of `skins`, from a side or a camera."""
    from viewport.document_scene import feathered, scene_of  # GL is loaded only when a picture is asked for

    shown = posed_document(document, None, evaluator) if skins is None else skins
    first = next(iter(shown.values()), None)
    direction = VIEWS[view] if first is None else turned_view(VIEWS[view], first)
    scene = scene_of(document, shown, children)
    if feathers:
        scene = feathered(scene, document, shown, feathers)
    _picture(path, scene, size, direction, camera)


def turned_view(view: tuple[float, float, float], skin: Skin) -> tuple[float, float, float]:
    """The view, turned about the vertical so that front is where an animal looks."""
    nose = nose_vertex(skin.points, skin.triangles.vertices)
    if nose < 0:
        return view
    ahead = skin.points[nose] - 0.5 * (skin.points.min(axis=0) + skin.points.max(axis=0))
    quarter = round(np.arctan2(ahead[0], ahead[2]) / (0.5 * np.pi)) * 0.5 * np.pi
    c, s = float(np.cos(quarter)), float(np.sin(quarter))
    return (c * view[0] + s * view[2], view[1], c * view[2] - s * view[0])


def draw_strands(path: Path, groom: GroomStrands, size: tuple[int, int], view: str) -> None:
    """Draw a groom file that came without its animal."""
    from viewport.document_scene import scene_of_strands

    _picture(path, scene_of_strands(groom), size, VIEWS[view])


def _picture(
    path: Path, scene: Scene, size: tuple[int, int], view: tuple[float, float, float], camera: Camera | None = None,
) -> None:
    from viewport.picture import render_png
    from viewport.scene import bounding_points, point_arrays

    clouds = [bounding_points(points) for points in point_arrays(scene) if len(points)]
    points = np.concatenate(clouds) if clouds else np.zeros((1, 3), np.float32)
    render_png(path, scene, camera or frame_points(points, view, size[0] / size[1]), size)

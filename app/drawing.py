"""The picture of a file of any kind."""

from __future__ import annotations

from pathlib import Path

from app.deliver import SAVED, SIZE, VIEWS, draw, draw_strands, posed_document, saved_view
from app.feather_frames import feather_meshes
from app.files import PROJECT, Say, curves_in, must_exist, rig_document
from core.document import Document, MeshObject, visible_grooms
from core.errors import UserError
from core.evaluator import Evaluator
from core.formats import mesh_file, project
from core.groom.grow import grow


def draw_file(
    path: Path, png: Path, size: tuple[int, int] | None, view: str | None, frame: float | None, say: Say,
    unit: str | None = None, up: str | None = None,
) -> None:
    """Draw whatever `path` holds into `png`.

    Without a view a project with a film gate is drawn as that takes it; without a size in its aspect.
    """
    must_exist(path)
    evaluator, camera = Evaluator(), None
    if path.suffix.lower() in PROJECT:
        document, workspace = project.read_project(path)
        gated = workspace.view.gate is not None and workspace.view.gate_shown
        if view == SAVED or (view is None and gated):
            saved = saved_view(workspace, size)
            if saved is None and view == SAVED:
                raise UserError(f"{path.name} was never looked at in the window: choose one of {', '.join(VIEWS)}.")
            camera, size = saved or (None, size)
    elif view == SAVED:
        raise UserError(f"{path.name} holds no view; only a project does.")
    size, view = size or SIZE, "three-quarter" if view in (None, SAVED) else view
    if path.suffix.lower() not in PROJECT:
        curves = curves_in(path, unit, up)
        if curves is not None:
            draw_strands(png, curves.groom, size, view)
            return
        rigged = None if frame is None else rig_document(path, unit, up, say)
        if rigged is None:
            mesh = mesh_file.read_mesh(path, unit=unit, up=up, say=say)
            rigged = Document(meshes=(MeshObject(id=1, name=mesh.name, mesh=mesh.mesh),))
        document = rigged
    skins = posed_document(document, frame, evaluator)
    now = document.first_frame if frame is None else frame
    children = {
        g.id: grow(g, skins[g.mesh_id].mesh, evaluator, skin=skins[g.mesh_id], frame=now)
        for g in visible_grooms(document)
        if g.coat.count  # the keys of feathers grow no hair
    }
    feathers = feather_meshes(document, skins, now, evaluator)
    draw(png, document, children, evaluator, size, view, skins, camera, feathers)

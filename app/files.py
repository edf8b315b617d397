"""Any file the program knows, whatever it holds: described, checked, converted, drawn.

USD and Alembic files may hold a groom or only meshes; curves are looked for first.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from app.deliver import (
    SAVED,
    SIZE,
    VIEWS,
    deliver,
    draw,
    draw_strands,
    exported_groom,
    posed_document,
    saved_view,
)
from app.feather_frames import feather_meshes
from core.document import Document, MeshObject, visible_grooms
from core.errors import UserError
from core.evaluator import Evaluator
from core.formats import curve_file, mesh_file, project, recovery, rig_file
from core.formats import journal as journal_file
from core.formats.curve_file import CurveFile
from core.formats.rig_assembly import NoRig, RigFile
from core.groom.grow import grow

Say = Callable[[str], None]
PROJECT = (".filo", ".filo1")


def describe(path: Path) -> dict[str, Any]:
    """What a file holds, as plain JSON values: at least kind, parts, vertices, faces, problems, guides, hairs."""
    _must_exist(path)
    if path.suffix.lower() in PROJECT:
        return project.project_info(path)
    curves = _curves(path)
    if curves is not None:
        return {**curve_file.curve_info(path), **_rig_beside_hair(path)}
    return _describe_mesh(path)


def troubles(path: Path) -> list[str]:
    """Everything wrong with a file, one sentence each; empty when it is whole."""
    _must_exist(path)
    suffix = path.suffix.lower()
    if suffix in PROJECT:
        return project.check_project(path)
    if suffix in journal_file.SUFFIXES:
        return recovery.check_journal(path)
    try:
        curves = _curves(path)
        if curves is not None:
            return _curve_troubles(curves)
        found = _describe_mesh(path)
        rig = [str(found["rig_problem"])] if "rig_problem" in found else []
        return rig + [f"{kind.replace('_', ' ')}: {count}" for kind, count in found["problems"].items()]
    except UserError as error:
        return [str(error)]


def convert(source: Path, target: Path, unit: str | None, up: str | None, say: Say) -> dict[str, Any]:
    """Convert a file; returns counts of what was written."""
    _must_exist(source)
    suffix = target.suffix.lower()
    if source.suffix.lower() in PROJECT:
        return _convert_document(project.read_project(source).document, target)
    curves = _curves(source, unit, up)
    if curves is not None:
        for note in curves.notes:
            say(note)
        if suffix in PROJECT:
            raise UserError("a coat without its animal cannot become a project; groom the mesh, then comb to this coat")
        curve_file.write_groom(target, curves.groom)
        return {"guides": _count(curves.groom.guides), "hairs": _count(curves.groom.children)}
    if suffix in PROJECT and (rigged := _rig_document(source, unit, up, say)) is not None:
        project.write_project(target, rigged)
        return {"vertices": len(rigged.meshes[0].mesh.points), "faces": len(rigged.meshes[0].mesh.counts)}
    mesh = mesh_file.read_mesh(source, unit=unit, up=up, say=say)
    if suffix in PROJECT:
        project.write_project(target, Document(meshes=(MeshObject(id=1, name=mesh.name, mesh=mesh.mesh),)))
    else:
        mesh_file.write_mesh(target, mesh.mesh)
    return {"vertices": len(mesh.mesh.points), "faces": len(mesh.mesh.counts)}


def draw_file(
    path: Path, png: Path, size: tuple[int, int] | None, view: str | None, frame: float | None, say: Say,
    unit: str | None = None, up: str | None = None,
) -> None:
    """Draw whatever `path` holds into `png`.

    Without a view a project with a film gate is drawn as that takes it; without a size in its aspect.
    """
    _must_exist(path)
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
        curves = _curves(path, unit, up)
        if curves is not None:
            draw_strands(png, curves.groom, size, view)
            return
        rigged = None if frame is None else _rig_document(path, unit, up, say)
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


def _rig_beside_hair(path: Path) -> dict[str, Any]:
    """What moves, in a file that holds curves as well."""
    if path.suffix.lower() not in rig_file.READ_SUFFIXES:
        return {}
    try:
        return rig_file.rig_info(rig_file.read_rig(path))
    except UserError:
        return {}


def _describe_mesh(path: Path) -> dict[str, Any]:
    """What a mesh file holds, and its rig where it has one; a rig that cannot be used is a ``rig_problem``."""
    if path.suffix.lower() not in rig_file.READ_SUFFIXES:
        return mesh_file.mesh_info(path)
    rig: RigFile | None = None
    problem: dict[str, Any] = {}
    try:
        rig = rig_file.read_rig(path)
    except NoRig:
        pass
    except UserError as error:
        problem = {"rig_problem": str(error)}
    if path.suffix.lower() in mesh_file.READ_SUFFIXES:
        held = mesh_file.mesh_info(path)
        return {**held, **problem} if rig is None else {**held, "kind": "rig", **rig_file.rig_info(rig)}
    if rig is None:
        raise UserError(str(problem.get("rig_problem", f"{path.name} holds nothing that moves")))
    mesh = rig.mesh
    return {
        "kind": "rig", "format": path.suffix[1:].upper(), "name": rig.name,
        "parts": 0 if mesh is None else len(mesh.part_names), "vertices": 0 if mesh is None else len(mesh.points),
        "faces": 0 if mesh is None else len(mesh.counts), "problems": {}, **rig_file.rig_info(rig),
    }


def _rig_document(path: Path, unit: str | None, up: str | None, say: Say) -> Document | None:
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


def _convert_document(document: Document, target: Path) -> dict[str, Any]:
    suffix = target.suffix.lower()
    meshes_only = suffix in mesh_file.WRITE_SUFFIXES and suffix not in curve_file.WRITE_SUFFIXES
    if meshes_only or (not document.grooms and suffix not in PROJECT):
        if not document.meshes:
            raise UserError("this document is empty")
        mesh = document.meshes[0].mesh
        mesh_file.write_mesh(target, mesh)
        return {"vertices": len(mesh.points), "faces": len(mesh.counts)}
    evaluator = Evaluator()
    meshes = {item.id: item.mesh for item in document.meshes}
    children = {}
    if suffix not in PROJECT:
        first = exported_groom(document)
        children = {first.id: grow(first, meshes[first.mesh_id], evaluator, frame=document.first_frame)}
    deliver(target, document, children)
    if children:
        hairs = sum(len(c.shown(c.traits.density)) for c in children.values())
    else:
        hairs = sum(g.coat.count for g in document.grooms)
    return {"guides": sum(len(g.guides) for g in document.grooms), "hairs": hairs}


def _curves(path: Path, unit: str | None = None, up: str | None = None) -> CurveFile | None:
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


def _curve_troubles(curves: CurveFile) -> list[str]:
    found = []
    for role, strands in (("guides", curves.groom.guides), ("hairs", curves.groom.children)):
        if strands is None:
            continue
        if strands.ids is not None and len(np.unique(strands.ids)) != len(strands):
            found.append(f"{role}: ids are used twice")
        starts = np.cumsum(strands.counts) - strands.counts
        spans = np.linalg.norm(np.diff(strands.points.astype(np.float64), axis=0), axis=1)
        inner = np.ones(max(len(strands.points) - 1, 0), bool)
        inner[starts[1:] - 1] = False
        empty = int((np.add.reduceat(np.where(inner, spans, 0.0), starts) <= 0).sum()) if len(spans) else 0
        if empty:
            found.append(f"{role}: {empty} curves have no length")
    return found


def _count(strands: Any) -> int:
    return 0 if strands is None else len(strands)


def _must_exist(path: Path) -> None:
    if not path.is_file():
        raise UserError(f"there is no file {path}" if not path.exists() else f"{path} is a folder; name a file")

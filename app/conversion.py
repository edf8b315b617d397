"""A file of any kind made one of another."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from app.deliver import deliver, exported_groom
from app.files import PROJECT, Say, curves_in, must_exist, rig_document
from core.document import Document, MeshObject
from core.errors import UserError
from core.evaluator import Evaluator
from core.formats import curve_file, mesh_file, project
from core.groom.grow import grow


def convert(source: Path, target: Path, unit: str | None, up: str | None, say: Say) -> dict[str, Any]:
    """Convert a file; returns counts of what was written."""
    must_exist(source)
    suffix = target.suffix.lower()
    if source.suffix.lower() in PROJECT:
        return _convert_document(project.read_project(source).document, target)
    curves = curves_in(source, unit, up)
    if curves is not None:
        for note in curves.notes:
            say(note)
        if suffix in PROJECT:
            raise UserError("a coat without its animal cannot become a project; groom the mesh, then comb to this coat")
        curve_file.write_groom(target, curves.groom)
        return {"guides": _count(curves.groom.guides), "hairs": _count(curves.groom.children)}
    if suffix in PROJECT and (rigged := rig_document(source, unit, up, say)) is not None:
        project.write_project(target, rigged)
        return {"vertices": len(rigged.meshes[0].mesh.points), "faces": len(rigged.meshes[0].mesh.counts)}
    mesh = mesh_file.read_mesh(source, unit=unit, up=up, say=say)
    if suffix in PROJECT:
        project.write_project(target, Document(meshes=(MeshObject(id=1, name=mesh.name, mesh=mesh.mesh),)))
    else:
        mesh_file.write_mesh(target, mesh.mesh)
    return {"vertices": len(mesh.mesh.points), "faces": len(mesh.mesh.counts)}


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


def _count(strands: Any) -> int:
    return 0 if strands is None else len(strands)

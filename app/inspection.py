"""What a file of any kind holds, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from app.files import PROJECT, curves_in, must_exist
from core.errors import UserError
from core.formats import curve_file, mesh_file, project, recovery, rig_file
from core.formats import journal as journal_file
from core.formats.curve_file import CurveFile
from core.formats.rig_assembly import NoRig, RigFile


def describe(path: Path) -> dict[str, Any]:
    """What a file holds, as plain JSON values: at least kind, parts, vertices, faces, problems, guides, hairs."""
    must_exist(path)
    if path.suffix.lower() in PROJECT:
        return project.project_info(path)
    curves = curves_in(path)
    if curves is not None:
        return {**curve_file.curve_info(path), **_rig_beside_hair(path)}
    return _describe_mesh(path)


def troubles(path: Path) -> list[str]:
    """Everything wrong with a file, one sentence each; empty when it is whole."""
    must_exist(path)
    suffix = path.suffix.lower()
    if suffix in PROJECT:
        return project.check_project(path)
    if suffix in journal_file.SUFFIXES:
        return recovery.check_journal(path)
    try:
        curves = curves_in(path)
        if curves is not None:
            return _curve_troubles(curves)
        found = _describe_mesh(path)
        rig = [str(found["rig_problem"])] if "rig_problem" in found else []
        return rig + [f"{kind.replace('_', ' ')}: {count}" for kind, count in found["problems"].items()]
    except UserError as error:
        return [str(error)]


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

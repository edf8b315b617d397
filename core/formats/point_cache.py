"""Baked points: a USD mesh whose points are samples, one for each frame, corrections and all."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from core.document import MeshObject
from core.errors import UserError
from core.formats.usd_mesh import write_usd
from core.pose.synthesis import evaluate_at, prepare


def write(path: Path, item: MeshObject) -> None:
    """Write the mesh, metres, Y up, with its points on every whole sample of the clip that plays.

    Raises
    ------
    UserError
        When no clip plays, or the file could not be written.
    """
    from pxr import Sdf, Usd, UsdGeom, Vt

    rig = item.rig
    if rig is None or rig.clip is None:
        raise UserError(f"{item.name} has no clip to bake; load motion first, or write the surface at a pose as OBJ.")
    write_usd(path, item.mesh)
    crate = {"format": "usdc"} if path.suffix.lower() == ".usd" else {}
    layer = Sdf.Layer.CreateAnonymous(path.suffix.lower(), args=crate)
    if not layer.Import(str(path)):
        raise UserError(f"{path.name} could not be written; choose another folder.")
    stage = Usd.Stage.Open(layer)
    stage.SetTimeCodesPerSecond(rig.clip.frames_per_second)
    stage.SetFramesPerSecond(rig.clip.frames_per_second)
    stage.SetStartTimeCode(rig.clip.start)
    stage.SetEndTimeCode(rig.clip.end)
    mesh = UsdGeom.Mesh(next(prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)))
    ready = prepare(item.correctives, rig)
    for sample in range(len(rig.clip.translations)):
        frame = rig.clip.start + sample
        points = evaluate_at(item.mesh.points, rig, ready, frame)
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points), frame)
        box = np.stack([points.min(axis=0), points.max(axis=0)])
        mesh.GetExtentAttr().Set(Vt.Vec3fArray.FromNumpy(box), frame)
    if not layer.Export(str(path), args=crate):
        raise UserError(f"{path.name} could not be written; choose another folder.")

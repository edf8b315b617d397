"""What readers and writers of USD share: a stage opened, a mesh defined. Runs in the child process of the sandbox, or
where we write ourselves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from core.errors import UserError
from core.mesh.mesh import Mesh


def open_stage(path: str) -> Any:
    """The stage of a file.

    Raises
    ------
    UserError
        It is no USD file, or a damaged one.
    """
    from pxr import Tf, Usd

    try:
        stage = Usd.Stage.Open(path)
    except Tf.ErrorException:
        stage = None
    if stage is None:
        raise UserError(f"{Path(path).name} is not a USD file that can be read; export it again.")
    return stage


def define_mesh(stage: Any, place: str, name: str, mesh: Mesh) -> Any:
    """Define a ``UsdGeom.Mesh`` at `place`: polygons as they are, points, extent and UVs per corner."""
    from pxr import Sdf, UsdGeom, Vt

    made = UsdGeom.Mesh.Define(stage, place)
    made.GetPrim().SetDisplayName(name)
    made.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    made.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(mesh.points))
    made.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(mesh.counts))
    made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.corners))
    if len(mesh.points):
        made.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([mesh.points.min(0), mesh.points.max(0)])))
    if mesh.uvs is not None:
        st = UsdGeom.PrimvarsAPI(made).CreatePrimvar(
            "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
        )
        st.Set(Vt.Vec2fArray.FromNumpy(mesh.uvs))
    return made

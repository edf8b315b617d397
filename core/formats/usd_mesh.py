"""Meshes of OpenUSD stages (.usda, .usdc, .usd, .usdz). The reader runs in a bounded child process."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.mesh_pieces import pack, unique_names
from core.formats.usd_stage import define_mesh, open_stage
from core.mesh.edges import reversed_corners
from core.mesh.mesh import Mesh
from core.mesh.polygons import Polygons

UV_NAMES = ("st", "UVMap", "uv", "map1", "st0")
PARTS = "parts"  # family of the subsets our own files keep parts in


def read_in_child(path: str) -> dict[str, Any]:
    """All meshes of the stage, in the units and axes of the stage, at its earliest time (see ``pack``).

    Instances are followed. Proxies, guides and invisible meshes are read only where there is nothing else.
    """
    from pxr import Usd, UsdGeom

    name = Path(path).name
    stage = open_stage(path)
    time = Usd.TimeCode.EarliestTime()
    transforms = UsdGeom.XformCache(time)
    shown: list[Polygons] = []
    hidden: list[Polygons] = []
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if not prim.IsA(UsdGeom.Mesh):
            continue
        piece = mesh_piece(prim, time, np.array(transforms.GetLocalToWorldTransform(prim)))
        if piece is None:
            continue
        image = UsdGeom.Imageable(prim)
        is_shown = (
            image.ComputePurpose() in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
            and image.ComputeVisibility(time) != UsdGeom.Tokens.invisible
        )
        (shown if is_shown else hidden).append(piece)
    if not shown and not hidden:
        raise UserError(f"{name} has no polygon meshes; export a mesh (what it refers to must lie beside it).")
    said = stage.HasAuthoredMetadata
    return pack(
        unique_names(shown or hidden),
        metres_per_unit=float(UsdGeom.GetStageMetersPerUnit(stage)) if said("metersPerUnit") else None,
        up=str(UsdGeom.GetStageUpAxis(stage)).lower() if said("upAxis") else None,
    )


def write_usd(path: Path, mesh: Mesh) -> None:
    """Write one Mesh prim, metres, Y up; parts as subsets of faces, UVs as the primvar ``st``."""
    from pxr import Kind, Sdf, Tf, Usd, UsdGeom, UsdUtils, Vt

    if path.suffix.lower() == ".usdz":
        with tempfile.TemporaryDirectory(prefix="filoplume-") as folder:
            layer = Path(folder) / "mesh.usdc"
            write_usd(layer, mesh)
            if not UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(layer)), str(path)):
                raise UserError(f"{path.name} could not be packed; write a .usdc instead.")
        return
    crate = {"format": "usdc"} if path.suffix.lower() == ".usd" else {}
    # anonymous names keep OpenUSD from handing back a layer of the same path it still remembers
    layer = Sdf.Layer.CreateAnonymous(path.suffix.lower(), args=crate)
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    root = UsdGeom.Xform.Define(stage, "/Model").GetPrim()
    Usd.ModelAPI(root).SetKind(Kind.Tokens.component)
    stage.SetDefaultPrim(root)
    name = mesh.part_names[0] if len(mesh.part_names) == 1 else "mesh"
    made = define_mesh(stage, f"/Model/{Tf.MakeValidIdentifier(name)}", name, mesh)
    if len(mesh.part_names) > 1:
        for part, name in enumerate(mesh.part_names):
            rows = Vt.IntArray.FromNumpy(np.flatnonzero(mesh.parts == part).astype(np.int32))
            subset = UsdGeom.Subset.CreateUniqueGeomSubset(
                made, Tf.MakeValidIdentifier(name), UsdGeom.Tokens.face, rows, PARTS
            )
            subset.GetPrim().SetDisplayName(name)
    if not layer.Export(str(path), args=crate):
        raise UserError(f"{path.name} could not be written; choose another folder.")


def mesh_piece(prim: Any, time: Any, world: NDArray[np.float64]) -> Polygons | None:
    from pxr import UsdGeom

    mesh = UsdGeom.Mesh(prim)
    points = _numbers(mesh.GetPointsAttr().Get(time), np.float64, 3)
    counts = _numbers(mesh.GetFaceVertexCountsAttr().Get(time), np.int64, 1)[:, 0]
    corners = _numbers(mesh.GetFaceVertexIndicesAttr().Get(time), np.int64, 1)[:, 0]
    if not len(points) or not len(counts) or counts.min() < 0 or counts.sum() != len(corners):
        return None
    uvs = _uvs(UsdGeom.PrimvarsAPI(prim), time, counts, corners, len(points))
    if not np.array_equal(world, np.eye(4)):
        points = points @ world[:3, :3] + world[3, :3]
    left_handed = mesh.GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded
    if left_handed != (np.linalg.det(world[:3, :3]) < 0):
        order = reversed_corners(counts)
        corners, uvs = corners[order], None if uvs is None else uvs[order]
    name = prim.GetDisplayName() or prim.GetName()
    parts, names = np.zeros(len(counts), np.int32), [name]
    for subset in UsdGeom.Subset.GetGeomSubsets(mesh, UsdGeom.Tokens.face, PARTS):
        rows = _numbers(subset.GetIndicesAttr().Get(time), np.int64, 1)[:, 0]
        rows = rows[(rows >= 0) & (rows < len(counts))]
        parts[rows] = len(names)
        names.append(subset.GetPrim().GetDisplayName() or subset.GetPrim().GetName())
    if len(names) > 1 and (parts > 0).all():
        parts, names = parts - np.int32(1), names[1:]
    return Polygons(points, counts, corners, uvs, parts, tuple(names))


def _uvs(
    primvars: Any, time: Any, counts: NDArray[np.int64], corners: NDArray[np.int64], vertices: int
) -> NDArray[np.float32] | None:
    """UVs of corners from the best texture primvar, indexed or not, of any interpolation."""
    for name in UV_NAMES + tuple(
        p.GetPrimvarName() for p in primvars.GetPrimvarsWithValues() if "texCoord" in str(p.GetTypeName())
    ):
        primvar = primvars.GetPrimvar(name)
        if not primvar or not primvar.HasValue():
            continue
        values = np.array(primvar.ComputeFlattened(time))
        if values.ndim != 2 or values.shape[1] < 2 or values.dtype.kind != "f" or not len(values):
            continue
        values = values[:, :2].astype(np.float32)
        kind = str(primvar.GetInterpolation())
        if kind == "faceVarying" and len(values) == len(corners):
            return values
        if kind in ("vertex", "varying") and len(values) == vertices:
            return values[np.clip(corners, 0, vertices - 1)]
        if kind == "uniform" and len(values) == len(counts):
            return np.repeat(values, counts, axis=0)
        if kind == "constant":
            return np.tile(values[:1], (len(corners), 1))
    return None


def _numbers(values: Any, dtype: Any, width: int) -> NDArray[Any]:
    if values is None:
        return np.zeros((0, width), dtype)
    return np.array(values, dtype).reshape(-1, width)

"""One feather as OpenUSD: its quill and vanes as NURBS patches, its barbs and down as curves, or its triangles.

What is written, under the default prim ``/Feather`` (metres, Y up, extents authored)::

    /Feather/Quill, /Feather/Vane_1 ...   NurbsPatch (level "nurbs")
    /Feather/Barbs, /Feather/Down         BasisCurves, linear, with widths and colours (level "nurbs")
    /Feather/Surface                      or Mesh, with colours of its vertices and `st` (the other levels)
    /Feather/Looks/feather                a UsdPreviewSurface that takes those colours
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.feather.attributes import column
from core.feather.barbs import condense, expand
from core.feather.down import down_hairs
from core.feather.levels import Level, feather_mesh, vane_patches
from core.feather.nurbs import Nurbs
from core.feather.pattern import vane_colors
from core.feather.shaft import quill
from core.feather.surface import LENGTH

NURBS = "nurbs"
SUFFIXES = (".usda", ".usdc", ".usd")


def write_feather(path: Path, values: NDArray[np.float32], seed: int, level: Level | None, maker: str) -> None:
    """Write one feather to a .usda, .usdc or .usd: as NURBS and curves when `level` is None, else as triangles."""
    from pxr import Sdf, Usd, UsdGeom

    layer = Sdf.Layer.CreateNew(str(path))
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    root = UsdGeom.Xform.Define(stage, "/Feather")
    stage.SetDefaultPrim(root.GetPrim())
    layer.comment = maker
    prims = _patches_and_curves(stage, values, seed) if level is None else [_surface(stage, values, seed, level)]
    _look(stage, prims, values)
    layer.Save()


def _patches_and_curves(stage: Any, values: NDArray[np.float32], seed: int) -> list[Any]:
    prims = [nurbs_patch(stage, "/Feather/Quill", quill(values))]
    for number, patch in enumerate(vane_patches(values, seed), 1):
        prims.append(nurbs_patch(stage, f"/Feather/Vane_{number}", patch))
    _color(prims, [_plain(values, "shaftColorRootRed")] + [_plain(values, "colorMiddleRed")] * (len(prims) - 1))
    barbs = expand(values, condense(values[None], np.array([seed])), 0)
    colors = vane_colors(values, np.repeat(barbs.sides, barbs.points.shape[1]), barbs.places.reshape(-1, 2), seed)
    hairs = down_hairs(values, seed)
    down = np.tile(_plain(values, "colorDownRed"), (hairs.points.shape[0] * hairs.points.shape[1], 1))
    for name, curves, sides, radius, taper, tint in (
        ("Barbs", barbs.points, barbs.sides, "barbRadius*", "barbTaper*", colors),
        ("Down", hairs.points, hairs.sides, "downHairRadiusVane*", "downHairTaperVane*", down),
    ):
        if len(curves):
            along = np.linspace(0.0, 1.0, curves.shape[1])
            thin = 1.0 - values[column(taper) + sides][:, None] * along
            widths = 2.0 * values[LENGTH] * values[column(radius) + sides][:, None] * thin
            prims.append(_curves(stage, f"/Feather/{name}", curves, widths, tint))
    return prims


def nurbs_patch(stage: Any, where: str, patch: Nurbs) -> Any:
    """Define a patch on a stage of OpenUSD; the prim."""
    from pxr import Gf, UsdGeom, Vt

    prim = UsdGeom.NurbsPatch.Define(stage, where)
    # the first axis of a patch is v, its second one u: points go row by row, u fastest
    prim.CreateUVertexCountAttr(patch.points.shape[1])
    prim.CreateVVertexCountAttr(patch.points.shape[0])
    prim.CreateUOrderAttr(patch.orders[1])
    prim.CreateVOrderAttr(patch.orders[0])
    prim.CreateUKnotsAttr(Vt.DoubleArray.FromNumpy(patch.knots[1]))
    prim.CreateVKnotsAttr(Vt.DoubleArray.FromNumpy(patch.knots[0]))
    prim.CreateURangeAttr(Gf.Vec2d(0.0, 1.0))
    prim.CreateVRangeAttr(Gf.Vec2d(0.0, 1.0))
    prim.CreatePointWeightsAttr(Vt.DoubleArray.FromNumpy(np.ascontiguousarray(patch.weights.reshape(-1))))
    _points(prim, patch.points)
    return prim


def _curves(stage: Any, where: str, curves: Any, widths: Any, colors: Any) -> Any:
    from pxr import UsdGeom, Vt

    prim = UsdGeom.BasisCurves.Define(stage, where)
    prim.CreateTypeAttr(UsdGeom.Tokens.linear)
    prim.CreateCurveVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(curves), curves.shape[1], np.int32)))
    prim.CreateWidthsAttr(Vt.FloatArray.FromNumpy(np.ascontiguousarray(widths.reshape(-1), np.float32)))
    prim.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
    _points(prim, curves)
    _color([prim], [np.asarray(colors, np.float32)])
    return prim


def _surface(stage: Any, values: NDArray[np.float32], seed: int, level: Level) -> Any:
    from pxr import Sdf, UsdGeom, Vt

    mesh = feather_mesh(values, seed, level)
    prim = UsdGeom.Mesh.Define(stage, "/Feather/Surface")
    prim.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(mesh.triangles), 3, np.int32)))
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.triangles.reshape(-1))))
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreateDoubleSidedAttr(True)
    prim.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(mesh.normals))
    prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    _points(prim, mesh.points)
    _color([prim], [mesh.colors])
    space = UsdGeom.PrimvarsAPI(prim)
    space.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex).Set(
        Vt.Vec2fArray.FromNumpy(mesh.flat)
    )
    prim.CreateDisplayOpacityPrimvar(UsdGeom.Tokens.vertex).Set(Vt.FloatArray.FromNumpy(mesh.opacity))
    return prim


def _points(prim: Any, points: Any) -> None:
    from pxr import Vt

    flat = np.ascontiguousarray(np.asarray(points).reshape(-1, 3), np.float32)
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(flat))
    prim.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([flat.min(axis=0), flat.max(axis=0)])))


def _plain(values: NDArray[np.float32], red: str) -> NDArray[np.float32]:
    first = column(red)
    return np.ascontiguousarray(values[None, first : first + 3], np.float32)


def _color(prims: list[Any], colors: list[NDArray[np.float32]]) -> None:
    from pxr import UsdGeom, Vt

    for prim, color in zip(prims, colors, strict=True):
        kind = UsdGeom.Tokens.constant if len(color) == 1 else UsdGeom.Tokens.vertex
        prim.CreateDisplayColorPrimvar(kind).Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(color, np.float32)))


def _look(stage: Any, prims: list[Any], values: NDArray[np.float32]) -> None:
    from pxr import Sdf, UsdShade

    material = UsdShade.Material.Define(stage, "/Feather/Looks/feather")
    reader = UsdShade.Shader.Define(stage, "/Feather/Looks/feather/color")
    reader.CreateIdAttr("UsdPrimvarReader_float3")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("displayColor")
    result = reader.CreateOutput("result", Sdf.ValueTypeNames.Float3)
    surface = UsdShade.Shader.Define(stage, "/Feather/Looks/feather/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(result)
    roughness = float(np.clip(values[column("vaneRoughness*")], 0.0, 1.0))
    surface.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(roughness)
    material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    for prim in prims:
        UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(material)

"""Feathers as curves of OpenUSD: shafts, shafts with barbs, or Houdini's condensed form; a few hundred to a prim.

Primvars, uniform (one per curve): ``feather_id``; ``barb`` (number on its side from the base, -1 for a shaft); ``side``
(-1 left, 0 shaft, 1 right); columns of the coat (``age``, ``tract`` ...). One per point: ``displayColor``, ``st``.
Of the condensed form one per point of a shaft, with an elementSize of its barbs' points: ``P_barbl``, ``P_barbr``,
``width_barbl``, ``uv_barbl``, ``Cd_barbl`` and their right ones; ``barborient``; per curve ``id`` too.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.feather.coat.condensed import CondensedFeathers
from core.feather.coat.curves import FeatherCurves

Columns = dict[str, NDArray[np.float32]]
PAIRS = ("barbl", "barbr")


def write_curves(
    stage: Any, path: str, known: Any, found: FeatherCurves | CondensedFeathers, columns: Columns, material: Any,
    time: Any,
) -> Any:
    """Write some feathers into the prim at `path`, at a time; the prim, `known` where it is there already.

    columns : (N,) float32 by name, for every row of the laid coat.
    """
    from pxr import Sdf, UsdGeom, UsdShade, Vt

    types, uniform, vertex = Sdf.ValueTypeNames, UsdGeom.Tokens.uniform, UsdGeom.Tokens.vertex
    prim = known
    if prim is None:
        prim = UsdGeom.BasisCurves.Define(stage, path)
        prim.CreateTypeAttr(UsdGeom.Tokens.linear)
        prim.CreateWrapAttr(UsdGeom.Tokens.nonperiodic)
        prim.CreateWidthsAttr()
        prim.SetWidthsInterpolation(vertex)
        UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(material)
    api = UsdGeom.PrimvarsAPI(prim)
    prim.CreateCurveVertexCountsAttr().Set(Vt.IntArray.FromNumpy(found.counts), time)
    prim.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(found.points), time)
    prim.GetWidthsAttr().Set(Vt.FloatArray.FromNumpy(found.widths), time)
    prim.CreateExtentAttr().Set(_extent(found), time)
    prim.CreateDisplayColorPrimvar(vertex).Set(Vt.Vec3fArray.FromNumpy(found.colors), time)
    api.CreatePrimvar("st", types.TexCoord2fArray, vertex).Set(Vt.Vec2fArray.FromNumpy(found.st), time)
    numbers = {"feather_id": found.feathers}
    if isinstance(found, FeatherCurves):
        numbers |= {"barb": found.barbs, "side": found.sides}
    else:
        numbers["id"] = found.feathers
        _write_condensed(api, found, time)
    for name, whole in numbers.items():
        api.CreatePrimvar(name, types.IntArray, uniform).Set(Vt.IntArray.FromNumpy(np.ascontiguousarray(whole)), time)
    for name, column in columns.items():
        made = api.CreatePrimvar(name, types.FloatArray, uniform)
        made.Set(Vt.FloatArray.FromNumpy(np.ascontiguousarray(column[found.rows], np.float32)), time)
    return prim


def clear_curves(prim: Any, time: Any) -> None:
    """Let a prim of an earlier frame hold no curves at this one."""
    from pxr import Vt

    prim.GetCurveVertexCountsAttr().Set(Vt.IntArray(), time)
    prim.GetPointsAttr().Set(Vt.Vec3fArray(), time)
    prim.GetWidthsAttr().Set(Vt.FloatArray(), time)


def _write_condensed(api: Any, found: CondensedFeathers, time: Any) -> None:
    from pxr import Sdf, UsdGeom, Vt

    types, vertex = Sdf.ValueTypeNames, UsdGeom.Tokens.vertex
    turns = np.ascontiguousarray(found.orients[:, [1, 2, 3, 0]])  # OpenUSD keeps the real part last in memory
    api.CreatePrimvar("barborient", types.QuatfArray, vertex).Set(Vt.QuatfArray.FromNumpy(turns), time)
    for name, both in (
        ("P", found.barbs), ("width", found.barb_widths), ("uv", found.barb_st), ("Cd", found.barb_colors),
    ):
        for side, values in zip(PAIRS, both, strict=True):
            flat = np.ascontiguousarray(values.reshape(-1))
            made = api.CreatePrimvar(f"{name}_{side}", types.FloatArray, vertex, int(np.prod(values.shape[1:])))
            made.Set(Vt.FloatArray.FromNumpy(flat), time)


def _extent(found: FeatherCurves | CondensedFeathers) -> Any:
    from pxr import Vt

    beyond = float(found.widths.max(initial=0.0)) / 2.0
    if isinstance(found, CondensedFeathers):  # what its barbs reach to, once they are expanded
        beyond += max(float(np.linalg.norm(side, axis=-1).max(initial=0.0)) for side in found.barbs)
    ends = np.stack([found.points.min(axis=0) - beyond, found.points.max(axis=0) + beyond])
    return Vt.Vec3fArray.FromNumpy(ends.astype(np.float32))

"""Laid feathers as NURBS of OpenUSD: a patch through each vane, cubic curves through all shafts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from core.feather.nurbs import through
from core.formats.usd_feather import nurbs_patch

ORDER = 4


class NurbsFeathers:
    """Writes the frames of feathers as NURBS under one place of a stage.

    Parameters
    ----------
    place : path of an Xform made for them; each vane is ``feather_<id>`` in it, all shafts are ``shafts``.
    materials : of the kinds of feathers. radii : (K, R) float32, of the points of shafts by kind, in shaft lengths.
    """

    def __init__(self, stage: Any, place: str, materials: list[Any], radii: NDArray[np.float32]) -> None:
        from pxr import UsdGeom

        self._stage, self._place, self._materials, self._radii = stage, place, materials, radii
        self._patches: dict[int, Any] = {}
        self._shafts: Any = None
        UsdGeom.Xform.Define(stage, place)

    def write(
        self, ids: NDArray[np.int32], kinds: NDArray[np.int32], vanes: NDArray[np.float32],
        colors: NDArray[np.float32], attributes: Mapping[str, NDArray[np.float32]], time: Any,
    ) -> None:
        """Add a frame: ids, kinds (N,), vanes (N, R, C, 3), colors (N, 3) float32, attributes (N,) by name."""
        from pxr import Sdf, UsdGeom, UsdShade, Vt

        for row, feather in enumerate(ids.tolist()):
            patch = through(vanes[row])
            prim = self._patches.get(feather)
            if prim is None:
                prim = self._patches[feather] = nurbs_patch(self._stage, f"{self._place}/feather_{feather}", patch)
                prim.GetPointsAttr().Clear()
                UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(self._materials[int(kinds[row])])
                api, constant = UsdGeom.PrimvarsAPI(prim), UsdGeom.Tokens.constant
                api.CreatePrimvar("feather_id", Sdf.ValueTypeNames.Int, constant).Set(feather)
                prim.CreateDisplayColorPrimvar(constant).Set(Vt.Vec3fArray.FromNumpy(colors[row : row + 1].copy()))
                for name, column in attributes.items():
                    api.CreatePrimvar(name, Sdf.ValueTypeNames.Float, constant).Set(float(column[row]))
            _place_points(prim, patch.points.reshape(-1, 3), 0.0, time)
        for feather, prim in self._patches.items():
            there = UsdGeom.Tokens.inherited if feather in ids else UsdGeom.Tokens.invisible
            prim.CreateVisibilityAttr().Set(there, time)
        self._write_shafts(ids, kinds, vanes, colors, time)

    def _write_shafts(
        self, ids: NDArray[np.int32], kinds: NDArray[np.int32], vanes: NDArray[np.float32],
        colors: NDArray[np.float32], time: Any,
    ) -> None:
        from pxr import Sdf, UsdGeom, UsdShade, Vt

        shafts = vanes[:, :, vanes.shape[2] // 2].astype(np.float64)
        count, many = shafts.shape[:2]
        spline = make_interp_spline(np.linspace(0.0, 1.0, many), np.moveaxis(shafts, 1, 0), ORDER - 1)
        controls = np.moveaxis(spline.c, 0, 1).reshape(-1, 3)
        lengths = np.linalg.norm(np.diff(shafts, axis=1), axis=2).sum(axis=1)
        widths = (2.0 * lengths[:, None] * self._radii[kinds]).astype(np.float32).reshape(-1)
        prim = self._shafts
        if prim is None:
            prim = self._shafts = UsdGeom.NurbsCurves.Define(self._stage, f"{self._place}/shafts")
            prim.CreateWidthsAttr()
            prim.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
            UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(self._materials[0])
        prim.CreateCurveVertexCountsAttr().Set(Vt.IntArray.FromNumpy(np.full(count, many, np.int32)), time)
        prim.CreateOrderAttr().Set(Vt.IntArray.FromNumpy(np.full(count, ORDER, np.int32)), time)
        prim.CreateKnotsAttr().Set(Vt.DoubleArray.FromNumpy(np.tile(spline.t, count)), time)
        prim.CreateRangesAttr().Set(Vt.Vec2dArray.FromNumpy(np.tile([0.0, 1.0], (count, 1))), time)
        prim.GetWidthsAttr().Set(Vt.FloatArray.FromNumpy(widths), time)
        prim.CreateDisplayColorPrimvar(UsdGeom.Tokens.uniform).Set(Vt.Vec3fArray.FromNumpy(colors.copy()), time)
        made = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(
            "feather_id", Sdf.ValueTypeNames.IntArray, UsdGeom.Tokens.uniform)
        made.Set(Vt.IntArray.FromNumpy(np.ascontiguousarray(ids)), time)
        _place_points(prim, controls, float(widths.max(initial=0.0)) / 2.0, time)


def _place_points(prim: Any, points: NDArray[np.float64], beyond: float, time: Any) -> None:
    from pxr import Vt

    flat = np.ascontiguousarray(points, np.float32)
    prim.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(flat), time)
    if len(flat):
        ends = np.stack([flat.min(axis=0) - beyond, flat.max(axis=0) + beyond]).astype(np.float32)
        prim.CreateExtentAttr().Set(Vt.Vec3fArray.FromNumpy(ends), time)

"""Coats of feathers as OpenUSD: rigid instances of shapes, a mesh of every feather, or the curve of every shaft.

What is written, under the default prim ``/Feathers`` (metres, Y up, extents authored)::

    /Feathers/<name>               PointInstancer: positions, orientations, scales, protoIndices, ids
    /Feathers/<name>/Prototypes    one Mesh for every quantised shape, feathers of length 1
    /Feathers/<name>               or Mesh: all feathers, with the primvar feather_id per face
    /Feathers/<name>               or BasisCurves: their shafts, with widths and the primvar feather_id per curve
    /Feathers/<name>_wings         Mesh or BasisCurves: the feathers of wings and tail, each as it is, with feather_id
    /Feathers/mesh                 the animal, moving where it moves
    /Feathers/Looks/feather        UsdPreviewSurface and MaterialX, bound to both

``ids`` are those of the document: the same feather has the same id in every frame and version. ``orientationsf`` holds
the turns in 32 bits and wins where it is known; ``orientations`` the same in 16 for older readers.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.feather.coat.export import Instances
from core.feather.look import FeatherLook
from core.formats.feather_look import usd_material
from core.mesh.mesh import Mesh

SUFFIXES = (".usd", ".usda", ".usdc")


class FeatherFrame(NamedTuple):
    """One frame of a coat: instances, or vanes (N, R, C, 3) float32 with ids (N,) when every feather is a mesh.

    points : (V, 3) float32, the animal. attributes : primvars of the feathers, (N,) float32 by name.
    wing_ids, wing_vanes : (M,) int32, (M, R, C, 3) float32, feathers of wings, or None.
    """

    frame: float
    points: NDArray[np.float32]
    instances: Instances | None
    ids: NDArray[np.int32]
    vanes: NDArray[np.float32] | None
    attributes: dict[str, NDArray[np.float32]]
    wing_ids: NDArray[np.int32] | None = None
    wing_vanes: NDArray[np.float32] | None = None


class FeatherWriter:
    """Writes frames one after another, so that memory does not grow with their number.

    Parameters
    ----------
    path : .usda, .usdc or .usd. name : of the coat. mesh : the animal at rest. maker : name and version of the program.
    look : of its feathers from afar. animated : values become time samples of their frames.
    shafts : radius of a shaft at its root and tip, in shaft lengths: feathers with vanes are written as curves.
    """

    def __init__(
        self, path: Path, name: str, mesh: Mesh, maker: str, look: FeatherLook, animated: bool,
        fps: float = 24.0, shafts: tuple[float, float] | None = None,
    ) -> None:
        from pxr import Sdf, Usd, UsdGeom

        if path.suffix.lower() not in SUFFIXES:
            raise UserError(f"{path.name}: feathers are written as {', '.join(SUFFIXES)}; choose one of these.")
        made = {"format": "usdc"} if path.suffix.lower() == ".usd" else {}
        self._layer = Sdf.Layer.CreateNew(str(path), args=made)
        self._stage = stage = Usd.Stage.Open(self._layer)
        self._animated = animated
        self._shafts = shafts
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
        root = UsdGeom.Xform.Define(stage, "/Feathers").GetPrim()
        stage.SetDefaultPrim(root)
        root.SetCustomDataByKey("filoplume", {"version": maker, "name": name})
        self._place = f"/Feathers/{_identifier(name)}"
        self._known: dict[tuple[int, ...], int] = {}
        self._material = usd_material(stage, "/Feathers/Looks/feather", look)
        self._mesh = _animal(stage, mesh)
        self._coat: Any = None
        self._wings: Any = None
        if animated:
            stage.SetTimeCodesPerSecond(fps)
            stage.SetFramesPerSecond(fps)

    def write(self, frame: FeatherFrame) -> None:
        """Add one frame (the only one, when the coat stands still)."""
        from pxr import Usd, Vt

        time = Usd.TimeCode(frame.frame) if self._animated else Usd.TimeCode.Default()
        self._mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(frame.points, np.float32)), time)
        self._mesh.CreateExtentAttr().Set(_extent(frame.points), time)
        if frame.instances is not None:
            self._write_instances(frame, frame.instances, time)
        elif frame.vanes is not None:
            self._coat = self._write_each(self._coat, self._place, frame.ids, frame.vanes, frame.attributes, time)
        if frame.wing_ids is not None and frame.wing_vanes is not None:
            self._wings = self._write_each(
                self._wings, f"{self._place}_wings", frame.wing_ids, frame.wing_vanes, {}, time)

    def close(self, first: float | None = None, last: float | None = None) -> None:
        """Save what was written."""
        if first is not None and last is not None:
            self._stage.SetStartTimeCode(first)
            self._stage.SetEndTimeCode(last)
        self._layer.Save()
        self._stage = self._mesh = self._coat = self._wings = self._layer = None

    def _write_instances(self, frame: FeatherFrame, found: Instances, time: Any) -> None:
        from pxr import UsdGeom, UsdShade, Vt

        stage = self._stage
        if self._coat is None:
            self._coat = UsdGeom.PointInstancer.Define(stage, self._place)
            UsdGeom.Scope.Define(stage, f"{self._place}/Prototypes")
        coat = self._coat
        for key, vane in found.prototypes.items():
            if key in self._known:
                continue
            number = self._known[key] = len(self._known)
            mesh = UsdGeom.Mesh.Define(stage, f"{self._place}/Prototypes/shape_{number}")
            _write_vanes(mesh, vane[None], None)
            UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(self._material)
            coat.CreatePrototypesRel().AddTarget(mesh.GetPath())
        rows = np.array([self._known[tuple(key)] for key in found.keys.tolist()], np.int32)
        turns = np.ascontiguousarray(found.turns[:, [1, 2, 3, 0]])  # OpenUSD keeps the real part last in memory
        coat.CreateProtoIndicesAttr().Set(Vt.IntArray.FromNumpy(rows), time)
        coat.CreatePositionsAttr().Set(Vt.Vec3fArray.FromNumpy(found.positions), time)
        coat.CreateOrientationsfAttr().Set(Vt.QuatfArray.FromNumpy(turns), time)
        coat.CreateOrientationsAttr().Set(Vt.QuathArray.FromNumpy(turns.astype(np.float16)), time)
        scales = np.repeat(found.scales[:, None], 3, axis=1).astype(np.float32)
        coat.CreateScalesAttr().Set(Vt.Vec3fArray.FromNumpy(scales), time)
        coat.CreateIdsAttr().Set(Vt.Int64Array.FromNumpy(found.ids.astype(np.int64)), time)
        coat.CreateExtentAttr().Set(_extent(found.vanes.reshape(-1, 3)), time)
        self._write_attributes(coat, frame.attributes, UsdGeom.Tokens.vertex, 1, time)
        coat.GetPrim().SetCustomDataByKey("filoplume:quantising_error", found.error)

    def _write_each(
        self, prim: Any, place: str, ids: NDArray[np.int32], vanes: NDArray[np.float32],
        attributes: dict[str, NDArray[np.float32]], time: Any,
    ) -> Any:
        """Feathers as their own shapes, or as the curves of their shafts; the prim they are in."""
        if self._shafts is not None:
            return self._write_shafts(prim, place, ids, vanes, self._shafts, attributes, time)
        from pxr import UsdGeom, UsdShade

        if prim is None:
            prim = UsdGeom.Mesh.Define(self._stage, place)
            UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(self._material)
        _write_vanes(prim, vanes, time)
        self._write_of_each(prim, ids, attributes, 2 * (vanes.shape[1] - 1) * (vanes.shape[2] - 1), time)
        return prim

    def _write_shafts(
        self, prim: Any, place: str, ids: NDArray[np.int32], vanes: NDArray[np.float32], radii: tuple[float, float],
        attributes: dict[str, NDArray[np.float32]], time: Any,
    ) -> Any:
        from pxr import UsdGeom, UsdShade, Vt

        shafts = np.ascontiguousarray(vanes[:, :, vanes.shape[2] // 2])  # the middle column of a vane
        if prim is None:
            prim = UsdGeom.BasisCurves.Define(self._stage, place)
            prim.CreateTypeAttr(UsdGeom.Tokens.linear)
            prim.CreateWidthsAttr()
            prim.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
            UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(self._material)
        count, rows = shafts.shape[:2]
        lengths = np.linalg.norm(np.diff(shafts, axis=1), axis=2).sum(axis=1)
        widths = 2.0 * lengths[:, None] * np.linspace(*radii, rows)
        points = shafts.reshape(-1, 3)
        prim.CreateCurveVertexCountsAttr().Set(Vt.IntArray.FromNumpy(np.full(count, rows, np.int32)), time)
        prim.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(points), time)
        prim.GetWidthsAttr().Set(Vt.FloatArray.FromNumpy(widths.reshape(-1).astype(np.float32)), time)
        prim.CreateExtentAttr().Set(_extent(points, float(widths.max(initial=0.0)) / 2.0), time)
        self._write_of_each(prim, ids, attributes, 1, time)
        return prim

    def _write_of_each(
        self, prim: Any, ids: NDArray[np.int32], attributes: dict[str, NDArray[np.float32]], times: int, time: Any
    ) -> None:
        """Ids and attributes of feathers that are `times` faces or curves each."""
        from pxr import Sdf, UsdGeom, Vt

        api = UsdGeom.PrimvarsAPI(prim)
        made = api.CreatePrimvar("feather_id", Sdf.ValueTypeNames.IntArray, UsdGeom.Tokens.uniform)
        made.Set(Vt.IntArray.FromNumpy(np.repeat(ids, times)), time)
        self._write_attributes(prim, attributes, UsdGeom.Tokens.uniform, times, time)

    def _write_attributes(
        self, prim: Any, attributes: dict[str, NDArray[np.float32]], each: Any, times: int, time: Any
    ) -> None:
        from pxr import Sdf, UsdGeom, Vt

        api = UsdGeom.PrimvarsAPI(prim)
        for name, column in attributes.items():
            made = api.CreatePrimvar(_identifier(name), Sdf.ValueTypeNames.FloatArray, each)
            made.Set(Vt.FloatArray.FromNumpy(np.repeat(column.astype(np.float32), times)), time)


def vane_mesh(vanes: NDArray[np.float32]) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float32]]:
    """Triangles of N vanes (N, R, C, 3): counts (T,), vertices (3 T,) and texture places (V, 2), as tests cut them."""
    n, rows, columns = vanes.shape[:3]
    at = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    one = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2).reshape(-1)
    corners = (np.arange(n, dtype=np.int32)[:, None] * np.int32(rows * columns) + one).reshape(-1)
    st = np.stack(np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows)), axis=-1).reshape(-1, 2)
    return np.full(len(corners) // 3, 3, np.int32), corners, np.tile(st, (n, 1)).astype(np.float32)


def _write_vanes(mesh: Any, vanes: NDArray[np.float32], time: Any) -> None:
    from pxr import Sdf, Usd, UsdGeom, Vt

    at = Usd.TimeCode.Default() if time is None else time
    counts, corners, st = vane_mesh(vanes)
    points = np.ascontiguousarray(vanes.reshape(-1, 3))
    mesh.CreateSubdivisionSchemeAttr().Set(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr().Set(True)
    mesh.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(points), at)
    mesh.CreateFaceVertexCountsAttr().Set(Vt.IntArray.FromNumpy(counts), at)
    mesh.CreateFaceVertexIndicesAttr().Set(Vt.IntArray.FromNumpy(corners), at)
    mesh.CreateExtentAttr().Set(_extent(points), at)
    api = UsdGeom.PrimvarsAPI(mesh)
    made = api.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex)
    made.Set(Vt.Vec2fArray.FromNumpy(st), at)


def _extent(points: NDArray[np.float32], beyond: float = 0.0) -> Any:
    from pxr import Vt

    if not len(points):
        return Vt.Vec3fArray.FromNumpy(np.zeros((2, 3), np.float32))
    ends = np.stack([points.min(axis=0) - beyond, points.max(axis=0) + beyond])
    return Vt.Vec3fArray.FromNumpy(ends.astype(np.float32))


def _animal(stage: Any, mesh: Mesh) -> Any:
    from pxr import Sdf, UsdGeom, Vt

    made = UsdGeom.Mesh.Define(stage, "/Feathers/mesh")
    made.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    made.CreatePointsAttr()
    made.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(mesh.counts))
    made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.corners))
    if mesh.uvs is not None:
        api = UsdGeom.PrimvarsAPI(made)
        st = api.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying)
        st.Set(Vt.Vec2fArray.FromNumpy(mesh.uvs))
    return made


def _identifier(name: str) -> str:
    from pxr import Tf

    made = Tf.MakeValidIdentifier(name) if name else "feathers"
    return "feathers_" if made in ("mesh", "Looks") else str(made)  # these places are taken

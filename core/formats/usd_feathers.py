"""Coats of feathers as OpenUSD: rigid instances of shapes, a mesh of every feather, or curves.

What is written, under the default prim ``/Feathers`` (metres, Y up, extents authored)::

    /Feathers/<name>               PointInstancer: positions, orientations, scales, protoIndices, ids
    /Feathers/<name>/Prototypes    one Mesh for every quantised shape of every type, feathers of length 1
    /Feathers/<name>               or Mesh: all feathers, with feather_id per face and a GeomSubset of each type
    /Feathers/<name>/feather_<id>  or NurbsPatch, each a vane, and NurbsCurves, all shafts (``usd_feather_nurbs``)
    /Feathers/<name>/<type>_<k>    or BasisCurves (``usd_feather_curves``): shafts, with barbs, or condensed
    /Feathers/<name>_wings         Mesh: the feathers of wings and tail, each as it is, with feather_id
    /Feathers/mesh                 the animal, moving where it moves
    /Feathers/Looks/<type>         UsdPreviewSurface and MaterialX; they read displayColor

``ids`` are those of the document: the same feather has the same id in every frame and version. ``orientationsf`` holds
the turns in 32 bits and wins where it is known; ``orientations`` the same in 16 for older readers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.feather.coat.condensed import CondensedFeathers
from core.feather.coat.curves import FeatherCurves
from core.feather.coat.export import Instances
from core.feather.look import FeatherLook
from core.formats.feather_look import usd_material
from core.formats.usd_feather_curves import clear_curves, write_curves
from core.formats.usd_feather_nurbs import NurbsFeathers
from core.mesh.mesh import Mesh

SUFFIXES = (".usd", ".usda", ".usdc")


class FeatherFrame(NamedTuple):
    """One frame of a coat: instances, or vanes (N, R, C, 3) float32 with ids (N,), a mesh of every feather, or curves.

    points : (V, 3) float32, the animal. attributes : primvars of the feathers, (N,) float32 by name.
    wing_ids, wing_vanes : (M,) int32, (M, R, C, 3) float32, feathers of wings, or None; wing_attributes : theirs.
    radii : (K, R) float32, of shafts by kind, in shaft lengths: vanes, also those of wings, become NURBS; or None.
    kinds, wing_kinds : (N,), (M,) int32, which of the writer's looks each feather has; None for the first one.
    curves : makes the feathers, also those of wings, some at a time; `attributes` then has a number for every row of
        the laid coat.
    """

    frame: float
    points: NDArray[np.float32]
    instances: Instances | None
    ids: NDArray[np.int32]
    vanes: NDArray[np.float32] | None
    attributes: dict[str, NDArray[np.float32]]
    wing_ids: NDArray[np.int32] | None = None
    wing_vanes: NDArray[np.float32] | None = None
    wing_attributes: Mapping[str, NDArray[np.float32]] = MappingProxyType({})
    kinds: NDArray[np.int32] | None = None
    wing_kinds: NDArray[np.int32] | None = None
    curves: Callable[[], Iterator[FeatherCurves | CondensedFeathers]] | None = None
    radii: NDArray[np.float32] | None = None


class FeatherWriter:
    """Writes frames one after another, so that memory does not grow with their number.

    Parameters
    ----------
    path : .usda, .usdc or .usd. name : of the coat. mesh : the animal at rest. maker : name and version of the program.
    looks : of its feathers from afar, by the type they are. animated : values become time samples of their frames.
    """

    def __init__(
        self, path: Path, name: str, mesh: Mesh, maker: str, looks: Mapping[str, FeatherLook], animated: bool,
        fps: float = 24.0,
    ) -> None:
        from pxr import Sdf, Usd, UsdGeom

        if path.suffix.lower() not in SUFFIXES:
            raise UserError(f"{path.name}: feathers are written as {', '.join(SUFFIXES)}; choose one of these.")
        made = {"format": "usdc"} if path.suffix.lower() == ".usd" else {}
        self._layer = Sdf.Layer.CreateNew(str(path), args=made)
        self._stage = stage = Usd.Stage.Open(self._layer)
        self._animated = animated
        self._crate = self._layer.GetFileFormat().formatId == "usdc"
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
        root = UsdGeom.Xform.Define(stage, "/Feathers").GetPrim()
        stage.SetDefaultPrim(root)
        root.SetCustomDataByKey("filoplume", {"version": maker, "name": name})
        self._place = f"/Feathers/{_identifier(name)}"
        self._known: dict[tuple[int, ...], int] = {}
        self._kinds = list(looks)
        self._looks = list(looks.values())
        self._materials = [usd_material(stage, f"/Feathers/Looks/{_named(kind)}", looks[kind]) for kind in looks]
        self._curves: dict[str, Any] = {}
        self._nurbs: NurbsFeathers | None = None
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
        if frame.curves is not None:
            self._write_curves(frame.curves(), frame.attributes, time)
            return
        if frame.radii is not None and frame.vanes is not None:
            self._write_nurbs(frame, frame.vanes, frame.radii, time)
            return
        if frame.instances is not None:
            self._write_instances(frame, frame.instances, time)
        elif frame.vanes is not None:
            self._coat = self._write_each(
                self._coat, self._place, frame.ids, frame.vanes, frame.kinds, frame.attributes, time)
        if frame.wing_ids is not None and frame.wing_vanes is not None:
            self._wings = self._write_each(
                self._wings, f"{self._place}_wings", frame.wing_ids, frame.wing_vanes, frame.wing_kinds,
                frame.wing_attributes, time)

    def close(self, first: float | None = None, last: float | None = None) -> None:
        """Save what was written."""
        if first is not None and last is not None:
            self._stage.SetStartTimeCode(first)
            self._stage.SetEndTimeCode(last)
        self._layer.Save()
        self._stage = self._mesh = self._coat = self._wings = self._layer = None
        self._curves, self._nurbs = {}, None

    def _write_instances(self, frame: FeatherFrame, found: Instances, time: Any) -> None:
        from pxr import UsdGeom, UsdShade, Vt

        stage = self._stage
        if self._coat is None:
            self._coat = UsdGeom.PointInstancer.Define(stage, self._place)
            UsdGeom.Scope.Define(stage, f"{self._place}/Prototypes")
        coat = self._coat
        kinds = _of_kind(frame.kinds, len(found.ids))
        keys = [tuple(key) for key in np.column_stack([kinds, found.keys]).tolist()]
        for key in dict.fromkeys(keys):
            if key in self._known:
                continue
            vane = found.prototypes[key[1:]]
            number = self._known[key] = len(self._known)
            mesh = UsdGeom.Mesh.Define(stage, f"{self._place}/Prototypes/shape_{number}")
            _write_vanes(mesh, vane[None], None)
            UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(self._materials[key[0]])
            coat.CreatePrototypesRel().AddTarget(mesh.GetPath())
        rows = np.array([self._known[key] for key in keys], np.int32)
        turns = np.ascontiguousarray(found.turns[:, [1, 2, 3, 0]])  # OpenUSD keeps the real part last in memory
        coat.CreateProtoIndicesAttr().Set(Vt.IntArray.FromNumpy(rows), time)
        coat.CreatePositionsAttr().Set(Vt.Vec3fArray.FromNumpy(found.positions), time)
        coat.CreateOrientationsfAttr().Set(Vt.QuatfArray.FromNumpy(turns), time)
        coat.CreateOrientationsAttr().Set(Vt.QuathArray.FromNumpy(turns.astype(np.float16)), time)
        scales = np.repeat(found.scales[:, None], 3, axis=1).astype(np.float32)
        coat.CreateScalesAttr().Set(Vt.Vec3fArray.FromNumpy(scales), time)
        coat.CreateIdsAttr().Set(Vt.Int64Array.FromNumpy(found.ids.astype(np.int64)), time)
        coat.CreateExtentAttr().Set(_extent(found.vanes.reshape(-1, 3)), time)
        self._write_of_each(coat, found.ids, kinds, frame.attributes, UsdGeom.Tokens.vertex, 1, time)
        coat.GetPrim().SetCustomDataByKey("filoplume:quantising_error", found.error)

    def _write_each(
        self, prim: Any, place: str, ids: NDArray[np.int32], vanes: NDArray[np.float32],
        given: NDArray[np.int32] | None, attributes: Mapping[str, NDArray[np.float32]], time: Any,
    ) -> Any:
        """Feathers as their own shapes; the mesh they are in."""
        from pxr import UsdGeom, UsdShade, Vt

        kinds, times = _of_kind(given, len(ids)), 2 * (vanes.shape[1] - 1) * (vanes.shape[2] - 1)
        if prim is None:
            prim = UsdGeom.Mesh.Define(self._stage, place)
            UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(self._materials[int(kinds[0]) if len(kinds) else 0])
        _write_vanes(prim, vanes, time)
        self._write_of_each(prim, ids, kinds, attributes, UsdGeom.Tokens.uniform, times, time)
        if len(self._kinds) > 1:
            api = UsdShade.MaterialBindingAPI(prim)
            for kind, name in enumerate(self._kinds):
                subset = UsdGeom.Subset.Get(self._stage, prim.GetPath().AppendChild(_named(name)))
                faces = np.flatnonzero(np.repeat(kinds == kind, times)).astype(np.int32)
                if not subset and len(faces):
                    subset = api.CreateMaterialBindSubset(_named(name), Vt.IntArray())
                    UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(self._materials[kind])
                if subset:
                    subset.GetIndicesAttr().Set(Vt.IntArray.FromNumpy(faces), time)
        return prim

    def _write_nurbs(
        self, frame: FeatherFrame, vanes: NDArray[np.float32], radii: NDArray[np.float32], time: Any
    ) -> None:
        """Feathers of the skin and of wings as NURBS."""
        if self._nurbs is None:
            self._nurbs = NurbsFeathers(self._stage, self._place, self._materials, radii)
        ids, kinds = frame.ids, _of_kind(frame.kinds, len(frame.ids))
        attributes = {_identifier(name): column for name, column in frame.attributes.items()}
        if frame.wing_ids is not None and frame.wing_vanes is not None:
            more = _of_kind(frame.wing_kinds, len(frame.wing_ids))
            ids, kinds = np.concatenate([ids, frame.wing_ids]), np.concatenate([kinds, more])
            vanes = np.concatenate([vanes, frame.wing_vanes])
            attributes = {
                name: np.concatenate([column, frame.wing_attributes[name]])
                for name, column in frame.attributes.items() if name in frame.wing_attributes
            }
        colors = np.array([look.color for look in self._looks], np.float32)[kinds]
        self._nurbs.write(ids, kinds, vanes, colors, attributes, time)

    def _write_curves(
        self, chunks: Iterator[FeatherCurves | CondensedFeathers], attributes: dict[str, NDArray[np.float32]], time: Any
    ) -> None:
        """Curves, a prim for some hundred feathers each; what is in a crate file leaves the memory at once."""
        from pxr import UsdGeom

        if not self._curves:
            UsdGeom.Xform.Define(self._stage, self._place)
        written: dict[str, int] = {}
        paths = set()
        named = {_identifier(name): column for name, column in attributes.items()}
        for chunk in chunks:
            number = written[chunk.kind] = written.get(chunk.kind, -1) + 1
            path = f"{self._place}/{_named(chunk.kind)}_{number}"
            material = self._materials[self._kinds.index(chunk.kind)]
            self._curves[path] = write_curves(
                self._stage, path, self._curves.get(path), chunk, named, material, time)
            paths.add(path)
            if self._crate:
                self._layer.Save()
        for path, prim in self._curves.items():
            if path not in paths:
                clear_curves(prim, time)

    def _write_of_each(
        self, prim: Any, ids: NDArray[np.int32], kinds: NDArray[np.int32],
        attributes: Mapping[str, NDArray[np.float32]], each: Any, times: int, time: Any,
    ) -> None:
        """Ids, colours and attributes of feathers that are `times` faces each, or instances."""
        from pxr import Sdf, UsdGeom, Vt

        api = UsdGeom.PrimvarsAPI(prim)
        made = api.CreatePrimvar("feather_id", Sdf.ValueTypeNames.IntArray, each)
        made.Set(Vt.IntArray.FromNumpy(np.repeat(ids, times)), time)
        colors = np.array([look.color for look in self._looks], np.float32)[kinds]
        made = api.CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, each)
        made.Set(Vt.Vec3fArray.FromNumpy(np.repeat(colors, times, axis=0)), time)
        self._write_attributes(prim, attributes, each, times, time)

    def _write_attributes(
        self, prim: Any, attributes: Mapping[str, NDArray[np.float32]], each: Any, times: int, time: Any
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


def _of_kind(kinds: NDArray[np.int32] | None, count: int) -> NDArray[np.int32]:
    return np.zeros(count, np.int32) if kinds is None else kinds


def _named(kind: str) -> str:
    from pxr import Tf

    return str(Tf.MakeValidIdentifier(kind))


def _identifier(name: str) -> str:
    from pxr import Tf

    made = Tf.MakeValidIdentifier(name) if name else "feathers"
    return "feathers_" if made in ("mesh", "Looks") else str(made)  # these places are taken

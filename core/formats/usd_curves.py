"""Grooms as OpenUSD curves (.usda, .usdc, .usd, .usdz): written for every other program, read from any.

What is written, under the default prim ``/Groom`` (metersPerUnit, upAxis and extents authored)::

    /Groom/<name>             Xform
    /Groom/<name>/guides      BasisCurves, one prim for all guides
    /Groom/<name>/children    BasisCurves, one prim for all hairs
    /Groom/mesh               Mesh, where the caller gives one

Curves are ``linear`` and ``nonperiodic``: the points are ours to the bit, the first one is the root, and every
program draws what we drew. ``widths`` are diameters, one per point. Primvars, uniform (one per curve) unless
said: ``st`` root UV; ``id``; ``displayColor`` (per point); ``groom_guide`` (constant, 1 for guides), and for
children ``groom_closest_guides`` and ``groom_guide_weights``, three to a curve (elementSize 3), whose numbers
are ids of the guides prim: the names are those of Unreal's groom schema. Guides keep purpose ``default``:
Blender and Houdini leave prims of purpose ``guide`` out unless asked, and a groom without its guides is
no groom; a renderer's stage can deactivate the one prim.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.file_space import from_metres_y_up, scaled
from core.formats.raw_curves import OnCurve, RawCurves, as_ids, clean, on_points, pack, scale_of
from core.groom.strands import GroomStrands, Strands
from core.mesh.mesh import Mesh

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
UV_NAMES = ("st", "groom_root_uv", "uv", "surface_uv_coordinate")
ID_NAMES = ("id", "groom_id", "ids", "hair_id")
GUIDE_ID_NAMES, GUIDE_WEIGHT_NAMES = ("groom_closest_guides", "guide_ids"), ("groom_guide_weights", "guide_weights")


def write(path: Path, groom: GroomStrands, mesh: Mesh | None, up: str, metres_per_unit: float, maker: str) -> None:
    """Write `groom` (and `mesh` beside it) to `path`; its suffix chooses text, crate or package.

    Parameters
    ----------
    up : "y" or "z"; metres_per_unit : of the file. maker : name and version of the program, kept in customData.

    Raises
    ------
    UserError
        When OpenUSD could not write it (a full disk).
    """
    from pxr import Sdf, Tf, UsdUtils

    try:
        if path.suffix.lower() != ".usdz":
            _write_layer(path, groom, mesh, up, metres_per_unit, maker)
            return
        with tempfile.TemporaryDirectory(prefix="filoplume-") as folder:
            inside = Path(folder) / "groom.usdc"
            _write_layer(inside, groom, mesh, up, metres_per_unit, maker)
            if not UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(inside)), str(path)):
                raise UserError("The groom could not be packed; write a .usdc instead.")
    except Tf.ErrorException as error:
        raise UserError(
            f"The USD file could not be written to {path.parent}; free some space there or save elsewhere."
        ) from error


def _write_layer(
    path: Path, groom: GroomStrands, mesh: Mesh | None, up: str, metres_per_unit: float, maker: str
) -> None:
    from pxr import Sdf, Usd, UsdGeom

    layer = Sdf.Layer.CreateNew(str(path), args={"format": "usdc"} if path.suffix.lower() == ".usd" else {})
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, metres_per_unit)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z if up == "z" else UsdGeom.Tokens.y)
    root = UsdGeom.Xform.Define(stage, "/Groom").GetPrim()
    stage.SetDefaultPrim(root)
    root.SetCustomDataByKey("filoplume", {"version": maker, "name": groom.name})
    parent = UsdGeom.Xform.Define(stage, f"/Groom/{_identifier(groom.name)}").GetPrim()
    parent.SetDisplayName(groom.name)
    for role, strands in (("guides", groom.guides), ("children", groom.children)):
        if strands is not None:
            _write_curves(stage, parent.GetPath().AppendChild(role), strands, role, up, metres_per_unit)
    if mesh is not None:
        _write_mesh(stage, mesh, up, metres_per_unit)
    layer.Save()


def _identifier(name: str) -> str:
    from pxr import Tf

    made = Tf.MakeValidIdentifier(name) if name else "groom"
    return "groom_" if made == "mesh" else str(made)  # /Groom/mesh is taken


def _write_curves(stage: Any, path: Any, strands: Strands, role: str, up: str, metres_per_unit: float) -> None:
    from pxr import Sdf, UsdGeom, Vt

    curves = UsdGeom.BasisCurves.Define(stage, path)
    points = from_metres_y_up(strands.points, metres_per_unit, up)
    curves.CreateTypeAttr(UsdGeom.Tokens.linear)
    curves.CreateWrapAttr(UsdGeom.Tokens.nonperiodic)
    curves.CreateCurveVertexCountsAttr(Vt.IntArray.FromNumpy(strands.counts))
    curves.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    reach = 0.0
    if strands.widths is not None:
        widths = scaled(strands.widths, metres_per_unit, divide=True)
        curves.CreateWidthsAttr(Vt.FloatArray.FromNumpy(widths))
        curves.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
        reach = float(widths.max(initial=0.0)) / 2
    if len(points):
        curves.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(_extent(points, reach)))
    primvars = UsdGeom.PrimvarsAPI(curves)
    types, uniform = Sdf.ValueTypeNames, UsdGeom.Tokens.uniform
    primvars.CreatePrimvar("groom_guide", types.Int, UsdGeom.Tokens.constant).Set(int(role == "guides"))
    if strands.root_uvs is not None:
        made = primvars.CreatePrimvar("st", types.TexCoord2fArray, uniform)
        made.Set(Vt.Vec2fArray.FromNumpy(strands.root_uvs))
    if strands.ids is not None:
        primvars.CreatePrimvar("id", types.IntArray, uniform).Set(Vt.IntArray.FromNumpy(strands.ids))
    if strands.colors is not None:
        colors = curves.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex)
        colors.Set(Vt.Vec3fArray.FromNumpy(strands.colors))
    if strands.guide_ids is not None and strands.guide_weights is not None:
        made = primvars.CreatePrimvar(GUIDE_ID_NAMES[0], types.IntArray, uniform, 3)
        made.Set(Vt.IntArray.FromNumpy(strands.guide_ids.reshape(-1)))
        made = primvars.CreatePrimvar(GUIDE_WEIGHT_NAMES[0], types.FloatArray, uniform, 3)
        made.Set(Vt.FloatArray.FromNumpy(strands.guide_weights.reshape(-1)))


def _extent(points: NDArray[np.float32], reach: float) -> NDArray[np.float32]:
    """The box of the points, grown by half the greatest diameter as OpenUSD asks."""
    return np.stack([points.min(axis=0) - np.float32(reach), points.max(axis=0) + np.float32(reach)])


def _write_mesh(stage: Any, mesh: Mesh, up: str, metres_per_unit: float) -> None:
    from pxr import Sdf, UsdGeom, Vt

    made = UsdGeom.Mesh.Define(stage, "/Groom/mesh")
    points = from_metres_y_up(mesh.points, metres_per_unit, up)
    made.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    made.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    made.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(mesh.counts))
    made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.corners))
    if len(points):
        made.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(_extent(points, 0.0)))
    if mesh.uvs is not None:
        face_varying = UsdGeom.Tokens.faceVarying
        st = UsdGeom.PrimvarsAPI(made).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, face_varying)
        st.Set(Vt.Vec2fArray.FromNumpy(mesh.uvs))
    if len(mesh.part_names) > 1:
        for part, name in enumerate(mesh.part_names):
            rows = Vt.IntArray.FromNumpy(np.flatnonzero(mesh.parts == part).astype(np.int32))
            UsdGeom.Subset.CreateUniqueGeomSubset(made, _identifier(name), UsdGeom.Tokens.face, rows, "parts")


def read_in_child(path: str) -> dict[str, Any]:
    """Read every BasisCurves prim of the stage at `path`, in the space of the stage (see ``raw_curves.pack``).

    Transforms are applied; of animation the earliest time is taken; instances are followed, proxies and
    invisible prims are read too. Cubic curves become points on the curve (``raw_curves.OnCurve``). Prims with
    the primvar ``groom_guide`` at 1 or of purpose ``guide`` are guides, all others children. "metres_per_unit"
    and "up" are None where the file does not say.
    """
    from pxr import Tf

    try:
        return _read_stage(path)
    except Tf.ErrorException as error:
        raise UserError(f"{Path(path).name} is damaged, or not a USD file.") from error


def _read_stage(path: str) -> dict[str, Any]:
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(path)
    time = Usd.TimeCode.EarliestTime()
    transforms = UsdGeom.XformCache(time)
    bundles: list[RawCurves] = []
    notes: list[str] = []
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if not prim.IsA(UsdGeom.Curves):
            continue
        if not prim.IsA(UsdGeom.BasisCurves):
            notes.append(f"{prim.GetPath()} is a {prim.GetTypeName()}, which is not read; convert it to BasisCurves.")
            continue
        raw = _read_curves(prim, time, np.array(transforms.GetLocalToWorldTransform(prim)), notes)
        if raw is not None:
            bundles.append(clean(raw, str(prim.GetPath())))
    data = (stage.GetDefaultPrim() or stage.GetPseudoRoot()).GetCustomDataByKey("filoplume") or {}
    said = stage.HasAuthoredMetadata
    return pack(
        bundles, name=str(data.get("name") or _name_of(stage)), notes=notes,
        metres_per_unit=float(UsdGeom.GetStageMetersPerUnit(stage)) if said("metersPerUnit") else None,
        up=str(UsdGeom.GetStageUpAxis(stage)).lower() if said("upAxis") else None,
    )  # fmt: skip


def _name_of(stage: Any) -> str:
    prim = stage.GetDefaultPrim()
    return str(prim.GetName()) if prim else "groom"


def _read_curves(prim: Any, time: Any, world: NDArray[np.float64], notes: list[str]) -> RawCurves | None:
    from pxr import UsdGeom

    curves = UsdGeom.BasisCurves(prim)
    points, counts = curves.GetPointsAttr().Get(time), curves.GetCurveVertexCountsAttr().Get(time)
    if points is None or counts is None or not len(counts):
        return None
    points, counts = np.array(points, np.float32), np.array(counts, np.int64)
    if counts.min() < 0 or int(counts.sum()) != len(points):
        notes.append(f"{prim.GetPath()} has {len(points)} points where its counts say {int(counts.sum())}; left out.")
        return None
    basis = "linear" if curves.GetTypeAttr().Get(time) == UsdGeom.Tokens.linear else curves.GetBasisAttr().Get(time)
    shape = OnCurve(str(basis), str(curves.GetWrapAttr().Get(time)), counts)
    if not np.array_equal(world, np.eye(4)):
        points = (points @ world[:3, :3] + world[3, :3]).astype(np.float32)
    primvars = UsdGeom.PrimvarsAPI(prim)
    raw = RawCurves(counts=shape.counts, points=shape.vertex(points))
    raw.widths = _read_widths(curves, primvars, shape, time)
    if raw.widths is not None:  # a diameter grows with the mean scale of its transform
        raw.widths = scaled(raw.widths, scale_of(world))
    raw.colors = _per_point(primvars.GetPrimvar("displayColor"), shape, time, 3)
    raw.root_uvs = _first(primvars, UV_NAMES, len(counts), time, 2)
    ids = _first(primvars, ID_NAMES, len(counts), time, 1)
    raw.ids = as_ids(None if ids is None else ids[:, 0])
    raw.guide_ids = as_ids(_first(primvars, GUIDE_ID_NAMES, len(counts), time, 3))
    raw.guide_weights = _first(primvars, GUIDE_WEIGHT_NAMES, len(counts), time, 3)
    marker = primvars.GetPrimvar("groom_guide")
    marked = np.asarray(marker.Get(time)).reshape(-1)[:1] if marker and marker.HasValue() else np.zeros(1)
    purpose = UsdGeom.Imageable(prim).ComputePurpose()
    raw.guides = bool(marked.size and marked[0] == 1) or purpose == UsdGeom.Tokens.guide
    return raw


def _read_widths(curves: Any, primvars: Any, shape: OnCurve, time: Any) -> NDArray[Any] | None:
    primvar = primvars.GetPrimvar("widths")  # wins over the attribute when it is authored
    if primvar and primvar.HasValue():
        return _per_point(primvar, shape, time, 1)
    values = curves.GetWidthsAttr().Get(time)
    if values is None:
        return None
    return on_points(np.array(values, np.float32), str(curves.GetWidthsInterpolation()), shape)


def _per_point(primvar: Any, shape: OnCurve, time: Any, width: int) -> NDArray[Any] | None:
    values = _flattened(primvar, time, width)
    if values is None:
        return None
    return on_points(values if width > 1 else values[:, 0], str(primvar.GetInterpolation()), shape)


def _first(primvars: Any, names: tuple[str, ...], rows: int, time: Any, width: int) -> NDArray[Any] | None:
    """The first of the uniform primvars `names` that has `rows` rows, (rows, width), or None."""
    for name in names:
        values = _flattened(primvars.GetPrimvar(name), time, width)
        if values is not None and len(values) == rows:
            return values
    return None


def _flattened(primvar: Any, time: Any, width: int) -> NDArray[Any] | None:
    """Values of a primvar (indexed or not), (rows, width) float32 or int64; None when it has none."""
    if not primvar or not primvar.HasValue():
        return None
    values = np.array(primvar.ComputeFlattened(time))
    if values.dtype.kind not in "iuf" or values.size == 0 or values.size % width:
        return None
    return values.reshape(-1, width).astype(np.float32 if values.dtype.kind == "f" else np.int64)

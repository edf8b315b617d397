"""Grooms as Alembic curves (.abc) with Unreal's groom schema 1.5: written for every other program, read from any.

What is written (source: Epic, "Alembic for Grooms Specification", and how the engine's importer reads it)::

    /<name>            Xform    user properties groom_version_major = 1, groom_version_minor = 5 (int16),
                                groom_tool, groom_properties (string)
    /<name>/guides     Curves   every guide       groom_guide = 1
    /<name>/children   Curves   every hair        groom_guide = 0, groom_closest_guides, groom_guide_weights
    /<name>/mesh       PolyMesh where the caller gives one

Parameters of the curves: ``groom_guide`` int16 and ``groom_group_id`` int32, constant; ``groom_id`` int32,
``groom_root_uv`` float[2], ``groom_closest_guides`` int32[3] (values of ``groom_id`` of the guides) and
``groom_guide_weights`` float[3], uniform; ``groom_width`` float and ``groom_color`` float[3], vertex.

Curves are linear and non-periodic, root first, with native widths (diameters). Alembic knows no units: points
and native widths are in ``metres_per_unit`` (metres unless told otherwise, which is what Blender and Houdini
assume; for Unreal write 0.01, or import with a scale of 100), Y up unless told. ``groom_width`` is always in
centimetres: Unreal takes it as it is, unscaled. Our reader finds the unit and the axis in two further user
properties, ``filoplume_metres_per_unit`` (double) and ``filoplume_up`` (string).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.file_space import from_metres_y_up, scaled
from core.formats.raw_curves import OnCurve, RawCurves, clean, pack, spread
from core.groom.strands import GroomStrands, Strands
from core.mesh.mesh import Mesh

SUFFIXES = (".abc",)
SCHEMA = (1, 5)
CENTIMETRES = 0.01
SCOPES = {"con": "constant", "uni": "uniform", "var": "varying", "vtx": "vertex", "fvr": "varying"}


def write(path: Path, groom: GroomStrands, mesh: Mesh | None, up: str, metres_per_unit: float, maker: str) -> None:
    """Write `groom` (and `mesh` beside it) as an Ogawa archive at `path`.

    Parameters
    ----------
    up : "y" or "z"; metres_per_unit : of points and native widths. maker : name and version of the program.
    """
    from alembic3d import Abc, AbcGeom

    archive = Abc.CreateArchiveWithInfo(str(path), maker, groom.name)
    parent = AbcGeom.OXform(archive.getTop(), groom.name.replace("/", "_") or "groom")
    said = parent.getSchema().getUserProperties()
    Abc.OInt16Property(said, "groom_version_major").setValue(SCHEMA[0])
    Abc.OInt16Property(said, "groom_version_minor").setValue(SCHEMA[1])
    Abc.OStringProperty(said, "groom_tool").setValue(maker)
    Abc.OStringProperty(said, "groom_properties").setValue("")
    Abc.ODoubleProperty(said, "filoplume_metres_per_unit").setValue(metres_per_unit)
    Abc.OStringProperty(said, "filoplume_up").setValue(up)
    Abc.OStringProperty(said, "filoplume_name").setValue(groom.name)
    for role, strands in (("guides", groom.guides), ("children", groom.children)):
        if strands is not None:
            _write_curves(parent, strands, role, up, metres_per_unit)
    if mesh is not None:
        _write_mesh(parent, mesh, up, metres_per_unit)


def _write_curves(parent: Any, strands: Strands, role: str, up: str, metres_per_unit: float) -> None:
    import imath
    from alembic3d import AbcGeom as Geom

    scope = Geom.GeometryScope
    schema = Geom.OCurves(parent, role).getSchema()
    widths = Geom.OFloatGeomParamSample()
    if strands.widths is not None:
        diameters = scaled(strands.widths, metres_per_unit, divide=True)
        widths = Geom.OFloatGeomParamSample(_lend(imath.FloatArrayFromBuffer, diameters), scope.kVertexScope)
    sample = Geom.OCurvesSchemaSample(
        _lend(imath.V3fArrayFromBuffer, from_metres_y_up(strands.points, metres_per_unit, up)),
        _lend(imath.IntArrayFromBuffer, strands.counts),
        Geom.CurveType.kLinear, Geom.CurvePeriodicity.kNonPeriodic, widths, Geom.OV2fGeomParamSample(),
        Geom.ON3fGeomParamSample(), Geom.BasisType.kNoBasis,
    )  # fmt: skip
    schema.set(sample)
    params = schema.getArbGeomParams()

    def param(kind: str, name: str, where: Any, values: Any) -> None:
        made = getattr(Geom, f"O{kind}GeomParam")(params, name, False, where, 1)
        made.set(getattr(Geom, f"O{kind}GeomParamSample")(values, where))

    guide, group = imath.ShortArray(1), imath.IntArray(1)
    guide[0], group[0] = int(role == "guides"), 0
    param("Int16", "groom_guide", scope.kConstantScope, guide)
    param("Int32", "groom_group_id", scope.kConstantScope, group)
    if strands.ids is not None:
        param("Int32", "groom_id", scope.kUniformScope, _lend(imath.IntArrayFromBuffer, strands.ids))
    if strands.root_uvs is not None:
        param("V2f", "groom_root_uv", scope.kUniformScope, _lend(imath.V2fArrayFromBuffer, strands.root_uvs))
    if strands.guide_ids is not None and strands.guide_weights is not None:
        lent = _lend(imath.V3iArrayFromBuffer, strands.guide_ids), _lend(imath.V3fArrayFromBuffer, strands.guide_weights)
        param("V3i", "groom_closest_guides", scope.kUniformScope, lent[0])
        param("V3f", "groom_guide_weights", scope.kUniformScope, lent[1])
    if strands.widths is not None:
        centimetres = _lend(imath.FloatArrayFromBuffer, scaled(strands.widths, CENTIMETRES, divide=True))
        param("Float", "groom_width", scope.kVertexScope, centimetres)
    if strands.colors is not None:
        param("C3f", "groom_color", scope.kVertexScope, _color_array(strands.colors))


def _lend(from_buffer: Any, array: NDArray[Any]) -> Any:
    """An imath array of the rows of `array`; an empty one where there are none (buffers of nothing are refused)."""
    import imath

    if len(array):
        return from_buffer(np.ascontiguousarray(array))
    return getattr(imath, from_buffer.__name__.removesuffix("FromBuffer"))(0)


def _color_array(colors: NDArray[Any]) -> Any:
    import imath

    made = imath.C3fArray(len(colors))
    if len(colors):
        np.asarray(made)[:] = colors
    return made


def _write_mesh(parent: Any, mesh: Mesh, up: str, metres_per_unit: float) -> None:
    import imath
    from alembic3d import AbcGeom as Geom

    uvs = Geom.OV2fGeomParamSample()
    # Alembic winds its faces the other way round
    order = np.repeat(mesh.starts + mesh.counts - 1, mesh.counts) - (
        np.arange(len(mesh.corners)) - np.repeat(mesh.starts, mesh.counts)
    )
    if mesh.uvs is not None:
        uvs = Geom.OV2fGeomParamSample(
            _lend(imath.V2fArrayFromBuffer, mesh.uvs[order]), Geom.GeometryScope.kFacevaryingScope
        )
    points = from_metres_y_up(mesh.points, metres_per_unit, up)
    sample = Geom.OPolyMeshSchemaSample(
        _lend(imath.V3fArrayFromBuffer, points), _lend(imath.IntArrayFromBuffer, mesh.corners[order]),
        _lend(imath.IntArrayFromBuffer, mesh.counts), uvs,
    )  # fmt: skip
    Geom.OPolyMesh(parent, "mesh").getSchema().set(sample)


def read_in_child(path: str) -> dict[str, Any]:
    """Read every curves object of the archive at `path`, in its space (see ``raw_curves.pack``).

    Transforms are applied; of animation the first sample is taken. Cubic curves become points on the curve;
    for Hermite, power and variable-order curves the control points are kept, with a note. Curves whose
    ``groom_guide`` is not 0 are guides (it may differ from curve to curve), all others children.
    """
    from alembic3d import Abc

    try:
        archive = Abc.IArchive(path)
    except Exception as error:  # its exceptions are of the C++ runtime
        raise UserError(f"{Path(path).name} is not a readable Alembic file.") from error
    bundles: list[RawCurves] = []
    notes: list[str] = []
    said: dict[str, Any] = {}
    stack = [(archive.getTop(), np.eye(4))]
    while stack:
        parent, world = stack.pop()
        children = []
        for k in range(parent.getNumChildren()):
            children.append(_visit(parent, parent.getChild(k), world, said, bundles, notes))
        stack += reversed(children)
    unit, up = said.get("filoplume_metres_per_unit"), said.get("filoplume_up")
    return pack(
        bundles, name=str(said.get("filoplume_name") or said.get("first") or "groom"), notes=notes,
        metres_per_unit=float(unit) if isinstance(unit, float) and np.isfinite(unit) and unit > 0 else None,
        up=up if up in ("y", "z") else None,
    )  # fmt: skip


def _visit(
    parent: Any, child: Any, world: NDArray[np.float64], said: dict[str, Any], bundles: list[RawCurves],
    notes: list[str],
) -> tuple[Any, NDArray[np.float64]]:  # fmt: skip
    """Take what `child` says; return it with the transform of its own children (row vectors, as Imath's)."""
    from alembic3d import AbcGeom as Geom

    name, header = child.getName(), child.getHeader()
    if Geom.IXform.matches(header):
        schema = Geom.IXform(parent, name).getSchema()
        sample = schema.getValue()
        local = np.array(sample.getMatrix(), np.float64).reshape(4, 4)
        world = local @ world if sample.getInheritsXforms() else local
        said.setdefault("first", name)
        for key, value in _scalars(schema.getUserProperties()).items():
            said.setdefault(key, value)
    elif Geom.ICurves.matches(header):
        bundles += _read_curves(Geom.ICurves(parent, name).getSchema(), child.getFullName(), world, notes)
    elif Geom.INuPatch.matches(header):
        notes.append(f"{child.getFullName()} is a NURBS surface, which is not read.")
    return child, world


def _scalars(properties: Any) -> dict[str, Any]:
    from alembic3d import Abc

    found = {}
    if properties.valid():
        for k in range(properties.getNumProperties()):
            header = properties.getPropertyHeader(k)
            if header.isScalar() and header.getName().startswith("filoplume_"):
                found[header.getName()] = Abc.IScalarProperty(properties, header.getName()).getValue()
    return found


def _read_curves(schema: Any, where: str, world: NDArray[np.float64], notes: list[str]) -> list[RawCurves]:
    sample = schema.getValue()
    points = np.array(sample.getPositions(), np.float32).reshape(-1, 3)
    counts = np.array(sample.getCurvesNumVertices(), np.int64)
    if not len(counts):
        return []
    if counts.min() < 0 or int(counts.sum()) != len(points):
        notes.append(f"{where} has {len(points)} points where its counts say {int(counts.sum())}; left out.")
        return []
    shape = OnCurve(_basis(sample, where, notes), _wrap(sample), counts)
    if not np.array_equal(world, np.eye(4)):
        points = (points @ world[:3, :3] + world[3, :3]).astype(np.float32)
    raw = RawCurves(counts=shape.counts, points=shape.vertex(points))
    params = _array_params(schema.getArbGeomParams())
    raw.widths = _on_points(*_widths(schema), shape)
    if raw.widths is not None:  # a diameter grows with the mean scale of its transform
        raw.widths = scaled(raw.widths, abs(float(np.linalg.det(world[:3, :3]))) ** (1 / 3))
    raw.colors = _on_points(*params.get("groom_color", (None, "")), shape)
    if raw.colors is not None and raw.colors.shape[1:] != (3,):
        raw.colors = None
    raw.ids = _per_curve(params, "groom_id", len(counts), ())
    raw.root_uvs = _per_curve(params, "groom_root_uv", len(counts), (2,))
    raw.guide_ids = _per_curve(params, "groom_closest_guides", len(counts), (3,))
    raw.guide_weights = _per_curve(params, "groom_guide_weights", len(counts), (3,))
    marks, scope = params.get("groom_guide", (None, ""))
    if marks is None or marks.ndim != 1:
        return [clean(raw, where)]
    is_guide = spread(marks != 0, scope, np.ones(len(counts), np.int64))
    if is_guide is None:
        return [clean(raw, where)]
    if is_guide.all() or not is_guide.any():
        raw.guides = bool(is_guide.all())
        return [clean(raw, where)]
    return [clean(_select(raw, is_guide, True), where), clean(_select(raw, ~is_guide, False), where)]


def _select(raw: RawCurves, rows: NDArray[Any], guides: bool) -> RawCurves:
    points = np.repeat(rows, raw.counts)

    def take(values: NDArray[Any] | None, which: NDArray[Any]) -> NDArray[Any] | None:
        return None if values is None else values[which]

    return RawCurves(
        counts=raw.counts[rows], points=raw.points[points], widths=take(raw.widths, points),
        colors=take(raw.colors, points), ids=take(raw.ids, rows), root_uvs=take(raw.root_uvs, rows),
        guide_ids=take(raw.guide_ids, rows), guide_weights=take(raw.guide_weights, rows), guides=guides,
    )  # fmt: skip


def _basis(sample: Any, where: str, notes: list[str]) -> str:
    kind, basis = str(sample.getType()), str(sample.getBasis())
    if kind.endswith("kLinear"):
        return "linear"
    known = {"kBezierBasis": "bezier", "kBsplineBasis": "bspline", "kCatmullromBasis": "catmullRom"}
    if kind.endswith("kCubic") and basis.split(".")[-1] in known:
        return known[basis.split(".")[-1]]
    if not basis.endswith("kNoBasis"):
        notes.append(f"{where} has a basis that is not evaluated; its control points were taken as they are.")
    return "linear"


def _wrap(sample: Any) -> str:
    return "periodic" if str(sample.getWrap()).endswith("kPeriodic") else "nonperiodic"


def _widths(schema: Any) -> tuple[NDArray[Any] | None, str]:
    param = schema.getWidthsParam()
    if not param.valid() or not param.getNumSamples():
        return None, ""
    scope = str(param.getScope()).split(".")[-1]
    named = {"kConstantScope": "con", "kUniformScope": "uni", "kVaryingScope": "var", "kFacevaryingScope": "fvr"}
    return np.array(param.getExpandedValue().getVals(), np.float32), SCOPES[named.get(scope, "vtx")]


def _array_params(params: Any) -> dict[str, tuple[NDArray[Any], str]]:
    """Arrays and scopes of the ``groom_*`` parameters of a curves object, plain or indexed."""
    from alembic3d import Abc

    found: dict[str, tuple[NDArray[Any], str]] = {}
    if not params.valid():
        return found
    for k in range(params.getNumProperties()):
        header = params.getPropertyHeader(k)
        name, scope = header.getName(), SCOPES.get(header.getMetaData().get("geoScope"), "vertex")
        if not name.startswith("groom_") or str(header.getDataType().getPod()).endswith("kStringPOD"):
            continue
        if header.isArray():
            values = np.array(Abc.IArrayProperty(params, name).getValue())
        elif header.isCompound():
            inside = Abc.ICompoundProperty(params, name)
            palette = np.array(Abc.IArrayProperty(inside, ".vals").getValue())
            rows = np.array(Abc.IArrayProperty(inside, ".indices").getValue(), np.int64)
            if len(rows) and not (0 <= rows.min() and rows.max() < len(palette)):
                continue
            values = palette[rows]
        else:
            continue
        if values.dtype.kind in "iufb":
            found[name] = (values, scope)
    return found


def _per_curve(
    params: dict[str, tuple[NDArray[Any], str]], name: str, rows: int, width: tuple[int, ...]
) -> NDArray[Any] | None:
    values, scope = params.get(name, (None, ""))
    if values is None or scope == "constant" or values.shape != (rows, *width):
        return None
    return values.astype(np.float32 if values.dtype.kind == "f" else np.int64)


def _on_points(values: NDArray[Any] | None, scope: str, shape: OnCurve) -> NDArray[Any] | None:
    if values is None or not len(values):
        return None
    if scope == "varying":
        on_joints = shape.varying(values)
        if on_joints is not None:
            return on_joints
        scope = "vertex"
    if scope == "vertex":
        return shape.vertex(values) if len(values) == int(shape.given.sum()) else None
    return spread(values, scope, shape.counts)

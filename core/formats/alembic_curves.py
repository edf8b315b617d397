"""Curves of Alembic archives (.abc) of any program; see ``alembic_write`` for the schema of our own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.file_space import scaled
from core.formats.raw_curves import OnCurve, RawCurves, as_ids, clean, on_points, pack, scale_of, spread

SUFFIXES = (".abc",)
SCOPES = {"con": "constant", "uni": "uniform", "var": "varying", "vtx": "vertex", "fvr": "varying"}


def read_in_child(path: str) -> dict[str, Any]:
    """Read every curves object of the archive at `path`, in its space (see ``raw_curves.pack``).

    Transforms are applied; of animation the first sample is taken. Cubic curves become points on the curve;
    for Hermite, power and variable-order curves the control points are kept, with a note. Curves whose
    ``groom_guide`` is not 0 are guides (it may differ from curve to curve), all others children.
    """
    try:
        return _read_archive(path)
    except RuntimeError as error:  # what the library makes of the exceptions of Alembic
        raise UserError(f"{Path(path).name} is damaged, or not an Alembic file.") from error


def _read_archive(path: str) -> dict[str, Any]:
    from alembic3d import Abc

    archive = Abc.IArchive(path)
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
    widths, scope = _widths(schema)
    raw.widths = on_points(widths, scope, shape)
    if raw.widths is not None:  # a diameter grows with the mean scale of its transform
        raw.widths = scaled(raw.widths, scale_of(world))
    colors, scope = params.get("groom_color", (None, ""))
    raw.colors = on_points(colors, scope, shape) if colors is not None and colors.shape[1:] == (3,) else None
    raw.ids = as_ids(_per_curve(params, "groom_id", len(counts), ()))
    raw.root_uvs = _per_curve(params, "groom_root_uv", len(counts), (2,))
    raw.guide_ids = as_ids(_per_curve(params, "groom_closest_guides", len(counts), (3,)))
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
    kind, basis = _word(sample.getType()), _word(sample.getBasis())
    known = {"kBezierBasis": "bezier", "kBsplineBasis": "bspline", "kCatmullromBasis": "catmullRom"}
    if kind == "kCubic" and basis in known:
        return known[basis]
    if kind != "kLinear" and basis != "kNoBasis":
        notes.append(f"{where} has a basis that is not evaluated; its control points were taken as they are.")
    return "linear"


def _wrap(sample: Any) -> str:
    return "periodic" if _word(sample.getWrap()) == "kPeriodic" else "nonperiodic"


def _word(value: Any) -> str:
    """The bare name of a value of one of Alembic's enumerations."""
    return str(value).rpartition(".")[2]


def _widths(schema: Any) -> tuple[NDArray[Any] | None, str]:
    param = schema.getWidthsParam()
    if not param.valid() or not param.getNumSamples():
        return None, ""
    named = {"kConstantScope": "con", "kUniformScope": "uni", "kVaryingScope": "var", "kFacevaryingScope": "fvr"}
    return np.array(param.getExpandedValue().getVals(), np.float32), SCOPES[named.get(_word(param.getScope()), "vtx")]


def _array_params(params: Any) -> dict[str, tuple[NDArray[Any], str]]:
    """Arrays and scopes of the ``groom_*`` parameters of a curves object, plain or indexed."""
    from alembic3d import Abc

    found: dict[str, tuple[NDArray[Any], str]] = {}
    if not params.valid():
        return found
    for k in range(params.getNumProperties()):
        header = params.getPropertyHeader(k)
        name, scope = header.getName(), SCOPES.get(header.getMetaData().get("geoScope"), "vertex")
        if not name.startswith("groom_") or _word(header.getDataType().getPod()) == "kStringPOD":
            continue
        if header.isArray():
            values = np.array(Abc.IArrayProperty(params, name).getValue())
        elif header.isCompound():
            inside = Abc.ICompoundProperty(params, name)
            palette = np.array(Abc.IArrayProperty(inside, ".vals").getValue())
            rows = np.array(Abc.IArrayProperty(inside, ".indices").getValue(), np.int64)
            if len(rows) and (rows.min() < 0 or rows.max() >= len(palette)):
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

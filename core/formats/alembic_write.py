"""Grooms as Alembic curves (.abc) with Unreal's groom schema 1.5, written for every other program.

What is written (source: Epic, "Alembic for Grooms Specification", and how the engine's importer reads it)::

    /<name>                           Xform     user properties groom_version_major = 1, groom_version_minor = 5
                                                (int16), groom_tool, groom_properties (string)
    /<name>/guides/guidesShape        Curves    every guide: groom_guide = 1
    /<name>/children/childrenShape    Curves    every hair: groom_guide = 0, groom_closest_guides,
                                                groom_guide_weights
    /<name>/mesh/meshShape            PolyMesh  where the caller gives one

(each shape under a transform of its own, because other programs name objects by the transform).

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

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.file_space import from_metres_y_up, scaled
from core.formats.sandbox import run_bounded
from core.groom.strands import GroomStrands, Strands
from core.mesh.mesh import Mesh

SCHEMA = (1, 5)
CENTIMETRES = 0.01


def write(path: Path, groom: GroomStrands, mesh: Mesh | None, up: str, metres_per_unit: float, maker: str) -> None:
    """Write `groom` (and `mesh` beside it) as an Ogawa archive at `path`.

    It is done in a child process: where a disk is full Alembic throws while it closes the archive, and takes
    the process with it.

    Parameters
    ----------
    up : "y" or "z"; metres_per_unit : of points and native widths. maker : name and version of the program.

    Raises
    ------
    UserError
        When the archive could not be written.
    """
    with tempfile.TemporaryDirectory(prefix="filoplume-") as folder:
        try:
            _save_columns(Path(folder), groom, mesh)
        except OSError as error:
            raise UserError(f"There is no room for temporary files in {folder}; free some space there.") from error
        arguments = {
            "path": str(path), "folder": folder, "name": groom.name, "up": up, "metres_per_unit": metres_per_unit,
            "maker": maker,
        }  # fmt: skip
        try:
            run_bounded(f"{__name__}:write_in_child", arguments, what="The archive", seconds=300, memory=8 << 30)
        except UserError as error:
            raise UserError(
                f"The Alembic file could not be written to {path.parent}; free some space there or save elsewhere."
            ) from error


def _save_columns(folder: Path, groom: GroomStrands, mesh: Mesh | None) -> None:
    for prefix, record in (("guides", groom.guides), ("children", groom.children), ("mesh", mesh)):
        for name in () if record is None else record.__struct_fields__:
            values = getattr(record, name)
            if isinstance(values, np.ndarray):
                np.save(folder / f"{prefix}.{name}.npy", values, allow_pickle=False)


def write_in_child(path: str, folder: str, name: str, up: str, metres_per_unit: float, maker: str) -> dict[str, Any]:
    """Write the arrays of `folder` (named as in :func:`write`) to the archive `path`."""
    columns: dict[str, dict[str, Any]] = {"guides": {}, "children": {}, "mesh": {}}
    for file in Path(folder).glob("*.npy"):
        prefix, column, _ = file.name.split(".")
        columns[prefix][column] = np.load(file, mmap_mode="r", allow_pickle=False)
    mesh = columns.pop("mesh")
    bundles = {role: Strands(**found) for role, found in columns.items() if found}
    _write_archive(path, name, bundles, _whole_mesh(mesh) if mesh else None, up, metres_per_unit, maker)
    return {"bytes": Path(path).stat().st_size}


def _whole_mesh(columns: dict[str, Any]) -> Mesh:
    """The mesh without the names of its parts, which nothing here needs."""
    parts = np.zeros(len(columns["counts"]), np.int32)
    return Mesh(**{**columns, "parts": parts}, part_names=("mesh",))


def _write_archive(
    path: str, name: str, bundles: dict[str, Strands], mesh: Mesh | None, up: str, metres_per_unit: float, maker: str
) -> None:
    from alembic3d import Abc, AbcGeom

    archive = Abc.CreateArchiveWithInfo(path, maker, name)
    parent = AbcGeom.OXform(archive.getTop(), name.replace("/", "_") or "groom")
    said = parent.getSchema().getUserProperties()
    Abc.OInt16Property(said, "groom_version_major").setValue(SCHEMA[0])
    Abc.OInt16Property(said, "groom_version_minor").setValue(SCHEMA[1])
    Abc.OStringProperty(said, "groom_tool").setValue(maker)
    Abc.OStringProperty(said, "groom_properties").setValue("")
    Abc.ODoubleProperty(said, "filoplume_metres_per_unit").setValue(metres_per_unit)
    Abc.OStringProperty(said, "filoplume_up").setValue(up)
    Abc.OStringProperty(said, "filoplume_name").setValue(name)
    for role, strands in bundles.items():
        _write_curves(parent, strands, role, up, metres_per_unit)
    if mesh is not None:
        _write_mesh(parent, mesh, up, metres_per_unit)


def _write_curves(parent: Any, strands: Strands, role: str, up: str, metres_per_unit: float) -> None:
    import imath
    from alembic3d import AbcGeom as Geom

    scope = Geom.GeometryScope
    schema = Geom.OCurves(Geom.OXform(parent, role), f"{role}Shape").getSchema()
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
        ids, weights = strands.guide_ids, strands.guide_weights
        param("V3i", "groom_closest_guides", scope.kUniformScope, _lend(imath.V3iArrayFromBuffer, ids))
        param("V3f", "groom_guide_weights", scope.kUniformScope, _lend(imath.V3fArrayFromBuffer, weights))
    if strands.widths is not None:
        centimetres = _lend(imath.FloatArrayFromBuffer, scaled(strands.widths, CENTIMETRES, divide=True))
        param("Float", "groom_width", scope.kVertexScope, centimetres)
    if strands.colors is not None:
        # vectors, not colours: Unreal asks for V3f, and Alembic tells the two apart
        param("V3f", "groom_color", scope.kVertexScope, _lend(imath.V3fArrayFromBuffer, strands.colors))


def _lend(from_buffer: Any, array: NDArray[Any]) -> Any:
    """An imath array of the rows of `array`; an empty one where there are none (buffers of nothing are refused)."""
    import imath

    if len(array):
        return from_buffer(np.ascontiguousarray(array))
    return getattr(imath, from_buffer.__name__.removesuffix("FromBuffer"))(0)


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
    Geom.OPolyMesh(Geom.OXform(parent, "mesh"), "meshShape").getSchema().set(sample)

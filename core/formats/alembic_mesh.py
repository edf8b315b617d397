"""Meshes of Alembic archives (.abc). The reader runs in a bounded child process.

Alembic winds its faces clockwise and knows no units; our own files say theirs in two user properties of the
top transform, ``filoplume_metres_per_unit`` and ``filoplume_up``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.mesh_pieces import pack, unique_names
from core.mesh.edges import reversed_corners
from core.mesh.mesh import Mesh
from core.mesh.polygons import Polygons

UNIT, UP = "filoplume_metres_per_unit", "filoplume_up"


def read_in_child(path: str) -> dict[str, Any]:
    """All polygon and subdivision meshes of the archive at its first sample, transforms applied (see ``pack``)."""
    from alembic3d import Abc, AbcGeom

    name = Path(path).name
    try:
        archive = Abc.IArchive(path)
    except Exception:  # its exceptions are of the C++ runtime
        raise UserError(f"{name} is not an Alembic file that can be read; export it again.") from None
    pieces: list[Polygons] = []
    said: dict[str, Any] = {}
    waiting = [(archive.getTop(), np.eye(4))]
    while waiting:
        parent, world = waiting.pop()
        for row in reversed(range(parent.getNumChildren())):
            child = parent.getChild(row)
            header, inner = child.getHeader(), world
            if AbcGeom.IXform.matches(header):
                schema = AbcGeom.IXform(parent, child.getName()).getSchema()
                sample = schema.getValue()
                local = np.array(sample.getMatrix(), np.float64).reshape(4, 4)
                inner = local @ world if sample.getInheritsXforms() else local
                read_properties(schema.getUserProperties(), said)
            waiting.append((child, inner))
        for kind in (AbcGeom.IPolyMesh, AbcGeom.ISubD):
            if parent.getParent() and kind.matches(parent.getHeader()):
                schema = kind(parent.getParent(), parent.getName()).getSchema()
                piece = _piece(schema, world, parent.getName())
                if piece is not None:
                    pieces.append(piece)
    if not pieces:
        raise UserError(f"{name} has no polygon meshes; export a mesh.")
    unit, up = said.get(UNIT), said.get(UP)
    return pack(
        unique_names(pieces),
        metres_per_unit=unit if isinstance(unit, float) else None,
        up=up if up in ("y", "z") else None,
    )


def write_alembic(path: Path, mesh: Mesh) -> None:
    """Write one mesh object for each part (only the first keeps all vertices that no face uses), metres, Y up."""
    from alembic3d import Abc, AbcGeom

    archive = Abc.CreateArchiveWithInfo(str(path), "Filoplume", "metres, Y up")
    top = AbcGeom.OXform(archive.getTop(), "model")
    said = top.getSchema().getUserProperties()
    Abc.ODoubleProperty(said, UNIT).setValue(1.0)
    Abc.OStringProperty(said, UP).setValue("y")
    used = [part for part in range(len(mesh.part_names)) if (mesh.parts == part).any()]
    names: dict[str, int] = {}
    for part in used:
        name = mesh.part_names[part].replace("/", "_") or "mesh"
        names[name] = names.get(name, 0) + 1
        name = name if names[name] == 1 else f"{name}_{names[name]}"
        faces = mesh.parts == part
        mask = np.repeat(faces, mesh.counts)
        corners = mesh.corners[mask]
        rows = np.arange(len(mesh.points)) if len(used) == 1 else np.unique(corners)
        uvs = None if mesh.uvs is None else mesh.uvs[mask]
        _write_mesh(top, name, mesh.points[rows], mesh.counts[faces], np.searchsorted(rows, corners), uvs)


def _write_mesh(
    parent: Any, name: str, points: NDArray[Any], counts: NDArray[Any], corners: NDArray[Any], uvs: NDArray[Any] | None
) -> None:
    import imath
    from alembic3d import AbcGeom

    order = reversed_corners(counts)
    uv_sample = AbcGeom.OV2fGeomParamSample()
    if uvs is not None:
        uv_sample = AbcGeom.OV2fGeomParamSample(
            imath.V2fArrayFromBuffer(np.ascontiguousarray(uvs[order])), AbcGeom.GeometryScope.kFacevaryingScope
        )
    sample = AbcGeom.OPolyMeshSchemaSample(
        imath.V3fArrayFromBuffer(np.ascontiguousarray(points, np.float32)),
        imath.IntArrayFromBuffer(np.ascontiguousarray(corners[order], np.int32)),
        imath.IntArrayFromBuffer(np.ascontiguousarray(counts, np.int32)),
        uv_sample,
    )
    AbcGeom.OPolyMesh(AbcGeom.OXform(parent, name), f"{name}Shape").getSchema().set(sample)


def read_properties(properties: Any, said: dict[str, Any], names: tuple[str, ...] = (UNIT, UP)) -> None:
    from alembic3d import Abc

    if properties.valid():
        for row in range(properties.getNumProperties()):
            header = properties.getPropertyHeader(row)
            if header.isScalar() and header.getName() in names:
                said.setdefault(header.getName(), Abc.IScalarProperty(properties, header.getName()).getValue())


def _piece(schema: Any, world: NDArray[np.float64], name: str) -> Polygons | None:
    if not schema.getNumSamples():
        return None
    sample = schema.getValue()
    points = np.array(sample.getPositions(), np.float64).reshape(-1, 3)
    counts = np.array(sample.getFaceCounts(), np.int64).reshape(-1)
    corners = np.array(sample.getFaceIndices(), np.int64).reshape(-1)
    if not len(points) or not len(counts) or counts.min() < 0 or counts.sum() != len(corners):
        return None
    uvs = _uvs(schema.getUVsParam(), corners, len(points))
    if not np.array_equal(world, np.eye(4)):
        points = points @ world[:3, :3] + world[3, :3]
    if np.linalg.det(world[:3, :3]) > 0:  # clockwise, so a mirrored one is already the right way round
        order = reversed_corners(counts)
        corners, uvs = corners[order], None if uvs is None else uvs[order]
    name = name.removesuffix("Shape") or name
    return Polygons(points, counts, corners, uvs, np.zeros(len(counts), np.int32), (name,))


def _uvs(param: Any, corners: NDArray[np.int64], vertices: int) -> NDArray[np.float32] | None:
    if not param.valid() or not param.getNumSamples():
        return None
    values = np.array(param.getExpandedValue().getVals(), np.float32).reshape(-1, 2)
    if len(values) == len(corners):
        return values
    if len(values) == vertices:
        return values[np.clip(corners, 0, vertices - 1)]
    return None

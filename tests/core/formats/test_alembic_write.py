"""Alembic grooms, read back property by property with the bare library, and failing writes."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from alembic3d import Abc, AbcGeom

from core.formats.curve_file import write_groom
from tests.core.formats.coat_samples import make_groom, make_mesh

SCALARS = {
    "groom_version_major": ("kInt16POD", 1), "groom_version_minor": ("kInt16POD", 5),
    "groom_tool": ("kStringPOD", None), "groom_properties": ("kStringPOD", ""),
}  # fmt: skip
PARAMS = {  # name: type, extent, scope, as the engine's specification has them
    "groom_guide": ("kInt16POD", 1, "con"), "groom_group_id": ("kInt32POD", 1, "con"),
    "groom_id": ("kInt32POD", 1, "uni"), "groom_root_uv": ("kFloat32POD", 2, "uni"),
    "groom_width": ("kFloat32POD", 1, "vtx"), "groom_color": ("kFloat32POD", 3, "vtx"),
    "groom_closest_guides": ("kInt32POD", 3, "uni"), "groom_guide_weights": ("kFloat32POD", 3, "uni"),
}  # fmt: skip


def curves_of(path, role):
    """The archive (which must stay alive), the bare schema of the curves and its parameters, arrays by name."""
    archive = Abc.IArchive(str(path))
    transform = archive.getTop().getChild(0).getChild(role)
    schema = AbcGeom.ICurves(transform, f"{role}Shape").getSchema()
    params = schema.getArbGeomParams()
    found = {}
    for k in range(params.getNumProperties()):
        header = params.getPropertyHeader(k)
        kind = header.getDataType()
        values = np.array(Abc.IArrayProperty(params, header.getName()).getValue())
        described = str(kind.getPod()).rpartition(".")[2], kind.getExtent(), header.getMetaData().get("geoScope")
        found[header.getName()] = (described, values)
    return archive, schema, found


@pytest.mark.parametrize("metres", [1.0, 0.01])
def test_the_archive_carries_the_groom_schema(tmp_path, metres):
    groom, path = make_groom(), tmp_path / "coat.abc"
    write_groom(path, groom, metres_per_unit=metres)
    for role in ("guides", "children"):
        ours = getattr(groom, role)
        _archive, schema, params = curves_of(path, role)
        expected = dict(PARAMS)
        if role == "guides":
            del expected["groom_closest_guides"], expected["groom_guide_weights"]
        assert {name: described for name, (described, _) in params.items()} == expected
        sample = schema.getValue()
        np.testing.assert_array_equal(sample.getCurvesNumVertices(), ours.counts)
        np.testing.assert_allclose(sample.getPositions(), ours.points / metres, rtol=1e-6)
        assert [str(v).rpartition(".")[2] for v in (sample.getType(), sample.getWrap())] == ["kLinear", "kNonPeriodic"]
        widths = schema.getWidthsParam()
        assert widths.getScope() == AbcGeom.GeometryScope.kVertexScope
        np.testing.assert_allclose(widths.getExpandedValue().getVals(), ours.widths / metres, rtol=1e-6)
        values = {name: array for name, (_, array) in params.items()}
        assert values["groom_guide"].tolist() == [int(role == "guides")]
        assert values["groom_group_id"].tolist() == [0]
        np.testing.assert_array_equal(values["groom_id"], ours.ids)
        np.testing.assert_array_equal(values["groom_root_uv"], ours.root_uvs)
        np.testing.assert_array_equal(values["groom_color"], ours.colors)
        np.testing.assert_allclose(values["groom_width"], ours.widths * 100.0, rtol=1e-6)  # always centimetres
        if role == "children":
            np.testing.assert_array_equal(values["groom_closest_guides"], ours.guide_ids)
            np.testing.assert_array_equal(values["groom_guide_weights"], ours.guide_weights)


def test_the_topmost_transform_says_version_and_tool(tmp_path):
    write_groom(tmp_path / "coat.abc", make_groom())
    archive = Abc.IArchive(str(tmp_path / "coat.abc"))
    top = archive.getTop()
    assert top.getNumChildren() == 1
    properties = AbcGeom.IXform(top, top.getChild(0).getName()).getSchema().getUserProperties()
    for name, (kind, value) in SCALARS.items():
        header = properties.getPropertyHeader(name)
        assert header.isScalar()
        assert str(header.getDataType().getPod()).endswith(kind)
        said = Abc.IScalarProperty(properties, name).getValue()
        assert said == value if value is not None else said.startswith("Filoplume")


def test_first_sample_points_of_the_mesh_turn_outwards_the_alembic_way(tmp_path):
    mesh = make_mesh()
    write_groom(tmp_path / "coat.abc", make_groom(), mesh)
    archive = Abc.IArchive(str(tmp_path / "coat.abc"))
    parent = archive.getTop().getChild(0).getChild("mesh")
    sample = AbcGeom.IPolyMesh(parent, "meshShape").getSchema().getValue()
    points, faces = np.array(sample.getPositions(), float), np.array(sample.getFaceIndices()).reshape(-1, 4)
    triangles = points[np.concatenate([faces[:, :3], faces[:, [0, 2, 3]]])]
    assert np.linalg.det(triangles).sum() / 6 == pytest.approx(-2)  # Alembic winds clockwise seen from outside
    uvs = AbcGeom.IPolyMesh(parent, "meshShape").getSchema().getUVsParam().getExpandedValue().getVals()
    corner = {tuple(uv): vertex for uv, vertex in zip(mesh.uvs.tolist(), mesh.corners.tolist(), strict=True)}
    assert [corner[tuple(uv)] for uv in np.array(uvs).tolist()] == faces.reshape(-1).tolist()


FULL = """
import resource, sys
from pathlib import Path
from core.errors import UserError
from core.formats.curve_file import write_groom
from tests.core.formats.coat_samples import make_groom
path, limit = Path(sys.argv[1]), int(sys.argv[2])
groom = make_groom(children=4000)
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
try:
    write_groom(path, groom)
except UserError as error:
    print("refused:", error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of file size need the resource module")
@pytest.mark.parametrize("suffix", [".abc", ".usdc", ".usda", ".usdz", ".hair"])
def test_a_full_disk_leaves_the_old_file_whole_and_the_program_alive(tmp_path, suffix):
    path = tmp_path / f"coat{suffix}"
    path.write_bytes(b"the old coat")
    # above the largest column, below the whole file
    answer = subprocess.run(
        [sys.executable, "-c", FULL, path, "300000"], capture_output=True, text=True, check=False
    )
    assert answer.stdout.startswith("refused: "), answer.stderr
    assert "save" in answer.stdout
    assert path.read_bytes() == b"the old coat"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]

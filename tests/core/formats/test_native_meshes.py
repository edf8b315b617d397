"""USD and Alembic meshes against scenes made with the libraries themselves."""

from __future__ import annotations

import numpy as np
import pytest

from core.formats.mesh_file import read_mesh

POINTS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)


def usd_mesh(stage, path, **attributes):
    from pxr import UsdGeom

    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(POINTS.tolist())
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    return mesh


def test_transforms_instances_hidden_and_proxy_prims(tmp_path):
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateNew(str(tmp_path / "t.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    stage.CreateClassPrim("/Prototype")
    usd_mesh(stage, "/Prototype/skin")
    for k in range(2):
        copy = UsdGeom.Xform.Define(stage, f"/copy{k}")
        copy.AddTranslateOp().Set((100.0 * k, 0.0, 0.0))
        copy.AddScaleOp().Set((1.0 - 2 * k, 1.0, 1.0))
        copy.GetPrim().GetReferences().AddInternalReference("/Prototype")
        copy.GetPrim().SetInstanceable(True)
    UsdGeom.Imageable(usd_mesh(stage, "/hidden")).MakeInvisible()
    usd_mesh(stage, "/proxy").CreatePurposeAttr(UsdGeom.Tokens.proxy)
    stage.Save()
    found = read_mesh(tmp_path / "t.usda")
    assert found.mesh.part_names == ("skin", "skin_2")
    np.testing.assert_allclose(found.mesh.points[:4], POINTS * 0.01, atol=1e-7)
    np.testing.assert_allclose(found.mesh.points[4:], POINTS * (-0.01, 0.01, 0.01) + (1, 0, 0), atol=1e-7)
    assert found.mesh.corners.tolist() == [0, 1, 2, 3, 7, 6, 5, 4]  # the mirrored one is turned over


@pytest.mark.parametrize(("interpolation", "values", "indices", "expected"), [
    ("faceVarying", [(0, 0), (1, 0), (1, 1), (0, 1)], None, [(0, 0), (1, 0), (1, 1), (0, 1)]),
    ("faceVarying", [(0.5, 0.5), (1, 1)], [0, 1, 1, 0], [(0.5, 0.5), (1, 1), (1, 1), (0.5, 0.5)]),
    ("vertex", [(0, 0), (1, 0), (1, 1), (0, 1)], None, [(0, 0), (1, 0), (1, 1), (0, 1)]),
    ("uniform", [(0.25, 0.75)], None, [(0.25, 0.75)] * 4),
    ("constant", [(0.25, 0.75)], None, [(0.25, 0.75)] * 4),
])  # fmt: skip
@pytest.mark.parametrize("name", ["st", "map9"])
def test_uv_primvars(interpolation, values, indices, expected, name, tmp_path):
    from pxr import Sdf, Usd, UsdGeom

    stage = Usd.Stage.CreateNew(str(tmp_path / "t.usdc"))
    primvar = UsdGeom.PrimvarsAPI(usd_mesh(stage, "/m")).CreatePrimvar(
        name, Sdf.ValueTypeNames.TexCoord2fArray, interpolation
    )
    primvar.Set(values)
    if indices is not None:
        primvar.SetIndices(indices)
    stage.Save()
    np.testing.assert_array_equal(read_mesh(tmp_path / "t.usdc").mesh.uvs, expected)


def test_animated_usd_is_read_at_its_earliest_time(tmp_path):
    from pxr import Usd

    stage = Usd.Stage.CreateNew(str(tmp_path / "t.usda"))
    mesh = usd_mesh(stage, "/m")
    mesh.GetPointsAttr().Clear()
    mesh.GetPointsAttr().Set((POINTS + 5).tolist(), 20.0)
    mesh.GetPointsAttr().Set((POINTS + 3).tolist(), 10.0)
    stage.Save()
    np.testing.assert_array_equal(read_mesh(tmp_path / "t.usda").mesh.points, POINTS + 3)


def test_alembic_transforms_winding_and_subdivision_surfaces(tmp_path):
    import imath
    from alembic3d import Abc, AbcGeom

    def archive():
        top = Abc.OArchive(str(tmp_path / "t.abc")).getTop()
        place = AbcGeom.OXform(top, "place")
        sample = AbcGeom.XformSample()
        sample.setTranslation(imath.V3d(10, 20, 30))
        place.getSchema().set(sample)
        points, counts = imath.V3fArray(4), imath.IntArray(1)
        index = imath.IntArray(4)
        counts[0] = 4
        for k in range(4):
            points[k] = imath.V3f(*map(float, POINTS[k]))
            index[k] = 3 - k  # clockwise, as Alembic has it
        AbcGeom.OPolyMesh(place, "poly").getSchema().set(AbcGeom.OPolyMeshSchemaSample(points, index, counts))
        AbcGeom.OSubD(top, "subd").getSchema().set(AbcGeom.OSubDSchemaSample(points, index, counts))

    archive()
    found = read_mesh(tmp_path / "t.abc", unit="cm", up="y")
    assert found.mesh.part_names == ("poly", "subd")
    np.testing.assert_allclose(found.mesh.points[:4], np.add(POINTS, (10, 20, 30)) * 0.01, rtol=1e-6)
    np.testing.assert_allclose(found.mesh.points[4:], POINTS * 0.01, rtol=1e-6)
    assert found.mesh.corners.tolist() == [0, 1, 2, 3, 4, 5, 6, 7]

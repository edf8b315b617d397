"""USD grooms, checked with OpenUSD's own eyes, and USD curves of other programs."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdValidation, Vt

from core.errors import UserError
from core.formats import usd_curves
from core.formats.curve_file import read_curve_file, read_groom, write_groom
from core.groom.strands import GroomStrands
from tests.core.formats.coat_samples import differing_columns, make_groom, make_mesh

READ = {"sandboxed": False}


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd", ".usdz"])
def test_everything_comes_back_to_the_bit(tmp_path, suffix):
    groom, path = make_groom(), tmp_path / f"coat{suffix}"
    write_groom(path, groom, make_mesh())
    file = read_curve_file(path)
    assert file.groom.name == groom.name
    assert differing_columns(groom.guides, file.groom.guides) == []
    assert differing_columns(groom.children, file.groom.children) == []
    assert (file.metres_per_unit, file.up, file.notes) == (1.0, "y", ())


def test_the_stage_says_what_other_programs_look_for(tmp_path):
    groom, path = make_groom(), tmp_path / "coat.usdc"
    write_groom(path, groom, make_mesh(), up="z", metres_per_unit=0.01)
    stage = Usd.Stage.Open(str(path))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.01
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert stage.GetDefaultPrim().GetPath() == "/Groom"
    assert stage.GetDefaultPrim().GetCustomDataByKey("filoplume")["version"].startswith("Filoplume")
    for role in ("guides", "children"):
        ours = getattr(groom, role)
        curves = UsdGeom.BasisCurves(stage.GetPrimAtPath(f"/Groom/winter_coat/{role}"))
        assert (curves.GetTypeAttr().Get(), curves.GetWrapAttr().Get()) == ("linear", "nonperiodic")
        assert curves.GetCurveCount() == len(ours)
        assert list(curves.GetCurveVertexCountsAttr().Get()) == ours.counts.tolist()
        points = np.array(curves.GetPointsAttr().Get())
        truth = np.stack([ours.points[:, 0], -ours.points[:, 2], ours.points[:, 1]], 1).astype(float) * 100
        np.testing.assert_allclose(points, truth, rtol=1e-6)
        np.testing.assert_allclose(curves.GetWidthsAttr().Get(), ours.widths * 100.0, rtol=1e-6)
        assert curves.GetWidthsInterpolation() == "vertex"
        extent = UsdGeom.BasisCurves.ComputeExtent(curves.GetPointsAttr().Get(), curves.GetWidthsAttr().Get())
        np.testing.assert_allclose(curves.GetExtentAttr().Get(), extent, rtol=1e-6)
        primvars = UsdGeom.PrimvarsAPI(curves)
        for name, kind, width in [("st", "texCoord2f[]", 1), ("id", "int[]", 1)] + [
            ("groom_closest_guides", "int[]", 3), ("groom_guide_weights", "float[]", 3)
        ] * (role == "children"):  # fmt: skip
            primvar = primvars.GetPrimvar(name)
            assert (primvar.GetInterpolation(), str(primvar.GetTypeName()), primvar.GetElementSize()) == (
                "uniform", kind, width)  # fmt: skip
            assert len(primvar.Get()) == width * len(ours)
        assert primvars.GetPrimvar("groom_guide").Get() == int(role == "guides")


def test_the_mesh_beside_the_coat_is_whole(tmp_path):
    mesh, path = make_mesh(), tmp_path / "coat.usda"
    write_groom(path, make_groom(), mesh)
    stage = Usd.Stage.Open(str(path))
    made = UsdGeom.Mesh(stage.GetPrimAtPath("/Groom/mesh"))
    np.testing.assert_array_equal(made.GetPointsAttr().Get(), mesh.points)
    np.testing.assert_array_equal(made.GetFaceVertexIndicesAttr().Get(), mesh.corners)
    st = UsdGeom.PrimvarsAPI(made).GetPrimvar("st")
    assert st.GetInterpolation() == "faceVarying"
    np.testing.assert_array_equal(st.Get(), mesh.uvs)
    subsets = {s.GetPrim().GetName(): list(s.GetIndicesAttr().Get()) for s in UsdGeom.Subset.GetAllGeomSubsets(made)}
    assert subsets == {"body": [0, 1, 2], "tail": [3, 4, 5]}


@pytest.mark.parametrize("suffix", [".usdc", ".usdz"])
def test_every_validator_of_openusd_is_content(tmp_path, suffix):
    path = tmp_path / f"coat{suffix}"
    write_groom(path, make_groom(), make_mesh())
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    stage = Usd.Stage.Open(str(path))
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [error.GetErrorAsString() for error in errors] == []


@pytest.mark.parametrize("name", ["", "mesh", "1st coat", "Fell/Ärmel", "a" * 300])
def test_any_name_survives(tmp_path, name):
    groom = GroomStrands(name=name, children=make_groom().children)
    write_groom(tmp_path / "coat.usda", groom, make_mesh())
    assert read_groom(tmp_path / "coat.usda", **READ).name == (name or "Groom")


def test_bare_strands_come_back_bare(tmp_path):
    bare = make_groom().children.replace(
        widths=None, ids=None, root_uvs=None, colors=None, guide_ids=None, guide_weights=None
    )
    write_groom(tmp_path / "coat.usda", GroomStrands(guides=bare))
    back = read_groom(tmp_path / "coat.usda", **READ)
    assert back.children is None
    assert differing_columns(bare, back.guides) == []


def stage_of(tmp_path, build):
    path = tmp_path / "other.usda"
    stage = Usd.Stage.CreateNew(str(path))
    build(stage)
    stage.Save()
    return path


def curves_prim(stage, path, points, counts, basis=None, wrap="nonperiodic"):
    curves = UsdGeom.BasisCurves.Define(stage, path)
    curves.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(points, np.float32)))
    curves.CreateCurveVertexCountsAttr(counts)
    curves.CreateTypeAttr("cubic" if basis else "linear")
    if basis:
        curves.CreateBasisAttr(basis)
    curves.CreateWrapAttr(wrap)
    return curves


LINE = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], np.float32)
HIGHER = LINE + np.float32([0, 1, 0])


def test_transforms_scale_turn_and_move_points_and_widths(tmp_path):
    def build(stage):
        UsdGeom.SetStageMetersPerUnit(stage, 0.01)
        UsdGeom.SetStageUpAxis(stage, "Z")
        parent = UsdGeom.Xform.Define(stage, "/a")
        parent.AddTranslateOp().Set(Gf.Vec3d(10, 0, 0))
        parent.AddScaleOp().Set(Gf.Vec3f(2))
        curves = curves_prim(stage, "/a/hair", LINE, [4])
        curves.AddRotateZOp().Set(90)
        curves.CreateWidthsAttr([0.5])
        curves.SetWidthsInterpolation("constant")

    hair = read_groom(stage_of(tmp_path, build), **READ).children
    # turned to +Y, doubled, moved to x = 10, then centimetres and Z up: (x, y, 0) is (x, 0, -y)
    np.testing.assert_allclose(hair.points, [[0.1, 0, -0.02 * k] for k in range(4)], atol=1e-7)
    np.testing.assert_allclose(hair.widths, 0.5 * 2 * 0.01, rtol=1e-6)


def test_cubic_curves_of_others_become_points_on_them(tmp_path):
    def build(stage):
        curves = curves_prim(stage, "/hair", np.concatenate([LINE, HIGHER]), [4, 4], "bezier")
        curves.CreateWidthsAttr([1, 2, 3, 4])
        curves.SetWidthsInterpolation("varying")

    hair = read_groom(stage_of(tmp_path, build), **READ).children
    np.testing.assert_allclose(hair.points.reshape(2, 4, 3)[1], HIGHER, atol=1e-6)
    np.testing.assert_allclose(hair.widths, [1, 4 / 3, 5 / 3, 2, 3, 10 / 3, 11 / 3, 4], rtol=1e-6)


def test_animation_gives_its_first_time(tmp_path):
    def build(stage):
        curves = curves_prim(stage, "/hair", LINE, [4])
        for time in (5, 9):
            curves.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(LINE + np.float32(time)), time)

    np.testing.assert_array_equal(read_groom(stage_of(tmp_path, build), **READ).children.points, LINE + 5)


def test_several_prims_join_and_guides_are_known_by_purpose_or_mark(tmp_path):
    def build(stage):
        curves_prim(stage, "/one", LINE, [4])
        curves_prim(stage, "/two", LINE, [2, 2])
        curves_prim(stage, "/three", LINE, [4]).CreatePurposeAttr("guide")
        marked = curves_prim(stage, "/four", LINE, [4])
        UsdGeom.PrimvarsAPI(marked).CreatePrimvar("groom_guide", Sdf.ValueTypeNames.IntArray, "constant").Set([1])

    groom = read_groom(stage_of(tmp_path, build), **READ)
    assert groom.children.counts.tolist() == [4, 2, 2]
    assert groom.guides.counts.tolist() == [4, 4]


def test_indexed_primvars_are_flattened(tmp_path):
    def build(stage):
        curves = curves_prim(stage, "/one", LINE, [2, 2])
        st = UsdGeom.PrimvarsAPI(curves).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "uniform")
        st.Set([(0.25, 0.5)])
        st.SetIndices([0, 0])

    assert read_groom(stage_of(tmp_path, build), **READ).children.root_uvs.tolist() == [[0.25, 0.5]] * 2


def test_unit_and_axis_are_asked_only_where_the_file_is_silent(tmp_path):
    path = stage_of(tmp_path, lambda stage: curves_prim(stage, "/one", LINE, [4]))
    assert len(read_curve_file(path, **READ).notes) == 2
    told = read_curve_file(path, unit="mm", up="z", **READ)
    assert told.notes == ()
    np.testing.assert_allclose(told.groom.children.points[:, 0], LINE[:, 0] * 0.001, rtol=1e-6)


def test_counts_that_do_not_fit_are_refused_in_one_sentence(tmp_path):
    path = stage_of(tmp_path, lambda stage: curves_prim(stage, "/one", LINE, [2**31 - 1, 2]))
    with pytest.raises(UserError, match="holds no curves"):
        read_groom(path)
    (tmp_path / "noise.usdc").write_bytes(b"PXR-USDC" + bytes(range(200)))
    with pytest.raises(UserError, match=r"^noise\.usdc is damaged"):
        read_groom(tmp_path / "noise.usdc")


def test_the_reader_of_the_child_answers_in_the_space_of_the_file(tmp_path):
    write_groom(tmp_path / "coat.usda", make_groom(), metres_per_unit=0.01)
    raw = usd_curves.read_in_child(str(tmp_path / "coat.usda"))
    assert (raw["metres_per_unit"], raw["up"]) == (0.01, "y")
    np.testing.assert_allclose(raw["guides.points"], make_groom().guides.points * 100.0, rtol=1e-6)

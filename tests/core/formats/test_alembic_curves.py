"""Alembic curves: ours to the bit, and those of other programs."""

from __future__ import annotations

import imath
import numpy as np
import pytest
from alembic3d import Abc, AbcGeom

from core.errors import UserError
from core.formats.curve_file import read_curve_file, read_groom, write_groom
from core.groom.strands import GroomStrands
from tests.core.formats.coat_samples import differing_columns, make_groom

READ = {"sandboxed": False}
LINE = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], np.float32)
Scope = AbcGeom.GeometryScope


def test_everything_comes_back_to_the_bit(tmp_path):
    groom, path = make_groom(name="winter/coat"), tmp_path / "coat.abc"
    write_groom(path, groom)
    file = read_curve_file(path)
    assert file.groom.name == groom.name
    assert differing_columns(groom.guides, file.groom.guides) == []
    assert differing_columns(groom.children, file.groom.children) == []
    assert (file.metres_per_unit, file.up, file.notes) == (1.0, "y", ())


@pytest.mark.parametrize(("metres", "up"), [(0.01, "y"), (1.0, "z"), (0.0254, "z")])
def test_other_spaces_are_said_in_the_file_and_undone(tmp_path, metres, up):
    groom, path = make_groom(), tmp_path / "coat.abc"
    write_groom(path, groom, up=up, metres_per_unit=metres)
    file = read_curve_file(path, **READ)
    assert (file.metres_per_unit, file.up, file.notes) == (metres, up, ())
    np.testing.assert_allclose(file.groom.children.points, groom.children.points, rtol=3e-7)
    np.testing.assert_allclose(file.groom.children.widths, groom.children.widths, rtol=3e-7)


def test_bare_and_empty_bundles_survive(tmp_path):
    bare = make_groom().children.replace(
        widths=None, ids=None, root_uvs=None, colors=None, guide_ids=None, guide_weights=None
    )
    write_groom(tmp_path / "coat.abc", GroomStrands(guides=bare))
    back = read_groom(tmp_path / "coat.abc", **READ)
    assert back.children is None
    assert differing_columns(bare, back.guides) == []


def other_archive(path, build):
    archive = Abc.OArchive(str(path))
    build(archive.getTop())
    return path


def add_curves(parent, name, points, counts, kind="kLinear", basis="kNoBasis", wrap="kNonPeriodic", widths=None):
    schema = AbcGeom.OCurves(parent, name).getSchema()
    width = AbcGeom.OFloatGeomParamSample()
    if widths is not None:
        width = AbcGeom.OFloatGeomParamSample(imath.FloatArrayFromBuffer(np.float32(widths[0])), widths[1])
    schema.set(AbcGeom.OCurvesSchemaSample(
        imath.V3fArrayFromBuffer(np.ascontiguousarray(points, np.float32)), imath.IntArrayFromBuffer(np.int32(counts)),
        getattr(AbcGeom.CurveType, kind), getattr(AbcGeom.CurvePeriodicity, wrap), width,
        AbcGeom.OV2fGeomParamSample(), AbcGeom.ON3fGeomParamSample(), getattr(AbcGeom.BasisType, basis),
    ))  # fmt: skip
    return schema


def test_transforms_apply_from_the_innermost_out(tmp_path):
    def build(top):
        moved = AbcGeom.OXform(top, "moved")
        sample = AbcGeom.XformSample()
        sample.setTranslation(imath.V3d(10, 0, 0))
        sample.setScale(imath.V3d(2, 2, 2))
        moved.getSchema().set(sample)
        turned = AbcGeom.OXform(moved, "turned")
        sample = AbcGeom.XformSample()
        sample.setZRotation(90)
        turned.getSchema().set(sample)
        add_curves(turned, "hair", LINE, [4], widths=([0.5], Scope.kConstantScope))

    hair = read_groom(other_archive(tmp_path / "other.abc", build), unit="m", up="y", **READ).children
    np.testing.assert_allclose(hair.points, [[10, 2 * k, 0] for k in range(4)], atol=1e-6)
    np.testing.assert_allclose(hair.widths, 1.0, rtol=1e-6)


def test_bases_and_scopes_of_others(tmp_path):
    def build(top):
        add_curves(top, "a", LINE, [4], "kCubic", "kCatmullromBasis")
        add_curves(top, "b", LINE, [4], "kCubic", "kBezierBasis")
        add_curves(top, "c", LINE, [4], wrap="kPeriodic")
        add_curves(top, "d", LINE, [2, 2], widths=([3, 4], Scope.kUniformScope))
        add_curves(top, "e", LINE, [4], "kCubic", "kHermiteBasis")

    file = read_curve_file(other_archive(tmp_path / "other.abc", build), **READ)
    hair = file.groom.children
    assert hair.counts.tolist() == [2, 4, 5, 2, 2, 4]
    np.testing.assert_allclose(hair.points[:, 0], [1, 2, *range(4), *range(4), 0, *range(4), *range(4)], atol=1e-6)
    assert any("/e" in note for note in file.notes)
    assert hair.widths is None
    only = other_archive(tmp_path / "d.abc", lambda top: add_curves(
        top, "d", LINE, [2, 2], widths=([3, 4], Scope.kUniformScope)))  # fmt: skip
    assert read_groom(only, **READ).children.widths.tolist() == [3, 3, 4, 4]


def test_guides_may_be_marked_curve_by_curve(tmp_path):
    def build(top):
        params = add_curves(top, "hair", np.concatenate([LINE, LINE + 1]), [2, 4, 2]).getArbGeomParams()
        for kind, name, values in [("Char", "groom_guide", [0, 1, 0]), ("Int32", "groom_id", [7, 8, 9])]:
            made = getattr(AbcGeom, f"O{kind}GeomParam")(params, name, False, Scope.kUniformScope, 1)
            array = imath.SignedCharArray(3) if kind == "Char" else imath.IntArray(3)
            for k, value in enumerate(values):
                array[k] = value
            made.set(getattr(AbcGeom, f"O{kind}GeomParamSample")(array, Scope.kUniformScope))

    groom = read_groom(other_archive(tmp_path / "other.abc", build), **READ)
    assert (groom.guides.ids.tolist(), groom.children.ids.tolist()) == ([8], [7, 9])
    np.testing.assert_array_equal(groom.guides.points, np.concatenate([LINE[2:], LINE[:2] + 1]))


def test_a_plain_archive_is_metres_and_y_with_a_word_about_it(tmp_path):
    path = other_archive(tmp_path / "other.abc", lambda top: add_curves(top, "hair", LINE, [4]))
    file = read_curve_file(path, **READ)
    assert len(file.notes) == 2
    np.testing.assert_array_equal(file.groom.children.points, LINE)
    told = read_groom(path, unit="cm", up="z", **READ).children
    np.testing.assert_allclose(told.points[:, 0], LINE[:, 0] * 0.01, rtol=1e-6)


@pytest.mark.parametrize("damage", ["noise", "cut", "empty"])
def test_damaged_archives_are_refused_in_one_sentence(tmp_path, damage):
    path = tmp_path / "coat.abc"
    write_groom(path, make_groom())
    whole = path.read_bytes()
    damaged = {"noise": whole[:200] + bytes(len(whole) - 200), "cut": whole[: len(whole) // 2], "empty": b""}
    path.write_bytes(damaged[damage])
    with pytest.raises(UserError, match=r"^coat\.abc is damaged"):
        read_groom(path)

"""UsdSkel stages made here: two skeletons, several clips, merged shapes; and stages that contradict themselves."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

from core.document import Document, MeshObject
from core.errors import UserError
from core.formats.project import read_project, write_project
from core.formats.rig_file import read_rig
from core.formats.usd_skel_write import write
from core.pose.clip import numbers_at
from core.pose.layers import Sculpt, build
from core.pose.pose import Pose
from core.pose.rig import playing
from core.pose.skinning import posed_points
from core.pose.synthesis import evaluate

POINTS = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


class Made:
    """A stage with one skeleton of two joints, one square of mesh, and what the test adds."""

    def __init__(self, tmp_path, name="rig.usda"):
        self.path = tmp_path / name
        self.stage = Usd.Stage.CreateNew(str(self.path))
        UsdGeom.SetStageMetersPerUnit(self.stage, 1.0)
        UsdGeom.SetStageUpAxis(self.stage, UsdGeom.Tokens.y)
        UsdSkel.Root.Define(self.stage, "/r")
        self.skel = self.skeleton("skel", ["a", "a/b"])
        self.mesh = self.square("mesh", self.skel)

    def skeleton(self, name, joints):
        skel = UsdSkel.Skeleton.Define(self.stage, f"/r/{name}")
        skel.CreateJointsAttr(joints)
        up = [Gf.Matrix4d().SetTranslate(Gf.Vec3d(0, 1 if "/" in j else 0, 0)) for j in joints]
        skel.CreateRestTransformsAttr(up)
        skel.CreateBindTransformsAttr(up)
        UsdSkel.BindingAPI.Apply(skel.GetPrim())
        return skel

    def square(self, name, skel):
        mesh = UsdGeom.Mesh.Define(self.stage, f"/r/{name}")
        mesh.CreatePointsAttr(POINTS)
        mesh.CreateFaceVertexCountsAttr([4])
        mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
        if skel is not None:
            binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
            binding.CreateSkeletonRel().SetTargets([skel.GetPath()])
            binding.CreateJointIndicesPrimvar(False, 1).Set([1] * 4)
            binding.CreateJointWeightsPrimvar(False, 1).Set([1.0] * 4)
        return mesh

    def anim(self, name, skel=None, joints=("a", "a/b"), at=((1, 0.0), (3, 2.0)), shapes=None):
        anim = UsdSkel.Animation.Define(self.stage, f"/r/{name}")
        if joints:
            anim.CreateJointsAttr(list(joints))
            anim.CreateRotationsAttr([Gf.Quatf(1)] * len(joints))
            anim.CreateScalesAttr([Gf.Vec3h(1)] * len(joints))
            for frame, x in at:
                anim.CreateTranslationsAttr().Set([Gf.Vec3f(x, 0, 0)] + [Gf.Vec3f(0, 1, 0)] * (len(joints) - 1), frame)
        for shape, frame, weight in shapes or ():
            anim.CreateBlendShapesAttr([shape])
            anim.CreateBlendShapeWeightsAttr().Set([weight], frame)
        if skel is not None:
            UsdSkel.BindingAPI(skel.GetPrim()).CreateAnimationSourceRel().SetTargets([anim.GetPath()])
        return anim

    def shape(self, mesh, name, offsets, rows=None, between=None):
        made = UsdSkel.BlendShape.Define(self.stage, f"{mesh.GetPath()}/{name}")
        made.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.float32(offsets)))
        if rows is not None:
            made.CreatePointIndicesAttr(rows)
        for weight, values in (between or {}).items():
            inside = made.CreateInbetween(f"w{round(weight * 100)}")
            inside.SetWeight(weight)
            inside.SetOffsets(Vt.Vec3fArray.FromNumpy(np.float32(values)))
        binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
        had = list(binding.GetBlendShapesAttr().Get() or [])
        binding.CreateBlendShapesAttr([*had, name])
        binding.CreateBlendShapeTargetsRel().AddTarget(made.GetPath())

    def read(self, **words):
        self.stage.Save()
        return read_rig(self.path, **words)


def test_several_clips_bound_ones_first(tmp_path):
    made = Made(tmp_path)
    made.anim("run", at=((10, 0.0), (14, 8.0)))
    made.anim("walk", made.skel)
    found = made.read()
    assert [(c.name, c.start, c.end, c.frames_per_second) for c in found.clips] == [
        ("walk", 1.0, 3.0, 24.0), ("run", 10.0, 14.0, 24.0)]
    run = playing(found.rig, "run")
    for rig, frame in ((run, 11), (found.rig, 3)):
        moved = posed_points(found.mesh.points, rig, frame) - found.mesh.points
        assert np.allclose(moved, [2, 0, 0], atol=1e-6)


def test_two_skeletons_and_a_mesh_of_none(tmp_path):
    made = Made(tmp_path)
    other = made.skeleton("other", ["a", "a/c"])
    made.square("second", other)
    made.square("prop", None)
    made.anim("one", made.skel)
    made.anim("two", other, joints=("a",), at=((1, 0.0), (5, 4.0)))
    found = made.read()
    names = found.rig.skeleton.names
    assert names[-1] == "still"
    assert {"b", "c"} < set(names)
    assert len(set(names)) == 5
    assert [(c.name, c.end) for c in found.clips] == [("one", 5.0)]
    now = posed_points(found.mesh.points, found.rig, 3) - found.mesh.points
    by_part = [now[found.mesh.corners[4 * k : 4 * k + 4]] for k in range(3)]
    xs = dict(zip([found.mesh.part_names[p] for p in found.mesh.parts], [part[0, 0] for part in by_part]))
    assert xs == {"mesh": pytest.approx(2.0), "second": pytest.approx(2.0), "prop": pytest.approx(0.0)}


def test_a_shape_of_one_name_moves_all_its_meshes_with_inbetweens(tmp_path):
    made = Made(tmp_path)
    second = made.square("second", made.skel)
    made.shape(made.mesh, "smile", [[0, 0, 1]], [2], {0.5: [[0, 0, 4]]})
    made.shape(second, "smile", [[0, 2, 0]] * 4)
    made.anim("talk", made.skel, shapes=(("smile", 1, 0.0), ("smile", 5, 1.0)))
    found = made.read()
    assert found.rig.shapes.names == ("smile",)
    assert found.rig.shapes.at.tolist() == [0.5, 1.0]
    assert numbers_at(found.clips[0], 3) == {"smile": pytest.approx(0.5)}
    still = playing(found.rig, None)
    assert [c.name for c in still.clips] == ["talk"]
    moved = posed_points(found.mesh.points, found.rig, 3) - posed_points(found.mesh.points, found.rig.replace(
        shapes=None, controls=()), 3)
    assert np.abs(np.sort(moved[:, 2]) - np.sort([0] * 7 + [4])).max() < 1e-6
    assert np.abs(np.sort(moved[:, 1]) - np.sort([0] * 4 + [1] * 4)).max() < 1e-6


def wrong_counts(made):
    UsdSkel.BindingAPI(made.mesh.GetPrim()).GetJointWeightsPrimvar().Set([1.0] * 3)


def twice(made):
    made.skel.GetJointsAttr().Set(["a", "a"])


def short_rest(made):
    made.skel.GetRestTransformsAttr().Set([Gf.Matrix4d(1)])


def nowhere(made):
    made.skel.GetRestTransformsAttr().Clear()
    made.skel.GetBindTransformsAttr().Clear()


def flat(made):
    UsdGeom.Xformable(made.skel).AddScaleOp().Set(Gf.Vec3f(0, 1, 1))


@pytest.mark.parametrize(("change", "said"), [
    (wrong_counts, "4 joint indices and 3 weights"), (twice, "names a joint twice"),
    (short_rest, "1 rest transforms for 2 joints"), (nowhere, "where its joints are"), (flat, "scaled to nothing"),
])
def test_what_contradicts_itself_is_refused_in_a_sentence(tmp_path, change, said):
    made = Made(tmp_path)
    change(made)
    with pytest.raises(UserError, match=said) as error:
        made.read()
    assert "rig.usda" in str(error.value)


def no_parent(made):
    made.skel.GetJointsAttr().Set(["a", "x/b"])


def no_rest(made):
    made.skel.GetRestTransformsAttr().Clear()


def no_bind(made):
    made.skel.GetBindTransformsAttr().Clear()


def bad_joint(made):
    UsdSkel.BindingAPI(made.mesh.GetPrim()).GetJointIndicesPrimvar().Set([1, 7, -2, 0])


def bad_shape(made):
    made.shape(made.mesh, "smile", [[0, 0, 1]], [9])


def lost_shape(made):
    made.shape(made.mesh, "smile", [[0, 0, 1]], [2])
    made.stage.RemovePrim("/r/mesh/smile")


@pytest.mark.parametrize(("change", "said"), [
    (no_parent, "became roots"), (no_rest, "no rest pose"), (no_bind, "no bind pose"),
    (bad_joint, "joints that do not exist"), (bad_shape, "does not fit the mesh"), (lost_shape, "is missing"),
])
def test_what_can_be_guessed_is_repaired_with_a_word(tmp_path, change, said):
    made = Made(tmp_path)
    change(made)
    found = made.read()
    assert any(said in note for note in found.notes), found.notes
    assert np.isfinite(posed_points(found.mesh.points, found.rig, 1)).all()
    assert len(found.rig.skeleton.names) == 2


def test_noise_is_refused(tmp_path):
    for name, data in (("a.usda", b"#usda 1.0\n(\n"), ("b.usdc", b"PXR-USDC" + bytes(400)), ("c.usdz", b"PK\3\4" * 50)):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(UserError, match=name):
            read_rig(tmp_path / name)


def test_meshes_skinned_in_two_ways_move_as_usdskel_moves_each(tmp_path):
    """Sculpts are met on both, and a project, a USD of ours and the runtime file keep what is skinned how."""
    made = Made(tmp_path)
    other = made.square("other", made.skel)
    rng = np.random.default_rng(5)
    for mesh in (made.mesh, other):
        binding = UsdSkel.BindingAPI(mesh.GetPrim())
        shares = rng.uniform(0.2, 0.8, 4)
        binding.CreateJointIndicesPrimvar(False, 2).Set([0, 1] * 4)
        binding.CreateJointWeightsPrimvar(False, 2).Set(np.stack([shares, 1 - shares], axis=1).reshape(-1).tolist())
    UsdSkel.BindingAPI(other.GetPrim()).CreateSkinningMethodAttr(UsdSkel.Tokens.dualQuaternion)
    anim = made.anim("anim", made.skel)
    turns = [[Gf.Quatf(1), Gf.Quatf(float(np.cos(a)), Gf.Vec3f(0, float(np.sin(a)), 0))] for a in (0.2, 1.3)]
    for frame, turn in zip((1, 3), turns):
        anim.CreateRotationsAttr().Set(turn, frame)
    made.stage.Save()
    found = read_rig(made.path)
    rig, points = found.rig, found.mesh.points
    assert rig.skinning == "mixed"
    assert rig.dual.sum() == 4
    cache, there = UsdSkel.Cache(), np.arange(8) if rig.file_vertices is None else rig.file_vertices
    cache.Populate(UsdSkel.Root(made.stage.GetPrimAtPath("/r")), Usd.PrimDefaultPredicate)
    skeleton = cache.GetSkelQuery(made.skel)
    for frame in (1, 2, 3):
        ours = posed_points(points, rig, frame)[there]
        for k, mesh in enumerate((made.mesh, other)):
            query = cache.GetSkinningQuery(mesh.GetPrim())
            truth = Vt.Vec3fArray.FromNumpy(POINTS)
            assert query.ComputeSkinnedPoints(skeleton.ComputeSkinningTransforms(frame), truth, frame)
            assert np.abs(ours[4 * k : 4 * k + 4] - np.array(truth)).max() < 1e-6
    pose = Pose(name="twisted", rotations={"b": (0.0, 0.8, 0.0, 0.6)})
    target = evaluate(points, rig, None, pose) + rng.normal(size=(len(points), 3)).astype(np.float32)
    layers = build(points, rig, [Sculpt(pose, target)]).correctives
    assert np.abs(evaluate(points, rig, layers, pose) - target).max() < 1e-5
    item = MeshObject(id=1, name="two", mesh=found.mesh, rig=rig, correctives=layers)
    write_project(tmp_path / "two.filo", Document(meshes=(item,)))
    notes = write(tmp_path / "two.usda", item, 24)
    assert "two ways" in notes[-1]
    again = read_rig(tmp_path / "two.usda")
    kept = read_project(tmp_path / "two.filo").document.meshes[0]
    for mesh, one, corrections in ((again.mesh, again.rig, again.correctives), (kept.mesh, kept.rig, kept.correctives)):
        assert np.array_equal(one.dual, rig.dual)
        assert np.abs(evaluate(mesh.points, one, corrections, pose) - target).max() < 1e-5

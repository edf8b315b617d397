"""Every rig of the shared data is read and moves as its own library says: UsdSkel's baked points, glTF by the book."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

from app.inspection import describe
from core.errors import UserError
from core.formats.rig_assembly import NoRig
from core.formats.rig_file import READ_SUFFIXES, read_rig
from core.pose.clip import local_matrices, numbers_at
from core.pose.rig import Rig, all_clips, playing
from core.pose.skinning import deformed, posed_points
from tests.contract.hostile import gltf_files
from tests.core.formats.gltf_truth import gltf_points

DATA = Path(os.environ.get("FILOPLUME_DATA", "../shared/data"))
ANIMATION = DATA / "animation"
BAKE = ANIMATION / "usdskel_bake/usdSkel/testenv/testUsdSkelBakeSkinning"
RIGS = sorted(p.relative_to(ANIMATION).as_posix() for p in ANIMATION.rglob("*") if p.suffix in READ_SUFFIXES)
BARE = ("badSkelBindingAPIApplied.usda", "badSkelBindingNoSkelRoot.usda")

pytestmark = pytest.mark.skipif(not ANIMATION.is_dir(), reason="the shared data are not there")


def in_file_order(rig: Rig, points: np.ndarray) -> np.ndarray:
    return points if rig.file_vertices is None else points[rig.file_vertices]


@pytest.mark.parametrize("name", RIGS)
def test_it_is_read_and_stays_finite(name):
    if name.endswith(BARE):
        with pytest.raises(NoRig, match=r"no skeleton"):
            read_rig(ANIMATION / name)
        return
    said: list[str] = []
    found = read_rig(ANIMATION / name, say=said.append)
    assert tuple(said) == found.notes
    assert found.clips == all_clips(found.rig)
    if found.mesh is None:
        assert found.rig.skeleton.names
        return
    assert len(found.mesh.points) == len(found.rig.skin.joints)
    size = np.ptp(found.mesh.points, axis=0).max()
    for clip in found.clips:
        rig = playing(found.rig, clip.name)
        for frame in np.linspace(clip.start, clip.end, 5):
            points = posed_points(found.mesh.points, rig, frame)
            assert np.isfinite(points).all()
            assert np.ptp(points, axis=0).max() < 10 * size


BAKED = [
    ("lbs.usda", "lbs.baked.usda"), ("dqs.usda", "dqs.baked.usda"), ("lbs.usda", "lbs.bakedInterval.usda"),
    ("dqs.usda", "dqs.bakedInterval.usda"), ("blendshapes.usda", "blendshapes.baked.usda"),
    ("blendshapesWithNormals.usda", "blendshapesWithNormals.baked.usda"),
]  # fmt: skip


def baked_points(path: Path, frame: float) -> np.ndarray:
    """The points of all meshes of a stage at a time, in its space, one mesh after another."""
    stage = Usd.Stage.Open(str(path))
    rows = []
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            world = np.array(UsdGeom.Imageable(prim).ComputeLocalToWorldTransform(frame))
            rows.append(np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(frame)) @ world[:3, :3] + world[3, :3])
    return np.concatenate(rows)


@pytest.mark.parametrize(("source", "baked"), BAKED)
def test_every_frame_is_as_usdskel_baked_it(source, baked):
    found = read_rig(BAKE / source)
    stage = Usd.Stage.Open(str(BAKE / "baseline" / baked))
    times = sorted({
        t for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)
        for t in UsdGeom.Mesh(prim).GetPointsAttr().GetTimeSamples()
    })
    assert len(times) > 9
    worst = moved = 0.0
    still = in_file_order(found.rig, found.mesh.points)
    truths = [baked_points(BAKE / "baseline" / baked, time) for time in times]
    if found.up == "z":
        truths = [truth[:, [0, 2, 1]] * [1, 1, -1] for truth in truths]
    own = np.ones(len(still), bool)
    if source == "blendshapes.usda":  # its first mesh is the truth of the second, and no part of the rig
        own[: len(still) // 2] = False
    for time, truth in zip(times, truths):
        points = in_file_order(found.rig, posed_points(found.mesh.points, found.rig, time))
        worst = max(worst, np.abs(points - truth)[own].max() / np.ptp(truth, axis=0).max())
        moved = max(moved, np.abs(points - still)[own].max())
    assert worst <= 1e-5
    assert moved > 0.1 or source == "blendshapesWithNormals.usda"  # whose shapes move its normals alone


GLTF = [n for n in RIGS if n.endswith(("gltf", "glb")) and "quad_skin" not in n]


@pytest.mark.parametrize("name", GLTF)
def test_every_clip_is_as_the_specification_says(name):
    found = read_rig(ANIMATION / name)
    for number, clip in enumerate(found.clips):
        rig = playing(found.rig, clip.name)
        moved = 0.0
        for frame in np.unique(np.linspace(clip.start, clip.end, 14).round()):
            points = in_file_order(rig, posed_points(found.mesh.points, rig, frame))
            truth = gltf_points(ANIMATION / name, number, frame / clip.frames_per_second)
            assert np.abs(points - truth).max() <= 1e-5 * np.ptp(truth, axis=0).max()
            moved = max(moved, np.abs(points - in_file_order(rig, found.mesh.points)).max())
        assert moved > 1e-3


def test_hair_beside_a_rig_does_not_hide_its_controls():
    found = describe(BAKE / "dqs.usda")
    assert found["kind"] == "groom"
    assert found["controls"] == ["joint1", "joint2", "joint3"]


def test_a_foxs_seams_are_welded_and_its_own_order_is_kept():
    found = read_rig(ANIMATION / "fox_gltf/animated/Fox.glb")
    assert len(found.rig.file_vertices) == 1728
    assert len(found.mesh.points) < 400
    assert {clip.name for clip in found.clips} == {"Survey", "Walk", "Run"}
    with pytest.raises(UserError, match="Survey"):
        playing(found.rig, "Gallop")


def test_numbers_of_a_clip_drive_the_shapes():
    found = read_rig(BAKE / "blendshapes.usda")
    clip = found.clips[0]
    numbers = numbers_at(clip, 6)
    assert numbers["targetC"] == pytest.approx(0.5)
    by_hand = deformed(found.mesh.points, found.rig, local_matrices(clip, 6), {"targetC": 0.5})
    assert np.allclose(by_hand, posed_points(found.mesh.points, found.rig, 6), atol=1e-6)
    dial = found.rig.controls[2]
    assert (dial.name, dial.rest, dial.low, dial.high) == ("targetC", 0.0, 0.0, 1.5)


def test_usd_with_eight_influences_scaled_root_and_z_up(tmp_path):
    """A stage made here: its own SkinningQuery is the truth, through units, axes and a transform above the skeleton."""
    rng = np.random.default_rng(3)
    stage = Usd.Stage.CreateNew(str(tmp_path / "rig.usda"))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    stage.SetTimeCodesPerSecond(30)
    root = UsdSkel.Root.Define(stage, "/r")
    UsdGeom.Xformable(root).AddTransformOp().Set(
        Gf.Matrix4d().SetScale(3.0) * Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 2, 3), 40))
        * Gf.Matrix4d().SetTranslate(Gf.Vec3d(4, 5, 6)))
    skel = UsdSkel.Skeleton.Define(stage, "/r/skel")
    tokens = ["a", "a/b", "a/b/c", "a/d", "a/d/e", "f", "f/g", "f/h", "f/h/i", "f/h/i/j"]
    skel.CreateJointsAttr(tokens)

    def some():
        q = Gf.Quatd(*rng.normal(size=4)).GetNormalized()
        return (Gf.Matrix4d().SetScale(Gf.Vec3d(*rng.uniform(0.5, 2, 3))) * Gf.Matrix4d().SetRotate(q)
                * Gf.Matrix4d().SetTranslate(Gf.Vec3d(*rng.normal(size=3) * 10)))

    skel.CreateRestTransformsAttr([some() for _ in tokens])
    skel.CreateBindTransformsAttr([some() for _ in tokens])
    anim = UsdSkel.Animation.Define(stage, "/r/anim")
    order = tokens[::-1]
    anim.CreateJointsAttr(order)
    for frame in (10, 20):
        anim.CreateTranslationsAttr().Set([Gf.Vec3f(*rng.normal(size=3) * 10) for _ in order], frame)
        anim.CreateRotationsAttr().Set([Gf.Quatf(Gf.Quatd(*rng.normal(size=4)).GetNormalized()) for _ in order], frame)
        anim.CreateScalesAttr().Set([Gf.Vec3h(*rng.uniform(0.5, 2, 3)) for _ in order], frame)
    UsdSkel.BindingAPI.Apply(skel.GetPrim()).CreateAnimationSourceRel().SetTargets([anim.GetPath()])
    mesh = UsdGeom.Mesh.Define(stage, "/r/mesh")
    points = (rng.normal(size=(60, 3)) * 20).astype(np.float32)
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr([3] * 20)
    mesh.CreateFaceVertexIndicesAttr(list(range(60)))
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skel.GetPath()])
    binding.CreateGeomBindTransformAttr(some())
    mine = [tokens[k] for k in (9, 3, 5, 0, 7, 2, 8, 1, 4)]
    binding.CreateJointsAttr(mine)
    binding.CreateJointIndicesPrimvar(False, 8).Set(np.argsort(rng.random((60, 9)), axis=1)[:, :8].ravel().tolist())
    binding.CreateJointWeightsPrimvar(False, 8).Set(rng.dirichlet(np.ones(8), 60).ravel().tolist())
    stage.Save()

    cache = UsdSkel.Cache()
    cache.Populate(root, Usd.TraverseInstanceProxies())
    found = read_rig(tmp_path / "rig.usda")
    assert found.rig.skin.joints.shape[1] == 8
    assert (found.metres_per_unit, found.up, found.clips[0].frames_per_second) == (0.01, "z", 30.0)
    world = np.array(UsdGeom.Imageable(skel).ComputeLocalToWorldTransform(0))
    for frame in (10, 20):
        query, skinning = cache.GetSkelQuery(skel), cache.GetSkinningQuery(mesh.GetPrim())
        truth = Vt.Vec3fArray.FromNumpy(points.copy())
        assert skinning.ComputeSkinnedPoints(query.ComputeSkinningTransforms(frame), truth, frame)
        truth = (np.array(truth, np.float64) @ world[:3, :3] + world[3, :3]) * 0.01
        truth = truth[:, [0, 2, 1]] * [1, 1, -1]
        points_now = posed_points(found.mesh.points, found.rig, frame)
        assert np.abs(points_now - truth).max() <= 2e-5 * np.ptp(truth, axis=0).max()


@pytest.mark.parametrize("path", sorted(ANIMATION.rglob("*.fbx")), ids=lambda p: p.name)
def test_fbx_is_refused_in_a_sentence(path):
    with pytest.raises(UserError, match="is an FBX file, which is not read; export the rig as USD or glTF"):
        read_rig(path)


@pytest.mark.parametrize(("name", "data"), sorted(gltf_files().items()), ids=lambda x: x if isinstance(x, str) else "")
def test_hostile_gltf_is_read_or_refused(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    try:
        found = read_rig(tmp_path / name)
    except UserError:
        return
    assert found.mesh is not None


@pytest.mark.parametrize("name", [
    "fox_gltf/animated/Fox.glb", "morph_gltf_assimp/simple_skin/simple_skin.gltf", "libigl_skin_A/arm.tgf",
    "morph_gltf_assimp/simple_skin/quad_skin.glb",
])
def test_damaged_copies_are_read_or_refused(tmp_path, name):
    rng = np.random.default_rng(7)
    whole = (ANIMATION / name).read_bytes()
    path = tmp_path / Path(name).name
    for number in range(120):
        data = bytearray(whole)
        head = min(len(data), 40_000)
        for at in rng.integers(0, head, 1 + number % 8):
            data[at] = rng.choice([0, 45, 48, 57, 91, 123, 125, 255, int(rng.integers(256))])
        path.write_bytes(data[: rng.integers(1, len(data))] if number % 5 == 0 else data)
        try:
            found = read_rig(path)
        except UserError:
            continue
        if found.mesh is not None:
            assert np.isfinite(posed_points(found.mesh.points, found.rig, 3)).all()

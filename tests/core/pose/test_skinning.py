"""Truths: UsdSkel's own skinning, closed forms of one and two joints, and rigid motion."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.pose.clip import local_matrices
from core.pose.rig import Control, Rig, control_names, playing
from core.pose.skeleton import Clip, Skeleton, SkinWeights
from core.pose.skinning import moved_number, object_matrices, posed_points, skin_matrices
from core.transform import compose, transform_points
from core.workers import Workers

rng = np.random.default_rng(3)


def some_rig(joints=5, vertices=400, frames=4, influences=3):
    parents = np.array([-1, *[int(rng.integers(0, j)) for j in range(1, joints)]], np.int32)
    q = Rotation.random(joints, random_state=2).as_quat()
    rest = compose(rng.normal(size=(joints, 3)), q, rng.uniform(0.5, 2, (joints, 3)))
    names = tuple(f"j{i}" for i in range(joints))
    plain = Skeleton(names=names, parents=parents, rest=rest, bind=np.tile(np.eye(4), (joints, 1, 1)))
    skeleton = plain.replace(bind=object_matrices(plain, rest))
    weights = rng.dirichlet(np.ones(influences), vertices).astype(np.float32)
    skin = SkinWeights(joints=rng.integers(0, joints, (vertices, influences)).astype(np.int32), weights=weights)
    clip = Clip(
        translations=rng.normal(size=(frames, joints, 3)).astype(np.float32),
        rotations=Rotation.random(frames * joints, random_state=9).as_quat().reshape(frames, joints, 4).astype("f4"),
        scales=rng.uniform(0.5, 2, (frames, joints, 3)).astype(np.float32),
    )
    return Rig(skeleton=skeleton, skin=skin, clip=clip), rng.normal(size=(vertices, 3)).astype(np.float32)


@pytest.mark.parametrize("frame", [1001, 1002, 1004])
def test_agrees_with_usdskel(frame):
    from pxr import Gf, UsdSkel, Vt

    rig, points = some_rig()
    joints, influences = len(rig.skeleton.names), rig.skin.joints.shape[1]
    clip, at = rig.clip, frame - 1001
    local = Vt.Matrix4dArray(joints)
    for j in range(joints):
        m = Gf.Matrix4d()
        x, y, z, w = map(float, clip.rotations[at, j])
        scale = Gf.Matrix4d().SetScale(Gf.Vec3d(*map(float, clip.scales[at, j])))
        turn = Gf.Matrix4d().SetRotate(Gf.Quatd(w, x, y, z).GetNormalized())
        move = Gf.Matrix4d().SetTranslate(Gf.Vec3d(*map(float, clip.translations[at, j])))
        m = scale * turn * move
        local[j] = m
    topology = UsdSkel.Topology(Vt.IntArray(rig.skeleton.parents.tolist()))
    posed = Vt.Matrix4dArray(UsdSkel.ConcatJointTransforms(topology, local))
    for j in range(joints):
        posed[j] = Gf.Matrix4d(rig.skeleton.bind[j].T.tolist()).GetInverse() * posed[j]
    truth = Vt.Vec3fArray.FromNumpy(points.copy())
    UsdSkel.SkinPointsLBS(
        Gf.Matrix4d(1), posed, Vt.IntArray(rig.skin.joints.ravel().tolist()),
        Vt.FloatArray(rig.skin.weights.ravel().tolist()), influences, truth,
    )
    assert np.allclose(posed_points(points, rig, frame), np.array(truth), atol=2e-5)


def test_without_a_clip_it_rests():
    rig, points = some_rig()
    assert np.allclose(posed_points(points, rig.replace(clip=None), 1003), points, atol=1e-5)
    assert np.allclose(skin_matrices(rig.replace(clip=None), 0), np.eye(4), atol=1e-12)


def test_one_joint_is_rigid_and_frames_between_are_mixed():
    rig, points = some_rig(joints=1, frames=2, influences=1)
    clip = rig.clip.replace(
        translations=np.array([[[0, 0, 0]], [[2, 0, 0]]], np.float32), scales=np.ones((2, 1, 3), np.float32),
        rotations=np.array([[[0, 0, 0, 1]], [[0, 0, 1, 0]]], np.float32),  # half a turn about z
    )
    rig = rig.replace(clip=clip, skeleton=rig.skeleton.replace(bind=np.eye(4)[None]))
    truth = points @ Rotation.from_rotvec([0, 0, np.pi / 4]).as_matrix().T + [0.5, 0, 0]
    assert np.allclose(posed_points(points, rig, 1001.25), truth, atol=1e-6)
    assert np.array_equal(posed_points(points, rig, -50), posed_points(points, rig, 1001))
    assert np.array_equal(posed_points(points, rig, 1e9), posed_points(points, rig, 1002))


def test_two_joints_in_closed_form():
    """At equal weights the blend of a joint at rest and one that moves is the mean of both places."""
    rig, points = some_rig(joints=2, influences=2)
    joints, weights = np.tile(np.int32([0, 1]), (len(points), 1)), np.full((len(points), 2), 0.5, np.float32)
    both = SkinWeights(joints=joints, weights=weights)
    rig = rig.replace(skin=both)
    m = skin_matrices(rig, 1002)
    truth = 0.5 * (transform_points(m[0], points) + transform_points(m[1], points))
    assert np.allclose(posed_points(points, rig, 1002), truth, atol=1e-5)


def test_threads_give_the_same_to_the_bit():
    rig, points = some_rig(vertices=20_000)
    workers = Workers(2)
    assert np.array_equal(posed_points(points, rig, 1002, workers.ranges), posed_points(points, rig, 1002))
    workers.close()


def test_children_follow_parents():
    rig, _ = some_rig(joints=6)
    local = local_matrices(rig.clip, 1002)
    world = object_matrices(rig.skeleton, local)
    for j, parent in enumerate(rig.skeleton.parents):
        assert np.allclose(world[j], local[j] if parent < 0 else world[parent] @ local[j])


def test_refusals():
    rig, points = some_rig()
    with pytest.raises(UserError, match="399"):
        posed_points(points[:-1], rig, 1001)
    for wrong in (
        lambda: rig.skin.replace(weights=rig.skin.weights * np.float32(2)),
        lambda: rig.skeleton.replace(parents=np.arange(5, dtype=np.int32)),
        lambda: rig.skeleton.replace(bind=np.zeros((5, 4, 4))),
        lambda: rig.replace(skin=rig.skin.replace(joints=rig.skin.joints + np.int32(3))),
        lambda: rig.replace(clip=rig.clip.replace(
            translations=rig.clip.translations[:, :2], rotations=rig.clip.rotations[:, :2],
            scales=rig.clip.scales[:, :2])),
    ):
        with pytest.raises(ValueError):
            wrong()


def test_a_control_is_a_number_a_piece_of_geometry_or_a_joint():
    rig, points = some_rig(joints=3, influences=1)
    plain = np.tile(np.eye(4), (3, 1, 1))
    skeleton = rig.skeleton.replace(parents=np.array([-1, 0, -1], np.int32), rest=plain, bind=plain)
    joints = np.where(np.arange(len(points)) < 10, 2, 0).astype(np.int32)[:, None]
    skin = SkinWeights(joints=joints, weights=np.ones((len(points), 1), np.float32))
    dials = (
        Control(name="happy", rest=0.25), Control(name="piece", kind="geometry", vertices=np.arange(10, dtype=np.int32),
                                                  axis=(0, 2, 0), travel=0.5, low=-1, high=3),
        Control(name="switch", kind="joint", joint="j2", axis=(1, 1, 0), rest=0.5),
    )
    rig = Rig(skeleton=skeleton, skin=skin, controls=dials)
    local = plain.copy()
    local[2, :3, 3] = [1, 1, 9]
    local[0, :3, 3] = [5, 5, 5]  # the rest of the mesh moves, its piece does not
    assert control_names(rig) == ("j0", "j1", "j2", "happy", "piece", "switch")
    assert moved_number(dials[0], rig, points, local) == 0.25
    assert moved_number(dials[0], rig, points, local, {"happy": 0.75}) == 0.75
    assert moved_number(dials[1], rig, points, local) == pytest.approx(2.0, abs=1e-6)
    assert moved_number(dials[2], rig, points, local) == pytest.approx(0.5 + np.sqrt(2.0))
    for control in dials:
        assert moved_number(control, rig, points, plain) == pytest.approx(control.rest, abs=1e-6)
    for wrong in (
        {"kind": "geometry"}, {"joint": "j0"}, {"kind": "joint", "joint": "j0", "axis": (0, 0, 0)}, {"travel": 0.0},
        {"low": 2.0, "high": 1.0}, {"rest": 7.0}, {"kind": "geometry", "vertices": np.zeros(0, np.int32)},
    ):
        with pytest.raises(ValueError):
            Control(name="x", **wrong)
    for wrong in (Control(name="j1"), dials[0], Control(name="y", kind="joint", joint="gone"),
                  Control(name="y", kind="geometry", vertices=np.int32([9999]))):
        with pytest.raises(ValueError):
            rig.replace(controls=(*dials, wrong))


def test_several_clips_one_of_which_plays():
    rig, points = some_rig()
    rig = rig.replace(clips=(rig.clip.replace(name="run", translations=rig.clip.translations + np.float32(1)),))
    run = playing(rig, "run")
    assert (run.clip.name, run.clips[0].name) == ("run", "clip")
    assert not np.allclose(posed_points(points, run, 1002), posed_points(points, rig, 1002))
    assert playing(run, None).clip is None
    assert {c.name for c in playing(run, None).clips} == {"run", "clip"}
    with pytest.raises(UserError, match="choose one of clip, run"):
        playing(rig, "gallop")
    with pytest.raises(ValueError, match="names that differ"):
        rig.replace(clips=(rig.clip,))

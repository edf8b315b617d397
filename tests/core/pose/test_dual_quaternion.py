"""Truths: UsdSkel's own dual quaternion skinning, rigid motion, and the volume of a twist."""

import numpy as np
import pytest
from pxr import Gf, UsdSkel, Vt
from scipy.spatial.transform import Rotation

from core.pose.dual_quaternion import dual_quaternions
from core.pose.skeleton import SkinWeights
from core.pose.skinning import skinned
from core.transform import compose, rotation, transform_points, translation
from core.workers import Workers


def by_usdskel(points, skin, matrices, method):
    out = Vt.Vec3fArray.FromNumpy(points.copy())
    xforms = Vt.Matrix4dArray([Gf.Matrix4d(m.T.tolist()) for m in matrices])
    UsdSkel.SkinPoints(
        method, Gf.Matrix4d(1), xforms, Vt.IntArray(skin.joints.ravel().tolist()),
        Vt.FloatArray(skin.weights.ravel().tolist()), skin.joints.shape[1], out,
    )
    return np.array(out)


def some_skin(rng, vertices, joints, influences):
    weights = rng.dirichlet(np.ones(influences), vertices).astype(np.float32)
    return SkinWeights(joints=rng.integers(0, joints, (vertices, influences)).astype(np.int32), weights=weights)


@pytest.mark.parametrize("influences", [1, 4, 8])
@pytest.mark.parametrize("kind", ["rigid", "scaled", "mirrored"])
@pytest.mark.parametrize("method", ["linear", "dual-quaternion"])
def test_agrees_with_usdskel(influences, kind, method):
    rng = np.random.default_rng(influences)
    joints = 12
    turns = Rotation.random(joints, random_state=influences).as_quat()
    scales = {"rigid": np.ones((joints, 3)), "scaled": rng.uniform(0.5, 2.0, (joints, 3))}.get(kind)
    if scales is None:
        scales = rng.uniform(0.5, 2.0, (joints, 3)) * [-1.0, 1.0, 1.0]
    matrices = compose(rng.normal(size=(joints, 3)), turns, scales)
    if kind == "scaled":  # and sheared
        matrices = matrices @ compose((0, 0, 0), Rotation.random(random_state=1).as_quat(), (1.0, 1.4, 0.8))
    points = rng.normal(size=(3000, 3)).astype(np.float32)
    skin = some_skin(rng, len(points), joints, influences)
    truth = by_usdskel(points, skin, matrices, {"linear": "classicLinear"}.get(method, "dualQuaternion"))
    error = np.abs(skinned(points, skin, matrices, method) - truth).max()
    assert error <= 1e-5 * np.ptp(truth, axis=0).max()


def test_the_parts_make_up_the_matrix():
    rng = np.random.default_rng(5)
    matrices = compose(rng.normal(size=(40, 3)), Rotation.random(40, random_state=2).as_quat(),
                       rng.uniform(0.3, 3.0, (40, 3)) * rng.choice([-1.0, 1.0], (40, 1)))
    real, dual, stretch = dual_quaternions(matrices)
    turn = Rotation.from_quat(real)
    # the dual part is half of t * real, so t = 2 dual * conjugate(real)
    moved = 2.0 * (
        real[:, 3:] * dual[:, :3] - dual[:, 3:] * real[:, :3] + np.cross(real[:, :3], dual[:, :3])
    )
    assert np.allclose(turn.as_matrix() @ stretch, matrices[:, :3, :3], atol=1e-12)
    assert np.allclose(moved, matrices[:, :3, 3], atol=1e-12)
    assert np.allclose(np.linalg.norm(real, axis=1), 1.0)
    assert not np.allclose(stretch, np.eye(3))
    assert len(dual_quaternions(matrices[:1] @ np.linalg.inv(matrices[:1]))[2]) == 0


def test_a_twist_keeps_its_thickness_where_linear_blending_loses_it():
    """Half of a half turn about x: linear blending folds the tube onto its axis, dual quaternions keep its radius."""
    ring = np.column_stack([np.zeros(64), *np.array([np.cos(a := np.arange(64) / 64 * 2 * np.pi), np.sin(a)])])
    skin = SkinWeights(joints=np.tile(np.int32([0, 1]), (64, 1)), weights=np.full((64, 2), 0.5, np.float32))
    for degrees in (90.0, 150.0, 179.0):
        matrices = np.stack([np.eye(4), rotation((1, 0, 0), np.radians(degrees))])
        thick = np.linalg.norm(skinned(ring.astype("f4"), skin, matrices, "dual-quaternion"), axis=1)
        thin = np.linalg.norm(skinned(ring.astype("f4"), skin, matrices, "linear"), axis=1)
        assert np.allclose(thick, 1.0, atol=1e-5)
        assert np.allclose(thin, np.cos(np.radians(degrees / 2)), atol=1e-5)


def test_one_rigid_motion_of_all_joints_is_that_motion():
    rng = np.random.default_rng(8)
    points = rng.normal(size=(500, 3)).astype(np.float32)
    m = translation((3, -2, 7)) @ rotation((1, 2, 3), 2.5)
    matrices = np.tile(m, (6, 1, 1))
    found = skinned(points, some_skin(rng, 500, 6, 3), matrices, "dual-quaternion")
    assert np.allclose(found, transform_points(m, points), atol=1e-5)


def test_opposite_rotations_and_no_weights_stay_finite():
    points = np.ones((3, 3), np.float32)
    skin = SkinWeights(joints=np.tile(np.int32([0, 1]), (3, 1)), weights=np.full((3, 2), 0.5, np.float32))
    matrices = np.stack([np.eye(4), rotation((1, 0, 0), np.pi)])
    assert np.isfinite(skinned(points, skin, matrices, "dual-quaternion")).all()
    none = SkinWeights(joints=np.zeros((3, 0), np.int32), weights=np.zeros((3, 0), np.float32))
    for method in ("linear", "dual-quaternion"):
        assert np.array_equal(skinned(points, none, matrices, method), points)


def test_threads_give_the_same_to_the_bit():
    rng = np.random.default_rng(1)
    points = rng.normal(size=(20_000, 3)).astype(np.float32)
    skin = some_skin(rng, len(points), 5, 4)
    matrices = compose(rng.normal(size=(5, 3)), Rotation.random(5, random_state=1).as_quat(), np.ones((5, 3)))
    workers = Workers(2)
    both = skinned(points, skin, matrices, "dual-quaternion", workers.ranges)
    workers.close()
    assert np.array_equal(both, skinned(points, skin, matrices, "dual-quaternion"))

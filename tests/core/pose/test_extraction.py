"""Truths: numpy's own inverse and singular values, and the skin itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from core.pose.extraction import (
    MOST_CONDITION,
    Affine,
    after_skinning,
    before_skinning,
    condition_numbers,
    skin_affine,
    surface_rotations,
    undo,
)
from core.pose.pose import local_of_pose
from core.pose.skinning import skin_matrices_of, skinned
from tests.core.pose.arms import arm, turned


def stretched(count, largest, seed=0):
    """Matrices (n, 3, 3) of conditions 1 .. `largest`, and these."""
    rng = np.random.default_rng(seed)
    u, v = (Rotation.random(count, random_state=seed + i).as_matrix() for i in range(2))
    condition = np.exp(rng.uniform(0, np.log(largest), count))
    sizes = np.stack([np.ones(count), rng.uniform(1 / condition, 1), 1 / condition], axis=1)
    return np.einsum("nij,nj,njk->nik", u, sizes, v) * np.exp(rng.normal(size=(count, 1, 1))), condition


def test_conditions_are_those_of_the_singular_values():
    matrices, condition = stretched(5000, 1e5)
    assert np.allclose(condition_numbers(matrices), condition, rtol=1e-6)
    flat = np.array([np.zeros((3, 3)), np.diag([1.0, 1.0, 0.0]), np.eye(3), -2 * np.eye(3)])
    assert np.allclose(condition_numbers(flat), [np.inf, np.inf, 1.0, 1.0])


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_there_and_back_where_it_is_well_conditioned(seed):
    matrices, _ = stretched(400, 30.0, seed)
    missing = np.random.default_rng(seed).normal(size=(400, 3))
    delta, found = before_skinning(Affine(matrices, np.zeros((400, 3)), np.zeros(400, np.int64)), missing)
    good = found <= MOST_CONDITION
    assert good.sum() >= 395
    assert np.abs(np.einsum("nij,nj->ni", matrices, delta) - missing)[good].max() <= 1e-10
    assert np.abs(delta[~good]).max(initial=0.0) == 0.0
    assert np.allclose(undo(matrices, missing), np.linalg.solve(matrices, missing[..., None])[..., 0], rtol=1e-9)


@pytest.mark.parametrize("method", ["linear", "dual-quaternion"])
def test_the_affine_map_is_what_the_skin_does(method):
    rig, points = arm(skinning=method)
    local = local_of_pose(rig.skeleton, turned("p", fore=(70, 10, 90), upper=(0, 50, 0), root=(20, 200, 3)))
    matrices = skin_matrices_of(rig.skeleton, local)
    affine = skin_affine(rig, matrices, np.arange(len(points), dtype=np.int32))
    posed = np.einsum("nij,nj->ni", affine.turn, points.astype(np.float64)) + affine.move
    assert np.abs(posed - skinned(points, rig.skin, matrices, method)).max() <= 5e-7
    assert np.array_equal(rig.skin.joints[0, rig.skin.weights.argmax(axis=1)], affine.strongest)


@pytest.mark.parametrize("degrees", [0, 90, 170, 176, 179.99, 180])
def test_two_joints_twisted_apart_have_the_condition_of_the_formula(degrees):
    """Of two equal weights a twist theta apart the smallest stretch is cos(theta / 2)."""
    turn = 0.5 * (np.eye(3) + Rotation.from_rotvec([np.radians(degrees), 0, 0]).as_matrix())[None]
    smallest = np.cos(np.radians(degrees) / 2)
    condition = condition_numbers(turn)[0]
    assert condition > 1e15 if degrees == 180 else np.isclose(condition, 1 / smallest, rtol=1e-6)
    affine = Affine(turn, np.zeros((1, 3)), np.zeros(1, np.int64))
    joints = np.tile(np.eye(4), (2, 1, 1))
    joints[1, :3, :3] = Rotation.from_rotvec([np.radians(degrees), 0, 0]).as_matrix()
    rotation = surface_rotations(affine, joints)[0]
    assert np.allclose(rotation @ rotation.T, np.eye(3))
    if degrees < 179:
        assert np.allclose(rotation, Rotation.from_rotvec([np.radians(degrees) / 2, 0, 0]).as_matrix(), atol=1e-9)
    if degrees == 180:
        assert np.allclose(rotation, np.eye(3))  # the strongest joint's
    missing = np.array([[0.1, -0.2, 0.3]])
    assert np.allclose(rotation @ after_skinning(affine, joints, missing)[0], missing)
    delta, _ = before_skinning(affine, missing)
    assert np.isfinite(delta).all()

"""Truths: the points of the skeleton reflected, and that twice is nothing."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.pose.layers import Sculpt, build
from core.pose.mirror_pose import mirror_of, mirror_of_rig, mirrored_layer, mirrored_name, mirrored_pose, mirrored_space
from core.pose.pose import Pose, local_of_pose
from core.pose.pose_space import Correctives, Dof, PoseSample, PoseSpace
from core.pose.rig import Control, Rig
from core.pose.skeleton import Skeleton, SkinWeights
from core.pose.skinning import object_matrices
from core.pose.solve import solve, weights
from core.pose.synthesis import evaluate

FLIP = np.array([-1.0, 1.0, 1.0])
NAMES = ("spine", "arm_L", "hand_L", "arm_R", "hand_R", "head")


def body(names=NAMES, seed=0):
    """A skeleton mirrored in its places across x, with a frame of its own at every joint."""
    places = np.array([[0, 0, 0], [1, 2, 0], [2, 2.5, 0.3], [-1, 2, 0], [-2, 2.5, 0.3], [0, 3, 0.1]])
    parents = np.array([-1, 0, 1, 0, 3, 0], np.int32)
    world = np.tile(np.eye(4), (6, 1, 1))
    world[:, :3, :3] = Rotation.random(6, random_state=seed).as_matrix()
    world[:, :3, 3] = places
    rest = np.array([w if p < 0 else np.linalg.inv(world[p]) @ w for p, w in zip(parents, world)])
    return Skeleton(names=names, parents=parents, rest=rest, bind=world)


def some_pose(seed=0, names=NAMES):
    turns = Rotation.random(len(names), random_state=seed).as_quat()
    return Pose(name="wave_L", rotations=dict(zip(names, map(tuple, turns))), numbers={"smile.L": 0.5, "bright": 1.0},
                translations={"hand_L": (0.1, -0.3, 0.2), "spine": (1.0, 2.0, 3.0), "arm_R": (0.4, 0.0, 0.0)})


@pytest.mark.parametrize("by", ["names", "place"])
def test_the_skeleton_is_reflected_and_twice_is_nothing(by):
    skeleton = body() if by == "names" else body(tuple("abcdef"))
    mirror = mirror_of(skeleton, by)
    assert mirror.partners.tolist() == [0, 3, 4, 1, 2, 5]
    pose = some_pose(3, skeleton.names)
    if by == "place":
        pose = pose.replace(translations={"c": (0.1, -0.3, 0.2), "a": (1.0, 2.0, 3.0)})
    other = mirrored_pose(pose, mirror)
    here, there = (object_matrices(skeleton, local_of_pose(skeleton, p))[:, :3, 3] for p in (pose, other))
    assert np.abs(there[mirror.partners] - here * FLIP).max() <= 1e-9
    again = mirrored_pose(other, mirror)
    for joint, q in pose.rotations.items():
        assert min(np.abs(np.subtract(q, s * np.array(again.rotations[joint]))).max() for s in (1, -1)) <= 1e-6
    for joint, t in pose.translations.items():
        assert np.allclose(again.translations[joint], t, atol=1e-9)
    assert again.numbers == pose.numbers
    assert again.name == pose.name
    assert other.numbers == {"smile.R": 0.5, "bright": 1.0}


def test_names():
    pairs = {"arm_L": "arm_R", "L_arm": "R_arm", "arm.l": "arm.r", "LeftArm": "RightArm", "mixamorig:LeftHand":
             "mixamorig:RightHand", "arm_left": "arm_right", "upperarmRight": "upperarmLeft", "LEFT": "RIGHT",
             "leg_L_01": "leg_R_01"}
    for name, other in pairs.items():
        assert mirrored_name(name) == other
        assert mirrored_name(other) == name
    for same in ("bright", "Tail", "copyright", "spine1", "lr", "Rleg2x"):
        assert mirrored_name(same) == same


def test_a_control_without_a_counterpart_is_its_own_and_joints_without_sides_find_theirs_by_place():
    skeleton = body(tuple("abcdef"))
    skin = SkinWeights(joints=np.zeros((1, 1), np.int32), weights=np.ones((1, 1), np.float32))
    controls = tuple(Control(name=n) for n in ("smile_L", "smile_R", "blink_L", "mood"))
    mirror = mirror_of_rig(Rig(skeleton=skeleton, skin=skin, controls=controls))
    assert mirror.partners.tolist() == [0, 3, 4, 1, 2, 5]
    pose = Pose(numbers={"smile_L": 1.0, "blink_L": 0.5, "mood": 0.25})
    assert mirrored_pose(pose, mirror).numbers == {"smile_R": 1.0, "blink_L": 0.5, "mood": 0.25}
    assert mirror_of_rig(Rig(skeleton=body(), skin=skin)).partners.tolist() == [0, 3, 4, 1, 2, 5]


def test_a_mirrored_space_measures_the_same():
    skeleton = body()
    mirror = mirror_of(skeleton)
    rng = np.random.default_rng(5)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    dofs = (Dof(control="arm_L", axis=tuple(q[0]), side=tuple(q[1]), falloff=(0.5, 0.9, 1.4)),
            Dof(control="hand_L", kind="twist", falloff=(0.7,)), Dof(control="smile.L", kind="number", falloff=(0.4,)))
    poses = [some_pose(k).replace(name=f"p{k}_L", numbers={"smile.L": 0.1 * k}) for k in range(6)]
    samples = tuple(PoseSample(pose=p, falloffs={"arm_L": (0.6, 1.0, 1.1)} if k == 2 else {})
                    for k, p in enumerate(poses))
    space = PoseSpace(dofs=dofs, samples=samples)
    other = mirrored_space(space, mirror)
    assert [d.control for d in other.dofs] == ["arm_R", "hand_R", "smile.R"]
    here, there = solve(space), solve(other)
    for k in range(20):
        at = some_pose(50 + k)
        assert np.abs(weights(here, at) - weights(there, mirrored_pose(at, mirror))).max() <= 1e-9
    twice = mirrored_space(other, mirror)
    assert np.allclose(twice.dofs[0].axis, dofs[0].axis)
    assert np.allclose(twice.dofs[0].side, dofs[0].side)
    assert np.abs(weights(solve(twice), some_pose(99)) - weights(here, some_pose(99))).max() <= 1e-9


def test_a_mirrored_sculpt_is_the_sculpt_reflected():
    skeleton = body()
    mirror = mirror_of(skeleton)
    half = np.random.default_rng(1).uniform([0.2, 0, -1], [3, 3, 1], (150, 3))
    points = np.concatenate([half, half * FLIP]).astype(np.float32)
    near = np.exp(-((points[:, None].astype(float) - skeleton.bind[None, :, :3, 3]) ** 2).sum(axis=2))
    weight = (near / near.sum(axis=1, keepdims=True)).astype(np.float32)
    rig = Rig(skeleton=skeleton, skin=SkinWeights(joints=np.tile(np.arange(6, dtype=np.int32), (300, 1)),
                                                  weights=weight))
    pose = Pose(name="up_L", rotations={"arm_L": tuple(Rotation.from_rotvec([0.3, 0.9, 0.4]).as_quat())})
    push = np.zeros((300, 3), np.float32)
    push[:150] = np.random.default_rng(2).normal(size=(150, 3)) * 0.05
    target = evaluate(points, rig, None, pose) + push
    layer = build(points, rig, [Sculpt(pose, target)]).correctives.layers[0]
    partners = np.concatenate([np.arange(150, 300), np.arange(150)])
    other = mirrored_layer(layer, mirror, partners)
    posed = evaluate(points, rig, Correctives(layers=(other,)), mirrored_pose(pose, mirror))
    assert np.abs(posed[partners] - target * FLIP.astype(np.float32)).max() <= 5e-6
    twice = mirrored_layer(other, mirror, partners)
    assert np.array_equal(twice.vertices, layer.vertices)
    assert np.array_equal(twice.deltas, layer.deltas)

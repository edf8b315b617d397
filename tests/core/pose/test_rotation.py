"""Truths: scipy's Rotation, closed forms, and that a rotation is the same however it is written."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from core.pose.embedding import chord, embed, scales
from core.pose.pose import Pose, local_of_pose, moved_controls, pose_of_local
from core.pose.pose_space import Dof
from core.pose.rotation import (
    euler_from_quaternion,
    inverse,
    polar_rotation,
    quaternion_from_euler,
    relative,
    swing_angle,
    swing_twist,
    swung_and_twisted,
    twist_angle,
)
from core.transform import quaternion_product
from tests.core.pose.arms import arm, turned

numbers = st.floats(-1, 1, allow_nan=False)
quaternions = st.tuples(numbers, numbers, numbers, numbers).filter(lambda q: np.linalg.norm(q) > 0.1)
vectors = st.tuples(numbers, numbers, numbers).filter(lambda v: np.linalg.norm(v) > 0.1)


def unit(v):
    return np.array(v) / np.linalg.norm(v)


@given(quaternions, vectors)
@settings(deadline=None)
def test_swing_and_twist_make_the_whole(q, axis):
    q, a = unit(q), unit(axis)
    swing, twist = swing_twist(q, a)
    assert np.allclose(quaternion_product(swing, twist), q, atol=1e-12)
    assert abs(swing[:3] @ a) < 1e-9 * 1e3 * (1e-9 + 1)  # a swing has no part about the axis
    assert np.allclose(np.cross(twist[:3], a), 0, atol=1e-12)
    assert np.allclose(Rotation.from_quat(q).apply(a), Rotation.from_quat(swing).apply(a), atol=1e-9)


@given(quaternions, vectors)
@settings(deadline=None)
def test_a_rotation_and_its_negative_are_the_same_to_the_bit(q, axis):
    q, a = unit(q), unit(axis)
    side = unit(np.cross(a, np.eye(3)[np.argmin(np.abs(a))]))
    dof = Dof(control="j", axis=tuple(a), side=tuple(side))
    here, there = (embed([dof], [Pose(rotations={"j": tuple(s * q)})]) for s in (1, -1))
    assert np.array_equal(here, there)
    assert np.array_equal(relative(q, q), relative(-q, q))


@given(st.tuples(*[st.floats(-180, 180)] * 3), st.tuples(*[st.integers(-2, 2)] * 3))
@settings(deadline=None)
def test_whole_turns_change_nothing(degrees, turns):
    dof = Dof(control="j")
    once, again = (
        embed([dof], [turned("p", j=np.array(degrees) + extra)]) for extra in (0.0, 360.0 * np.array(turns)))
    assert np.abs(once - again).max() <= 1e-12


@given(st.tuples(*[st.floats(-179, 179)] * 3))
@settings(deadline=None)
def test_euler_is_scipys_and_comes_back(degrees):
    q = quaternion_from_euler(degrees)
    assert np.allclose(Rotation.from_quat(q).as_matrix(),
                       Rotation.from_euler("xyz", degrees, degrees=True).as_matrix(), atol=1e-12)
    again = Rotation.from_euler("xyz", euler_from_quaternion(q))
    assert (again * Rotation.from_quat(q).inv()).magnitude() < 1e-7


def test_angles_in_closed_form():
    a = np.array([1.0, 0, 0])
    for t in np.radians([-170, -90, -1e-7, 0, 30, 120, 179]):
        q = Rotation.from_rotvec(t * a).as_quat()
        assert np.isclose(twist_angle(q, a), t, atol=1e-15)
        assert swing_angle(q, a) < 1e-12
    for t in np.radians([1e-7, 45, 120, 179.9999, 180]):
        assert np.isclose(swing_angle(Rotation.from_rotvec([0, t, 0]).as_quat(), a), t, rtol=1e-6)


def test_swing_alone_does_not_move_the_twist_until_it_nears_half_a_turn():
    twist = Rotation.from_rotvec([0.7, 0, 0])
    for degrees in (0, 60, 119):
        q = (Rotation.from_rotvec(np.radians([0, degrees, 0])) * twist).as_quat()
        swing, at = np.radians(degrees), swung_and_twisted(q[None, None], np.eye(3)[None])[0, 0]
        assert np.allclose(at, [np.cos(swing), 0, -np.sin(swing), np.cos(0.7), np.sin(0.7)], atol=1e-12)
    half = (Rotation.from_rotvec([0, np.pi, 0]) * twist).as_quat()
    assert np.abs(swung_and_twisted(half[None, None], np.eye(3)[None])[0, 0, 3:]).max() < 1e-12


def test_through_half_a_turn_of_swing_the_coordinates_are_continuous():
    angles = np.radians(np.linspace(150, 210, 6001))
    poses = [Pose(rotations={"j": tuple(Rotation.from_rotvec([0, t, 0.02]).as_quat())}) for t in angles]
    places = embed([Dof(control="j")], poses)
    step = np.linalg.norm(np.diff(places, axis=0), axis=1).max()
    print(f"largest step of the coordinates in 0.01 degrees of swing: {step:.2e}")
    assert step < 5 * np.radians(0.01)


def test_polar_is_the_nearest_rotation():
    rng = np.random.default_rng(0)
    many = np.concatenate([rng.normal(size=(200, 3, 3)), np.zeros((1, 3, 3)), -np.eye(3)[None]])
    r = polar_rotation(many)
    assert np.allclose(r @ np.swapaxes(r, 1, 2), np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(r), 1)
    other = Rotation.random(200, random_state=1).as_matrix()
    assert np.all(np.linalg.norm(many[:200] - r[:200], axis=(1, 2)) <=
                  np.linalg.norm(many[:200] - other, axis=(1, 2)) + 1e-12)
    mine = Rotation.random(50, random_state=2)
    stretched = mine.as_matrix() @ np.diag([1.0, 2.0, 0.3])
    assert np.allclose(polar_rotation(stretched), mine.as_matrix(), atol=1e-12)


def test_poses_and_matrices_there_and_back():
    rig, _ = arm()
    skeleton = rig.skeleton
    scaled = skeleton.replace(rest=skeleton.rest @ np.diag([1.0, 2.0, 0.5, 1.0]))
    pose = turned("p", fore=(10, 20, 30), root=(0, 200, 0)).replace(translations={"hand": (0.1, 0.0, -0.2)})
    for which in (skeleton, scaled):
        again = pose_of_local(which, local_of_pose(which, pose))
        assert moved_controls(again) == ("fore", "hand", "root")
        for joint, q in pose.rotations.items():
            assert np.isclose(abs(np.dot(q, again.rotations[joint])), 1, atol=1e-12)
        assert np.allclose(again.translations["hand"], (0.1, 0, -0.2))
    assert np.array_equal(local_of_pose(scaled, Pose()), scaled.rest)
    assert moved_controls(Pose(numbers={"a": 0.25}), {"a": 0.25}) == ()
    assert np.allclose(quaternion_product(inverse([0, 0, 2, 0]), [0, 0, 1, 0]), [0, 0, 0, 1])


def test_a_falloff_away_the_distance_is_one():
    for kind, q in (("swing", Rotation.from_rotvec([0, 0, 0.8])), ("twist", Rotation.from_rotvec([0.8, 0, 0]))):
        dof = Dof(control="j", kind=kind, falloff=(0.8,))
        places = embed([dof], [Pose(), Pose(rotations={"j": tuple(q.as_quat())})]) * scales([dof])
        assert np.isclose(np.linalg.norm(places[1] - places[0]), 1.0)
    assert chord(np.pi) == 2.0
    assert chord(4.0) > chord(3.5) > 2.0


def test_the_falloff_of_a_joint_that_turns_and_moves_is_of_its_turn():
    turn, move = Dof(control="j"), Dof(control="j", kind="translation", falloff=(0.1,))
    own = {"j": (0.5,)}
    assert np.array_equal(scales([turn, move], own), [*scales([turn], own), 10.0, 10.0, 10.0])
    assert np.array_equal(scales([move], own), [2.0, 2.0, 2.0])

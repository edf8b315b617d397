"""Inverse kinematics against the law of cosines, and what must hold of every chain."""

import itertools
import math

import numpy as np
import pytest

from core.errors import UserError
from core.pose.ik import chain_to, fabrik, solved_ik, turn_between, two_bones
from core.pose.pose import REST, local_of_pose
from core.pose.rotation import polar_rotation, swing_twist, twist_angle
from core.pose.skeleton import Skeleton
from core.pose.skinning import object_matrices
from tests.core.pose.arms import arm, turned

CHAIN = ("upper", "fore", "hand")


def places(rig, pose, names=CHAIN):
    world = object_matrices(rig.skeleton, local_of_pose(rig.skeleton, pose))
    return world[[rig.skeleton.names.index(n) for n in names]]


def test_two_bones_are_the_law_of_cosines():
    rng = np.random.default_rng(0)
    for _ in range(50):
        root, pole, way = rng.normal(size=3), rng.normal(size=3), rng.normal(size=3)
        a, b = rng.uniform(0.2, 1.0, 2)
        d = rng.uniform(abs(a - b) + 0.01, a + b - 0.01)
        goal = root + d * way / np.linalg.norm(way)
        start = np.array([root, root + np.array([a, 0, 0]), root + np.array([a, b, 0])])
        found = two_bones(start, goal, root + pole)
        assert np.allclose(found[2], goal, atol=1e-12)
        assert np.isclose(np.linalg.norm(found[1] - root), a)
        assert np.isclose(np.linalg.norm(found[2] - found[1]), b)
        inside = np.dot(found[0] - found[1], found[2] - found[1]) / (a * b)
        assert np.isclose(inside, (a * a + b * b - d * d) / (2 * a * b))
        along = (goal - root) / d
        off, wish = found[1] - root, pole
        off, wish = off - along * (off @ along), wish - along * (wish @ along)
        assert np.isclose(off @ wish, np.linalg.norm(off) * np.linalg.norm(wish))  # in the plane of the pole, its side


@pytest.mark.parametrize("names", [CHAIN, ("root", "upper", "fore", "hand")])
def test_the_end_is_where_it_is_wanted_and_bones_keep_their_lengths(names):
    rig, _ = arm()
    before = places(rig, REST, names)[:, :3, 3]
    bones = np.linalg.norm(np.diff(before, axis=0), axis=1)
    rng = np.random.default_rng(1)
    for _ in range(20):
        goal = before[0] + rng.normal(size=3) * 0.2
        pose = solved_ik(rig.skeleton, REST, names, goal)
        now = places(rig, pose, names)
        if np.linalg.norm(goal - before[0]) < bones.sum():
            assert np.linalg.norm(now[-1, :3, 3] - goal) < 1e-6
        assert np.allclose(np.linalg.norm(np.diff(now[:, :3, 3], axis=0), axis=1), bones, atol=1e-12)
        assert np.allclose(polar_rotation(now[-1, :3, :3]), polar_rotation(places(rig, REST, names)[-1, :3, :3]))
        assert set(pose.rotations) <= set(names)
        assert not pose.translations


def test_round_trip():
    """The end of a posed chain as the goal from another pose, its middle as the pole, gives the same places."""
    rig, _ = arm()
    posed = turned("any", upper=(20, -40, 30), fore=(0, 10, 80))
    there = places(rig, posed)[:, :3, 3]
    found = solved_ik(rig.skeleton, REST, CHAIN, there[2], there[1])
    assert np.allclose(places(rig, found)[:, :3, 3], there, atol=1e-9)


def test_out_of_reach_it_is_stretched_and_behind_itself_folded():
    rig, _ = arm()
    root = places(rig, REST)[0, :3, 3]
    for names in (CHAIN, ("root", *CHAIN)):
        goal = root + np.array([0.0, 9.0, 3.0])
        now = places(rig, solved_ik(rig.skeleton, REST, names, goal), names)[:, :3, 3]
        aim = (goal - now[0]) / np.linalg.norm(goal - now[0])
        assert np.allclose(np.cross(now[1:] - now[0], aim), 0.0, atol=1e-6)
        for same in (now[0], now[0] + 1e-14):
            assert np.isfinite(places(rig, solved_ik(rig.skeleton, REST, names, same), names)).all()


def test_a_straight_chain_bends_towards_its_pole():
    line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]])
    goal = np.array([1.5, 0.0, 0.0])
    for pole in ([0.0, 2.0, 0.0], [0.0, 0.0, -2.0]):
        found = fabrik(line, goal, np.array(pole))
        assert np.linalg.norm(found[-1] - goal) < 1e-5
        assert (found[1:-1] @ np.array(pole) > 0.01).all()
    assert np.linalg.norm(fabrik(line, goal)[-1] - goal) < 1e-5  # and somewhere without one


def test_the_shortest_turn_has_no_twist():
    rng = np.random.default_rng(2)
    for a, b in itertools.product(rng.normal(size=(6, 3)), repeat=2):
        turn = turn_between(a, b)
        assert np.allclose(turn @ a / np.linalg.norm(a), b / np.linalg.norm(b))
        assert np.isclose(np.linalg.det(turn), 1.0)
    half = turn_between(np.array([1.0, 2, 3]), np.array([-1.0, -2, -3]))
    assert np.allclose(half @ [1, 2, 3], [-1, -2, -3])
    assert np.isclose(np.linalg.det(half), 1.0)


def test_twist_of_a_bone_stays_what_it_was():
    rest = np.tile(np.eye(4), (3, 1, 1))
    rest[1:, 0, 3] = 1.0
    bind = rest.copy()
    bind[2, 0, 3] = 2.0
    skeleton = Skeleton(names=("a", "b", "c"), parents=np.array([-1, 0, 1], np.int32), rest=rest, bind=bind)
    pose = solved_ik(skeleton, REST, ("a", "b", "c"), [0.5, 1.2, 0.4], [0, 0, 5])
    for joint in ("a", "b"):
        if joint in pose.rotations:
            swing, _ = swing_twist(pose.rotations[joint], [1.0, 0, 0])
            assert abs(twist_angle(pose.rotations["a"], [1.0, 0, 0])) < 1e-9
            assert swing.shape == (4,)


def test_chains_are_found_and_refused():
    rig, _ = arm()
    assert chain_to(rig.skeleton, "hand", 2) == CHAIN
    assert chain_to(rig.skeleton, "hand", 9) == ("root", *CHAIN)
    for end in ("root", "nobody"):
        with pytest.raises(UserError):
            chain_to(rig.skeleton, end, 2)
    with pytest.raises(UserError, match="parent"):
        solved_ik(rig.skeleton, REST, ("root", "fore", "hand"), [0, 0, 0])
    assert math.isclose(np.linalg.norm(places(rig, REST)[0, :3, 3]), 0.1)

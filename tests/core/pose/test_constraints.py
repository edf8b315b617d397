"""Constraints hold what they say, wholly or in part."""

import numpy as np
import pytest

from core.pose.constraints import constrained
from core.pose.pose import REST, local_of_pose
from core.pose.rig import Constraint, Rig
from core.pose.rotation import euler_from_quaternion, polar_rotation
from core.pose.skinning import object_matrices
from tests.core.pose.arms import arm, turned

RIG, _ = arm()
SKELETON = RIG.skeleton


def world(pose):
    return dict(zip(SKELETON.names, object_matrices(SKELETON, local_of_pose(SKELETON, pose)), strict=True))


def test_a_limit_holds_each_angle():
    limit = Constraint(joint="fore", kind="limit", low=(0.0, -0.1, 0.0), high=(0.0, 0.1, 2.4))
    bent = turned("bent", fore=(30, 20, 170), upper=(0, 0, 99))
    held = constrained(SKELETON, (limit,), bent)
    assert np.allclose(euler_from_quaternion(held.rotations["fore"]), [0.0, 0.1, 2.4])
    assert held.rotations["upper"] == bent.rotations["upper"]
    inside = turned("inside", fore=(0, 2, 100))
    assert constrained(SKELETON, (limit,), inside) is inside
    assert np.allclose(constrained(SKELETON, (limit,), held).rotations["fore"], held.rotations["fore"])


def test_an_aim_points_there():
    aim = Constraint(joint="upper", kind="aim", target="root", axis=(0.0, 0.0, 1.0))
    pose = constrained(SKELETON, (aim,), turned("any", upper=(10, 20, 30), root=(0, 50, 0)))
    now = world(pose)
    pointing = polar_rotation(now["upper"][:3, :3]) @ [0, 0, 1]
    way = now["root"][:3, 3] - now["upper"][:3, 3]
    assert np.allclose(pointing, way / np.linalg.norm(way))


def test_a_point_follows_and_an_orient_turns_along():
    point = Constraint(joint="hand", kind="point", target="upper")
    bent = turned("bent", fore=(0, 0, 90), upper=(0, 40, 0))
    now, then = world(constrained(SKELETON, (point,), bent)), world(REST)
    assert np.allclose(now["hand"][:3, 3] - now["upper"][:3, 3], then["hand"][:3, 3] - then["upper"][:3, 3])
    orient = Constraint(joint="hand", kind="orient", target="upper")
    now = world(constrained(SKELETON, (orient,), bent))
    turn = {n: polar_rotation(now[n][:3, :3]) @ polar_rotation(then[n][:3, :3]).T for n in ("hand", "upper")}
    assert np.allclose(turn["hand"], turn["upper"])


def test_half_of_it_is_half_the_angle():
    def angle(weight):
        orient = Constraint(joint="hand", kind="orient", target="upper", weight=weight)
        before = world(turned("bent", fore=(0, 0, 60)))["hand"][:3, :3]
        after = world(constrained(SKELETON, (orient,), turned("bent", fore=(0, 0, 60))))["hand"][:3, :3]
        cosine = (np.trace(polar_rotation(after) @ polar_rotation(before).T) - 1) / 2
        return np.arccos(np.clip(cosine, -1, 1))

    assert angle(0.0) < 1e-6
    assert np.isclose(angle(0.5), 0.5 * angle(1.0))
    assert np.isclose(angle(1.0), np.radians(60))


@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("one", [
    Constraint(joint="hand", kind="orient", target="upper"), Constraint(joint="hand", kind="point", target="root"),
    Constraint(joint="hand", kind="aim", target="root", axis=(0.0, 0.0, 1.0)),
    Constraint(joint="fore", kind="limit", low=(-0.1, -0.2, 0.0), high=(0.1, 0.2, 0.3)),
], ids=lambda c: c.kind)
def test_done_twice_it_is_what_it_is_done_once(one, weight):
    """So a pose that is held again and again does not creep."""
    one = one.replace(weight=weight)
    pose = turned("any", upper=(10, 20, 30), fore=(40, -50, 60), hand=(25, 15, -70))
    once = constrained(SKELETON, (one,), pose)
    twice = constrained(SKELETON, (one,), once)
    assert np.abs(local_of_pose(SKELETON, once) - local_of_pose(SKELETON, twice)).max() < 1e-9


def test_an_aim_leaves_the_twist_about_its_axis_to_the_hand():
    aim = Constraint(joint="hand", kind="aim", target="root", axis=(0.0, 0.0, 1.0), weight=0.5)
    turns = [world(constrained(SKELETON, (aim,), turned("any", hand=(0, 0, z))))["hand"][:3, :3] for z in (0, 35)]
    apart = turns[0].T @ turns[1]
    assert np.allclose(apart @ [0, 0, 1], [0, 0, 1])
    assert np.isclose(np.degrees(np.arctan2(apart[1, 0], apart[0, 0])), 35)


def test_what_hangs_from_a_joint_cannot_lead_it():
    bent = turned("bent", fore=(0, 0, 60))
    for kind in ("point", "orient", "aim"):
        loop = Constraint(joint="upper", kind=kind, target="hand")
        assert constrained(SKELETON, (loop,), bent) is bent


@pytest.mark.parametrize("fields", [
    {"kind": "limit", "target": "upper"}, {"kind": "aim"}, {"kind": "aim", "target": "fore"},
    {"kind": "limit", "low": (1.0, 0, 0), "high": (0.0, 0, 0)}, {"kind": "aim", "target": "upper", "axis": (0, 0, 0)},
    {"kind": "hold", "target": "upper"}, {"kind": "aim", "target": "upper", "weight": 2.0},
], ids=str)
def test_refused_records(fields):
    with pytest.raises(ValueError, match="Constraint"):
        Constraint(joint="fore", **fields)


def test_a_rig_knows_its_joints():
    with pytest.raises(ValueError, match="constraints"):
        RIG.replace(constraints=(Constraint(joint="knee", kind="limit"),))
    assert isinstance(RIG.replace(constraints=(Constraint(joint="fore", kind="limit"),)), Rig)

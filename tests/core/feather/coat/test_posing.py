"""Vanes posed on the skin: rigid where nothing bends, arcs of the right length where something does."""

import numpy as np

from core.feather.coat.export import quaternions
from core.feather.coat.posing import BEND, CUP, LENGTH, LIFT, POSE, ROLL, pose_vanes


def pose(**values):
    columns = {"lift": LIFT, "roll": ROLL, "bend": BEND, "cup": CUP, "length": LENGTH}
    out = np.zeros((1, POSE))
    out[0, LENGTH] = 1.0
    for name, value in values.items():
        out[0, columns[name]] = value
    return out


LINE = np.zeros((1, 65, 3, 3), np.float32)
LINE[0, :, :, 1] = np.linspace(0.0, 1.0, 65)[:, None]
LINE[0, :, :, 0] = np.array([-0.2, 0.0, 0.2])
UPRIGHT, ORIGIN = np.eye(3, dtype=np.float32)[None], np.zeros((1, 3), np.float32)


def test_a_bent_shaft_is_an_arc_towards_the_skin_and_keeps_its_length():
    shaft = pose_vanes(LINE, pose(bend=1.5, length=2.0), ORIGIN, UPRIGHT)[0, :, 1].astype(np.float64)
    assert abs(np.linalg.norm(np.diff(shaft, axis=0), axis=1).sum() - 2.0) < 1e-3
    np.testing.assert_allclose(np.linalg.norm(shaft - [0.0, 0.0, -1.0 / 1.5], axis=1), 1.0 / 1.5, atol=1e-6)
    assert shaft[-1, 2] < 0.0


def test_a_cup_follows_a_round_body():
    row = pose_vanes(LINE, pose(cup=2.0), ORIGIN, UPRIGHT)[0, 32].astype(np.float64)
    np.testing.assert_allclose(np.hypot(row[:, 0], row[:, 2] + 0.5), 0.5, atol=1e-6)


def test_lift_raises_the_tip_and_roll_the_right_edge():
    lifted = pose_vanes(LINE, pose(lift=0.3), ORIGIN, UPRIGHT)[0]
    np.testing.assert_allclose(lifted[-1, 1], [0.0, np.cos(0.3), np.sin(0.3)], atol=1e-6)
    rolled = pose_vanes(LINE, pose(roll=0.3), ORIGIN, UPRIGHT)[0]
    assert rolled[5, 2, 2] > 0.0 > rolled[5, 0, 2]


def test_a_quaternion_turns_a_vane_as_its_pose_does():
    rng = np.random.default_rng(0)
    frames = np.linalg.qr(rng.normal(size=(50, 3, 3)))[0]
    frames[np.linalg.det(frames) < 0] *= -1.0
    poses = np.zeros((50, POSE))
    poses[:, LIFT], poses[:, ROLL], poses[:, LENGTH] = rng.uniform(-3, 3, 50), rng.uniform(-3, 3, 50), 1.0
    vanes = np.repeat(LINE[:, ::16], 50, axis=0)
    posed = pose_vanes(vanes, poses, np.zeros((50, 3), np.float32), frames.astype(np.float32))
    q = quaternions(frames.astype(np.float32), poses)
    w, v = q[:, 0, None, None, None], np.broadcast_to(q[:, None, None, 1:], vanes.shape)
    turned = vanes + 2.0 * (w * np.cross(v, vanes) + np.cross(v, np.cross(v, vanes)))
    np.testing.assert_allclose(posed, turned, atol=2e-6)

"""The comparison: a surface that is a smooth function of the pose is best foretold by the space that knows poses."""

import numpy as np

from core.pose.ablation import METHODS, leave_one_out, predicted
from core.pose.layers import Sculpt
from tests.core.pose.arms import arm, skinned_at, turned


def truth(rig, points, degrees, name):
    """An arm that swells with the bend of its elbow."""
    pose = turned(name, fore=(0, 0, degrees))
    share = np.clip(1 - ((points[:, :1] - 0.35) / 0.25) ** 2, 0, 1)
    swell = 0.05 * np.sin(np.radians(degrees)) * share * np.array([0.0, 1.0, 0.3])
    return Sculpt(pose, (skinned_at(rig, points, pose) + swell).astype(np.float32))


def test_every_method_is_asked_and_pose_space_wins():
    rig, points = arm(300)
    made = [truth(rig, points, d, f"bend {d}") for d in (20, 50, 80, 110, 140)]
    rows = leave_one_out(points, rig, made)
    assert {(r.method, r.pose) for r in rows} == {(m, s.pose.name) for m in METHODS for s in made}
    inner = {m: np.mean([r.rms for r in rows if r.method == m and r.pose in ("bend 50", "bend 80", "bend 110")])
             for m in METHODS}
    assert inner["PSD"] < 0.2 * inner["SSD"]
    assert inner["PSD"] < 0.2 * inner["SI"]
    assert inner["WPSD"] < 0.5 * inner["SSD"]
    for row in rows:
        assert row.worst >= row.rms >= 0


def test_euler_angles_fail_where_they_jump():
    """Two poses a hair apart on both sides of y = 90 degrees: the distance of their angles is that of a whole turn."""
    rig, points = arm(300)
    made = [Sculpt(p, (skinned_at(rig, points, p) + np.float32(0.03) * (points[:, :1] > 0.5)).astype(np.float32))
            for p in (turned("gimbal", fore=(0, 89, 0)),)]
    near = turned("near", fore=(80, 91, 80))
    found = {m: predicted(points, rig, made, near, m) - skinned_at(rig, points, near) for m in ("PSD", "Euler PSD")}
    assert np.abs(found["PSD"]).max() > 0.02
    assert np.abs(found["Euler PSD"]).max() < 0.01


def test_at_a_pose_it_knows_a_pose_space_is_exact():
    rig, points = arm(200)
    made = [truth(rig, points, d, f"bend {d}") for d in (30, 90)]
    for method in ("PSD", "Euler PSD", "WPSD", "SI"):
        found = predicted(points, rig, made[:1] if method == "SI" else made, made[0].pose, method)
        assert np.abs(found - made[0].target).max() <= 2e-6

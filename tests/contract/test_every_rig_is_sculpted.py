"""Sculpts at poses of every rig of the shared data are met, half turns of twist included."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from core.formats.rig_assembly import NoRig
from core.formats.rig_file import READ_SUFFIXES, read_rig
from core.pose.controls import twist_axes
from core.pose.layers import Sculpt, build
from core.pose.pose import Pose
from core.pose.rotation import quaternion_from_euler
from core.pose.synthesis import evaluate, prepare
from core.transform import quaternion_about

ANIMATION = Path(os.environ.get("FILOPLUME_DATA", "../shared/data")) / "animation"
RIGS = sorted(p.relative_to(ANIMATION).as_posix() for p in ANIMATION.rglob("*") if p.suffix in READ_SUFFIXES)

pytestmark = pytest.mark.skipif(not ANIMATION.is_dir(), reason="the shared data are not there")


def some_poses(rig):
    moves = np.bincount(rig.skin.joints.ravel(), rig.skin.weights.ravel(), len(rig.skeleton.names))
    poses = []
    for j in np.argsort(-moves)[:2]:
        name = rig.skeleton.names[j]
        for degrees in ((0, 0, 60), (30, -100, 20), (-75, 10, 40)):
            q = tuple(map(float, quaternion_from_euler(degrees)))
            poses.append(Pose(name=f"{name} {degrees}", rotations={name: q}))
        twist = tuple(map(float, quaternion_about(twist_axes(rig.skeleton)[j], np.pi)))
        poses.append(Pose(name=f"{name} half a turn", rotations={name: twist}))
    both = {**poses[0].rotations, **poses[-2].rotations} if poses else {}
    if len(both) == 2:
        poses.append(Pose(name="both", rotations=both))
    for control in [c for c in rig.controls if c.kind == "number"][:2]:
        far = max(control.low, control.high, key=lambda at: abs(at - control.rest))
        poses.append(Pose(name=f"{control.name} to its end", numbers={control.name: far}))
    return poses


@pytest.mark.parametrize("name", RIGS)
def test_sculpts_are_met(name):
    try:
        found = read_rig(ANIMATION / name)
    except NoRig:
        return
    if found.mesh is None or not len(found.mesh.points):
        return
    rig, points = found.rig, found.mesh.points
    rng = np.random.default_rng(0)
    size = np.linalg.norm(np.ptp(points, axis=0))
    bump = np.exp(-((points - points[rng.integers(len(points))]) / (0.2 * size)) ** 2).prod(axis=1)[:, None]
    sculpts = []
    for pose in some_poses(rig):
        push = bump * rng.normal(size=3) * 0.05 * size
        sculpts.append(Sculpt(pose, (evaluate(points, rig, None, pose) + push).astype(np.float32)))
    for kernel in ("gaussian", "thin-plate"):
        made = build(points, rig, sculpts, kernel=kernel).correctives
        ready = prepare(made, rig)
        for sculpt in sculpts:
            posed = evaluate(points, rig, made, sculpt.pose, prepared=ready)
            box = max(size, np.linalg.norm(np.ptp(sculpt.target, axis=0)))
            assert np.abs(posed - sculpt.target).max() <= 1e-6 * box, sculpt.pose.name

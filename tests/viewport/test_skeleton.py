"""Marks of a skeleton: where its joints are on the screen, and which of them stand out."""

from __future__ import annotations

import numpy as np
import pytest

from core.camera import Camera, clip_from_world, frame_points
from core.demo.arm import arm
from core.groom.region import View
from core.overlay import Circle, Polyline
from core.pose.pose import REST, Pose
from viewport.skeleton import joint_places, skeleton_marks

SIZE = (640, 400)


def camera() -> Camera:
    return frame_points(arm().mesh.points, (0.0, -0.1, -1.0), SIZE[0] / SIZE[1])


def test_rings_lie_where_the_view_has_the_joints() -> None:
    skeleton = arm().rig.skeleton
    places = joint_places(skeleton, REST)
    assert np.abs(places - skeleton.bind[:, :3, 3]).max() < 1e-9
    marks = skeleton_marks(skeleton, places, ("elbow",), camera(), SIZE)
    rings = [m for m in marks if isinstance(m, Circle)]
    assert len(rings) == len(skeleton.names)
    pixels, _ = View(clip_from_world(camera(), *SIZE), *SIZE).pixels(places)
    assert np.array([(m.x, m.y) for m in rings]) == pytest.approx(pixels, abs=1e-6)
    assert [name for name, m in zip(skeleton.names, rings, strict=True) if m.tone == "selected"] == ["elbow"]
    assert len([m for m in marks if isinstance(m, Polyline)]) == int((skeleton.parents >= 0).sum())


def test_joints_behind_the_eye_are_left_out() -> None:
    skeleton = arm().rig.skeleton
    places = joint_places(skeleton, Pose()) + camera().world_from_camera[:3, 2] * 1e3
    assert skeleton_marks(skeleton, places, (), camera(), SIZE) == ()

"""The demo of pose space against its promises."""

import numpy as np
import pytest
import trimesh

from core.demo.arm import arm
from core.demo.pose_document import pose_document
from core.demo.shape import opposites
from core.document import problems
from core.mesh.triangulate import triangulate
from core.pose.pose import Pose
from core.pose.synthesis import evaluate


@pytest.fixture(scope="module")
def document():
    return pose_document()


def body(item, points):
    return trimesh.Trimesh(points, triangulate(item.mesh).vertices, process=False)


def sculpted(item):
    return {s.name: s.pose for layer in item.correctives.layers for s in layer.space.samples}


def test_closed_oriented_meshes_with_their_poses(document):
    limb, head = document.meshes
    assert not problems(document)
    for item in document.meshes:
        whole = body(item, item.mesh.points)
        assert whole.is_watertight
        assert whole.is_winding_consistent
        assert whole.volume > 0.0
        assert np.all(item.mesh.counts == 4)
    assert limb.mesh.uvs.min() >= 0.0
    assert limb.mesh.uvs.max() <= 1.0
    assert set(sculpted(limb)) == {"elbow bent", "forearm twisted", "shoulder raised"}
    assert set(sculpted(head)) == {"joy", "anger", "sadness", "calm"}
    assert {c.name for c in head.rig.controls} == {"valence", "arousal"}


def test_the_sculpts_keep_the_volume_that_linear_skinning_loses(document):
    limb = document.meshes[0]
    for name in ("elbow bent", "forearm twisted"):  # a raised shoulder folds into itself
        pose = sculpted(limb)[name]
        plain = body(limb, evaluate(limb.mesh.points, limb.rig, None, pose)).volume
        kept = body(limb, evaluate(limb.mesh.points, limb.rig, limb.correctives, pose)).volume
        whole = body(limb, limb.mesh.points).volume
        assert plain < whole, name
        assert abs(kept - whole) < abs(plain - whole), name


def test_the_forearm_is_as_thick_twisted_as_at_rest(document):
    limb = document.meshes[0]
    ring = np.abs(limb.mesh.points[:, 0] - 0.445) < 0.01
    pose = sculpted(limb)["forearm twisted"]

    def thickness(points):
        here = points[ring].astype(np.float64)
        return float(np.linalg.norm(here - here.mean(axis=0), axis=1).mean())

    rest = thickness(limb.mesh.points)
    assert thickness(evaluate(limb.mesh.points, limb.rig, None, pose)) < 0.55 * rest
    assert abs(thickness(evaluate(limb.mesh.points, limb.rig, limb.correctives, pose)) - rest) < 0.1 * rest


def test_the_face_is_symmetric_and_every_mood_another(document):
    head = document.meshes[1]
    centre = np.float32([head.mesh.points[:, 0].min() + head.mesh.points[:, 0].max(), 0.0, 0.0]) / 2.0
    pairs = opposites(np.round(head.mesh.points - centre, 6))
    shapes = [evaluate(head.mesh.points, head.rig, head.correctives, pose) for pose in sculpted(head).values()]
    for points in (head.mesh.points, *shapes):
        moved = points - centre
        assert np.abs(moved[pairs] - moved * np.float32([-1, 1, 1])).max() < 1e-5
    for i, a in enumerate(shapes):
        for b in shapes[:i]:
            assert np.linalg.norm(a - b, axis=1).max() > 0.004


def test_a_lowered_shoulder_hardly_feels_the_sculpt_of_the_raised_one(document):
    limb = document.meshes[0]

    def correction(pose):
        plain = evaluate(limb.mesh.points, limb.rig, None, pose)
        moved = evaluate(limb.mesh.points, limb.rig, limb.correctives, pose) - plain
        return float(np.linalg.norm(moved, axis=1).max())

    lowered = Pose(rotations={"shoulder": (0.0, 0.0, float(np.sin(-0.6)), float(np.cos(-0.6)))})
    assert correction(lowered) < 0.25 * correction(sculpted(limb)["shoulder raised"])


def test_it_is_always_the_same():
    assert np.array_equal(arm().mesh.points, arm().mesh.points)

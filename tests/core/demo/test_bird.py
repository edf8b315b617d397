"""The demo bird against its promises; trimesh is the judge of its shape."""

import numpy as np
import pytest
import trimesh

from core.demo.bird import PARTS, demo_bird
from core.demo.shape import opposites
from core.pose.skinning import posed_points


@pytest.fixture(scope="module")
def bird():
    return demo_bird()


def test_one_closed_oriented_body_of_quads(bird):
    mesh = bird.mesh
    assert np.all(mesh.counts == 4)
    corners = mesh.corners.reshape(-1, 4)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    body = trimesh.Trimesh(mesh.points, corners, process=False)
    assert body.is_watertight
    assert body.is_winding_consistent
    assert body.volume > 0.0
    assert body.euler_number == 2  # a sphere with limbs, no handle
    assert len(body.split(only_watertight=False)) == 1


def test_it_is_as_large_as_a_finch_and_symmetric(bird):
    points = bird.mesh.points
    assert points[:, 1].min() == pytest.approx(0.0, abs=0.001)  # stands on the ground
    assert 0.10 < np.ptp(points[:, 2]) < 0.13
    assert 0.11 < np.ptp(points[:, 0]) < 0.14  # across its arms
    pairs = opposites(points)
    np.testing.assert_array_equal(points[pairs] * [-1, 1, 1], points)
    assert set(np.unique(bird.mesh.parts)) == set(range(len(PARTS)))


def test_uvs_lie_in_the_square(bird):
    assert bird.mesh.uvs.min() >= 0.0
    assert bird.mesh.uvs.max() <= 1.0


def test_its_clip_folds_both_wings_alike_and_turns_the_head(bird):
    mesh, rig = bird.mesh, bird.rig
    names = rig.skeleton.names
    pairs = opposites(mesh.points)
    hand = np.flatnonzero((rig.skin.joints == names.index("hand_left")).any(axis=1) & (mesh.points[:, 0] > 0.055))
    beak = np.flatnonzero(np.repeat(bird.mesh.parts, 4) == PARTS.index("beak"))
    tip = mesh.corners[beak][np.argmax(mesh.points[mesh.corners[beak], 2])]
    spans, looks = {}, {}
    for frame in (1001.0, 1006.0, 1024.0, 1041.0):
        posed = posed_points(mesh.points, rig, frame)
        spans[frame], looks[frame] = posed[hand, 0].mean(), posed[tip, 0]
        assert np.isfinite(posed).all()
        if frame != 1001.0:
            continue
        # the head does not turn yet, so that left and right are alike
        np.testing.assert_allclose(posed[pairs] * [-1, 1, 1], posed, atol=1e-5)
    assert spans[1001.0] < 0.025 < 0.05 < spans[1024.0]
    assert looks[1006.0] > 0.008
    assert looks[1041.0] < -0.008
    end = posed_points(mesh.points, rig, rig.clip.end)
    np.testing.assert_allclose(end[hand, 0].mean(), spans[1001.0], atol=1e-4)


def test_it_is_always_the_same(bird):
    again = demo_bird()
    np.testing.assert_array_equal(again.mesh.points, bird.mesh.points)
    np.testing.assert_array_equal(again.rig.clip.rotations, bird.rig.clip.rotations)

"""Which hairs are drawn while the hand moves."""

from __future__ import annotations

import numpy as np
import pytest

from tests.viewport.scenes import FLAT, ball, camera, hairs
from viewport.near_side import (
    AWAY,
    MOST_COVER,
    MOST_TURNING,
    TURNING_POINTS,
    WIDER,
    near_guides,
    shown_rows,
    sparse_coat,
    sparse_points,
)
from viewport.scene import GuideLines

SIZE, LARGE = (1600, 1000), (160_000, 100_000)


@pytest.mark.parametrize("orthographic", [False, True])
def test_only_hairs_on_the_far_side_are_left_out(orthographic):
    _, coat = ball()
    cam = camera((0.0, 0.0, 4.0), orthographic=orthographic)
    rows = shown_rows(coat, cam, near_only=True)
    normals = coat.normals.astype(float)
    to_eye = np.array([0.0, 0.0, 4.0]) - normals if not orthographic else np.tile([0.0, 0.0, 1.0], (len(normals), 1))
    cosine = (normals * to_eye).sum(axis=1) / np.linalg.norm(to_eye, axis=1)
    assert np.array_equal(rows, np.flatnonzero(cosine > AWAY))
    assert shown_rows(coat, cam, near_only=False) is None


def test_the_first_part_of_the_order_is_taken_and_widened():
    _, coat = ball(4000, look=FLAT._replace(tip_width=0.001))
    order = np.random.default_rng(1).permutation(4000).astype(np.int32)
    coat = coat._replace(order=order, tints=np.random.default_rng(2).random((4000, 3)).astype(np.float32))
    sparse = sparse_coat(coat, camera(), 500, SIZE)
    assert set(sparse.order) <= set(order[:500])
    assert 200 < len(sparse.points) < 400
    for mine, theirs in ((sparse.ids, coat.ids), (sparse.normals, coat.normals), (sparse.tints, coat.tints)):
        assert np.array_equal(mine, theirs[sparse.order])
    assert np.array_equal(sparse.points[:, :, [0, -1]], coat.points[sparse.order][:, :, [0, -1]])
    assert coat.look.root_width * 2.0 < sparse.look.root_width < coat.look.root_width * 8.0


def test_all_of_a_coat_that_faces_the_eye_is_the_coat():
    roots = np.random.default_rng(3).uniform(-0.4, 0.4, (200, 3))
    coat = hairs(roots, roots + np.array([0.0, 0.1, 0.0]))
    whole = sparse_coat(coat, camera(), 10_000, LARGE)
    assert np.array_equal(whole.points, coat.points)
    assert whole.look == coat.look
    hidden = coat._replace(order=np.arange(0, 200, 2, dtype=np.int32))
    assert np.array_equal(sparse_coat(hidden, camera(), 10_000, LARGE).points, coat.points[::2])


def test_points_written_in_place_are_gathered_again_for_the_same_hairs():
    _, coat = ball(1000)
    sparse = sparse_coat(coat, camera(), 300, SIZE)
    coat.points[:] += 0.5
    again = sparse_points(coat, sparse)
    np.testing.assert_allclose(again.points, sparse.points + 0.5, atol=1e-6)
    assert again.normals is sparse.normals
    assert again.ids is sparse.ids


def test_guides_without_normals_are_all_drawn_and_others_from_the_near_side():
    _, coat = ball(600)
    turned = np.ascontiguousarray(coat.points.transpose(0, 2, 1))
    states = np.arange(600).astype(np.uint8) % 5
    few = near_guides(GuideLines(turned, states), camera(), turning=True)
    assert few.points.shape[1:] in ((3, TURNING_POINTS), (TURNING_POINTS, 3))
    many = np.tile(turned, (-(-3 * MOST_TURNING // len(turned)), 1, 1))
    thin = near_guides(GuideLines(many, np.arange(len(many), dtype=np.uint32)), camera(), turning=True)
    assert MOST_TURNING // 2 < len(thin.points) <= MOST_TURNING
    assert len(np.unique(np.diff(thin.states))) == 1, "even steps"
    every = near_guides(GuideLines(turned, states), camera())
    assert np.array_equal(every.points, turned)
    near = near_guides(GuideLines(turned, states, normals=coat.normals), camera())
    rows = shown_rows(coat, camera(), near_only=True)
    assert np.array_equal(near.points, turned[rows])
    assert np.array_equal(near.states, states[rows])


def test_an_empty_coat_stays_empty():
    _, coat = ball(10)
    empty = coat._replace(points=coat.points[:0], ids=coat.ids[:0], normals=coat.normals[:0])
    assert len(sparse_coat(empty, camera(), 100, SIZE).points) == 0


def test_widened_hairs_cover_no_more_than_filling_them_may_cost():
    _, coat = ball(20_000, length=0.5, look=FLAT._replace(root_width=0.002))
    cam = camera(orthographic=True, height=2.0)
    sparse = sparse_coat(coat, cam, 3000, SIZE)
    length = np.linalg.norm(sparse.points[:, :, -1] - sparse.points[:, :, 0], axis=1)
    pixels = (length * sparse.look.root_width).sum() * 500.0**2
    assert pixels < 1.3 * MOST_COVER * 1600 * 1000
    assert sparse.look.root_width >= coat.look.root_width
    thin = sparse_coat(coat._replace(look=coat.look._replace(root_width=0.0005)), cam, 3000, SIZE)
    assert thin.look.root_width == pytest.approx(0.0005 * (20_000 / 3000) ** WIDER, rel=0.05)

"""Hairs land where the camera says, as wide as they are, in the right order."""

from __future__ import annotations

import numpy as np
import pytest

from core.camera import pixel_scale, project, view_from_world
from core.random import rand
from tests.viewport.scenes import FLAT, camera, hairs, quad
from viewport.ribbons import drawn_points, far_to_near
from viewport.scene import Scene

W, H = 200, 120


def width_factor(hair_id: int) -> float:
    return float(0.75 + 0.5 * rand(np.array([hair_id]), 14)[0])


@pytest.mark.parametrize("orthographic", [False, True])
def test_a_hair_lies_on_its_projection(draw, orthographic):
    cam = camera(eye=(1.0, 0.7, 4.0), orthographic=orthographic, height=2.0)
    root, tip = np.array([-0.7, -0.2, 0.3]), np.array([0.6, 0.35, -0.4])
    alpha = draw(Scene(coats=(hairs(root, tip),)), cam, W, H)[..., 3]
    (x0, y0), (x1, y1) = project(cam, np.stack([root, tip]), W, H).xy
    columns = np.flatnonzero(alpha.sum(axis=0) > 0.05)
    assert abs(columns.min() - x0) <= 1.0
    assert abs(columns.max() - x1) <= 1.0
    inner = columns[3:-3]
    centre = (alpha[:, inner] * np.arange(H)[:, None]).sum(axis=0) / alpha[:, inner].sum(axis=0)
    assert np.abs(centre - (y0 + (inner - x0) / (x1 - x0) * (y1 - y0))).max() < 0.25


@pytest.mark.parametrize("pixels", [0.05, 0.2, 0.5, 1.0, 1.7, 6.3])
def test_coverage_across_a_hair_is_its_width_in_pixels(draw, pixels):
    cam = camera(orthographic=True, height=2.0)
    metres = pixels / pixel_scale(cam, H)
    look = FLAT._replace(root_width=metres, tip_width=metres)
    alpha = draw(Scene(coats=(hairs([0.013, -0.8, 0], [0.013, 0.8, 0], look=look, ids=[7]),)), cam, W, H)[..., 3]
    across = alpha[H // 4 : 3 * H // 4].sum(axis=1)
    np.testing.assert_allclose(across, pixels * width_factor(7), rtol=0.02)


def test_coverage_of_thin_slanted_hairs_is_width_times_length(draw):
    cam = camera(orthographic=True, height=2.0)
    for angle in (0.2, 0.5, 0.785, 1.2):
        end = 0.7 * np.array([np.cos(angle), np.sin(angle), 0.0])
        sums = []
        for pixels in (0.1, 0.2, 0.8):
            metres = pixels / pixel_scale(cam, H)
            look = FLAT._replace(root_width=metres, tip_width=metres)
            alpha = draw(Scene(coats=(hairs(-end, end, look=look, ids=[2]),)), cam, W, H)[..., 3]
            sums.append(alpha.sum() / (pixels * width_factor(2) * 1.4 * pixel_scale(cam, H)))
        np.testing.assert_allclose(sums, 1.0, atol=0.02)
        assert abs(sums[1] / sums[0] - 1.0) < 0.02


def test_a_hair_tapers_to_its_tip(draw):
    cam = camera(orthographic=True, height=2.0)
    look = FLAT._replace(root_width=8 / pixel_scale(cam, H), tip_width=0.0)
    alpha = draw(Scene(coats=(hairs([0, -0.9, 0], [0, 0.9, 0], points=16, look=look),)), cam, W, H)[..., 3]
    rows = np.arange(H)
    _, y = project(cam, np.array([[0, -0.9, 0], [0, 0.9, 0]]), W, H).xy.T
    u = (rows - y[0]) / (y[1] - y[0])
    inside = (u > 0.05) & (u < 0.95)
    expected = 8 * width_factor(0) * (1 - u**2)
    np.testing.assert_allclose(alpha.sum(axis=1)[inside], expected[inside], atol=0.12)


def test_skin_hides_hair_behind_it_and_not_before_it(draw):
    cam = camera()
    behind, before = ([-0.5, 0, -0.5], [0.5, 0, -0.5]), ([-0.5, 0, 0.5], [0.5, 0, 0.5])
    both = Scene(surfaces=(quad(),), coats=(hairs(*behind),))
    hidden = draw(both, cam, W, H)
    stripe = slice(H // 2 - 2, H // 2 + 2), slice(W // 2 - 8, W // 2 + 8)
    other = slice(H // 2 - 12, H // 2 - 8), slice(W // 2 - 8, W // 2 + 8)
    np.testing.assert_allclose(hidden[stripe], hidden[other], rtol=0.02)
    blue = hairs(*before, look=FLAT._replace(gloss=0.0), tints=[[0.0, 0.0, 9.0]])
    shown = draw(both._replace(coats=(blue,)), cam, W, H)
    assert (shown[stripe][..., 2] / shown[stripe][..., 0]).max() > 1.5


def test_the_nearer_hair_covers_the_farther_whatever_their_order(draw):
    cam = camera()
    wide = FLAT._replace(root_width=0.2, tip_width=0.2, gloss=0.0)
    roots, tips = [[-0.6, 0, 0.3], [0, -0.6, -0.3]], [[0.6, 0, 0.3], [0, 0.6, -0.3]]
    tints = [[4.0, 0.01, 0.01], [0.01, 0.01, 4.0]]
    for order in ([0, 1], [1, 0]):
        coat = hairs(np.array(roots)[order], np.array(tips)[order], look=wide, tints=np.array(tints)[order])
        middle = draw(Scene(coats=(coat,)), cam, W, H)[H // 2, W // 2]
        assert middle[0] > 10 * middle[2]


def sorted_pieces(*arguments) -> np.ndarray:
    steps = far_to_near(*arguments)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def test_order_is_by_depth_for_both_layouts():
    points = np.random.default_rng(5).normal(size=(500, 3, 9)).astype(np.float32)
    row = -view_from_world(camera(eye=(2.0, 1.0, 3.0)))[2]
    order = sorted_pieces(points, row)
    depth = np.einsum("c,ncp->np", row[:3], points.astype(float))
    middle = (0.5 * (depth[:, 1:] + depth[:, :-1])).reshape(-1)
    assert np.array_equal(np.sort(order), np.arange(500 * 8))
    assert np.diff(middle[order]).max() <= 2 * np.ptp(middle) / 65535
    assert np.array_equal(order, sorted_pieces(np.ascontiguousarray(points.transpose(0, 2, 1)), row))


def test_tiny_pieces_of_hair_are_joined_and_both_ends_kept(draw):
    points = hairs([0.0, 0.0, 0.0], [0.0, 1.5, 0.0], points=16).points  # pieces of 0.1
    assert np.array_equal(drawn_points(points, 1000.0), np.arange(16))
    assert np.array_equal(drawn_points(points, 17.5), [0, 2, 4, 6, 8, 10, 12, 14, 15])
    assert np.array_equal(drawn_points(points, 1e-3), [0, 3, 6, 9, 12, 15])
    assert np.array_equal(drawn_points(points[:, :, :3], 1e-3), [0, 1, 2])
    cam = camera(orthographic=True, height=2.0)
    metres = 2.0 / pixel_scale(cam, H)
    look = FLAT._replace(root_width=metres, tip_width=metres)
    for count in (3, 16, 60):  # 96 pixels long: pieces of 48, 6 and 1.6 pixels cover the same
        alpha = draw(Scene(coats=(hairs([0, -0.8, 0], [0, 0.8, 0], points=count, look=look),)), cam, W, H)[..., 3]
        assert abs(alpha.sum() / (2.0 * width_factor(0) * 96) - 1.0) < 0.02

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.camera import Camera, clip_from_world, look_at, project
from core.groom.chain import first_free
from core.groom.region import (
    View,
    distance_to_path,
    editable,
    facing,
    inside_polygon,
    neighbours,
    screen_weights,
    segment_freedom,
    side_of_line,
    world_weights,
)
from tests.core.groom.small_grooms import fur, mixed, view


@pytest.mark.parametrize("orthographic", [True, False])
def test_pixels_are_those_of_the_camera_and_motion_is_exact(orthographic):
    camera = Camera(world_from_camera=look_at([3, 2, 5], [0.1, 0, 0]), orthographic=orthographic, height=4)
    v = View(clip_from_world(camera, 640, 480), 640, 480)
    points = np.random.default_rng(0).normal(0, 0.5, (50, 3))
    pixels, w = v.pixels(points)
    assert np.allclose(pixels, project(camera, points, 640, 480).xy, atol=1e-9)
    for pixel_motion in ([7.0, -4.0], [0.0, 11.0]):
        ndc = np.array([2 * pixel_motion[0] / 640, -2 * pixel_motion[1] / 480])
        moved = points + w[:, None] * (v.motion_basis() @ ndc)
        assert np.allclose(v.pixels(moved)[0] - pixels, pixel_motion, atol=1e-9)
        assert np.allclose(project(camera, moved, 640, 480).depth, project(camera, points, 640, 480).depth)
    toward = v.toward_eye(points)
    wanted = camera.position - points if not orthographic else np.broadcast_to(-camera.forward, points.shape)
    assert np.allclose(toward, wanted / np.linalg.norm(wanted, axis=1, keepdims=True))


def test_points_behind_the_eye_are_not_reached():
    v = view(orthographic=False)
    behind = np.array([[0.0, 0.0, 12.0]])  # the eye is at z = 6; this projects to the middle
    assert np.allclose(v.pixels(behind)[0], 199.5)
    assert screen_weights(behind, v, [[199.5, 199.5]], 50)[0] == 0.0
    assert screen_weights(-behind, v, [[199.5, 199.5]], 50)[0] == 1.0


def test_weights_fall_from_the_middle_to_the_rim():
    v = view()
    w = screen_weights(np.array([[0, 0, 0], [0.45, 0, 0], [0.9, 0, 0], [1.0, 0, 0]]), v, [[199.5, 199.5]], 100)
    assert np.allclose(w, [1, 0.5, 0, 0], atol=1e-9)
    assert np.allclose(world_weights([[0, 0, 0], [0, 1, 0], [0, 0, 3]], [0, 0, 0], 2), [1, 0.5, 0])
    assert np.allclose(distance_to_path(np.array([[5.0, 3.0], [14.0, 3.0]]), [[0, 0], [10, 0]]), [3, 5])


def test_facing_is_the_side_toward_the_eye():
    g = fur()
    assert np.array_equal(facing(g, view((0, 0, -1)), 0.0), g.points[:, 0, 2] > 0) or (
        np.abs(g.points[facing(g, view((0, 0, -1)), 0.0) != (g.points[:, 0, 2] > 0), 0, 2]).max() < 0.05)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**31))
def test_inside_a_convex_polygon_agrees_with_half_planes(seed):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 7))
    polygon = np.stack([np.cos(angle), np.sin(angle)], axis=1) * rng.uniform(1, 3)
    p = rng.uniform(-3, 3, (200, 2))
    edge = np.roll(polygon, -1, axis=0) - polygon
    rel = p[:, None] - polygon
    assert np.array_equal(inside_polygon(p, polygon), (edge[:, 0] * rel[..., 1] - edge[:, 1] * rel[..., 0] > 0).all(1))


def test_a_hole_in_a_star_is_outside():
    star = np.array([[np.sin(a), np.cos(a)] for a in np.arange(5) * 4 * np.pi / 5])
    assert not inside_polygon(np.zeros((1, 2)), star)[0]  # even-odd
    assert inside_polygon(np.array([[0.0, 0.8]]), star)[0]


def test_a_line_divides_the_whole_picture():
    g, v = fur(), view()
    x = v.pixels(g.points[:, 0])[0][:, 0]
    side = side_of_line(g, v, [[200, 180], [200, 220]])
    assert np.array_equal(side > 0, x < 200) or np.array_equal(side > 0, x > 200)
    assert np.array_equal(side_of_line(g, v, [[200, 220], [200, 180]]), -side)


def test_neighbours_are_the_nearest_others():
    roots = np.random.default_rng(1).normal(size=(40, 3)).astype(np.float32)
    roots[7] = roots[3]  # coincident roots are neighbours of each other
    d = np.linalg.norm(roots[:, None].astype(float) - roots[None], axis=-1)
    np.fill_diagonal(d, np.inf)
    near = neighbours(roots, 5)
    assert near.shape == (40, 5)
    assert not (near == np.arange(40)[:, None]).any()
    assert np.allclose(np.sort(np.take_along_axis(d, near, 1), 1), np.sort(d, 1)[:, :5])
    assert neighbours(roots[:3], 5).shape == (3, 2)
    assert neighbours(roots[:1], 5).shape == (1, 0)


def test_freedom_of_arrays_agrees_with_that_of_the_kernel():
    g = mixed(3)
    want = np.empty((len(g), g.hold.shape[1] - 1))
    for row in range(len(g)):
        first_free(g.hold, row, want[row])
    assert np.allclose(segment_freedom(g.hold), want)


def test_only_the_selected_are_editable_once_any_is():
    g = fur(4)
    frozen, selected = np.array([1, 0, 0, 1], bool), np.array([1, 1, 0, 0], bool)
    assert editable(g.replace(frozen=frozen)).tolist() == [False, True, True, False]
    assert editable(g.replace(frozen=frozen, selected=selected)).tolist() == [False, True, False, False]

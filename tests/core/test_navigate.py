"""Truths: projection itself. The pivot keeps its pixel, what is under the cursor follows it, sizes stay."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core import camera as cam
from core import navigate as nav

W, H = 800, 500
angle = st.floats(-3.0, 3.0)
place = st.floats(-1.5, 1.5)
either = st.booleans()


def some_camera(orthographic=False, eye=(2.0, 1.5, 3.0)):
    return cam.Camera(
        world_from_camera=cam.look_at(eye, (0.1, 0.2, 0.3)), field_of_view=0.7, orthographic=orthographic, height=2.0)


def pixel(camera, point):
    return cam.project(camera, point, W, H).xy


def roll(camera):
    """How far the picture's right is from level."""
    return abs(camera.world_from_camera[1, 0])


@given(angle, angle, place, place, either, either)
def test_the_pivot_keeps_its_pixel_and_distance_when_the_view_turns(yaw, pitch, x, y, orthographic, ball):
    camera, pivot = some_camera(orthographic), np.array([x, y, 0.3])
    turned = (nav.tumble if ball else nav.orbit)(camera, pivot, yaw, pitch)
    assert np.allclose(pixel(turned, pivot), pixel(camera, pivot), atol=1e-6)
    assert nav.depth_of(turned, pivot) == pytest.approx(nav.depth_of(camera, pivot))


@given(st.lists(st.tuples(angle, angle), min_size=1, max_size=12))
def test_up_stays_up_on_a_turntable_however_it_is_turned(turns):
    camera = some_camera()
    for yaw, pitch in turns:
        camera = nav.orbit(camera, (0.0, 0.4, 0.0), yaw, pitch)
        assert roll(camera) < 1e-6
        assert camera.world_from_camera[1, 1] >= 0.0  # never on its head


def test_yaw_goes_to_the_right_and_pitch_up():
    camera = cam.Camera(world_from_camera=cam.look_at((0, 0, 5), (0, 0, 0)))
    right, above = nav.orbit(camera, (0, 0, 0), 0.3, 0.0), nav.orbit(camera, (0, 0, 0), 0.0, 0.3)
    assert right.position == pytest.approx([5 * np.sin(0.3), 0.0, 5 * np.cos(0.3)])
    assert above.position == pytest.approx([0.0, 5 * np.sin(0.3), 5 * np.cos(0.3)])
    top = nav.orbit(camera, (0, 0, 0), 0.0, 9.0)
    assert top.forward @ (0, -1, 0) == pytest.approx(1.0)
    assert np.isfinite(nav.orbit(top, (0, 0, 0), 1.0, -0.2).position).all()


@given(st.floats(-300, 300), st.floats(-300, 300), place, either)
def test_what_is_grabbed_follows_the_cursor(across, down, x, orthographic):
    camera, grabbed = some_camera(orthographic), np.array([x, 0.4, 0.2])
    moved = nav.pan(camera, grabbed, across, down, H)
    assert np.allclose(pixel(moved, grabbed) - pixel(camera, grabbed), (across, down), atol=1e-6)


@given(st.floats(0.01, 50.0), place, place, either)
def test_a_dolly_keeps_the_pixel_of_its_goal_and_scales_its_distance(factor, x, y, orthographic):
    camera, goal = some_camera(orthographic), np.array([x, y, 0.2])
    moved = nav.dolly(camera, goal, factor)
    assert np.allclose(pixel(moved, goal), pixel(camera, goal), atol=1e-6)
    beside = goal + 1e-3 * camera.world_from_camera[:3, 0]
    grown = np.linalg.norm(pixel(moved, beside) - pixel(moved, goal))
    assert grown * factor == pytest.approx(np.linalg.norm(pixel(camera, beside) - pixel(camera, goal)), rel=1e-4)


def test_a_dolly_never_goes_through_what_it_approaches():
    camera = some_camera()
    for _ in range(200):
        camera = nav.dolly(camera, (0.1, 0.2, 0.3), 0.5)
    assert nav.depth_of(camera, (0.1, 0.2, 0.3)) > 0.0
    for _ in range(400):
        camera = nav.dolly(camera, (0.1, 0.2, 0.3), 3.0)
    assert np.isfinite(camera.position).all()


@given(place, place, place)
def test_projections_agree_at_the_pivot_and_come_back(x, y, z):
    camera, pivot = some_camera(), np.array([x, y, z])
    beside = pivot + 1e-4 * camera.world_from_camera[:3, 1]
    parallel = nav.with_projection(camera, pivot, True)
    assert np.allclose(pixel(parallel, pivot), pixel(camera, pivot), atol=1e-6)
    size = np.linalg.norm(pixel(parallel, beside) - pixel(parallel, pivot))
    assert size == pytest.approx(np.linalg.norm(pixel(camera, beside) - pixel(camera, pivot)), rel=1e-3)
    back = nav.with_projection(parallel, pivot, False)
    assert np.allclose(back.world_from_camera, camera.world_from_camera, atol=1e-9)
    assert nav.with_projection(camera, pivot, False) is camera


def test_a_lens_makes_the_middle_larger():
    camera = some_camera()
    point = camera.position + camera.forward + 0.01 * camera.world_from_camera[:3, 0]
    middle = np.array([W / 2 - 0.5, H / 2 - 0.5])
    before, after = pixel(camera, point) - middle, pixel(nav.zoom(camera, 0.5), point) - middle
    assert after == pytest.approx(2.0 * before)
    parallel = some_camera(True)
    assert nav.zoom(parallel, 0.5).height == 0.5 * parallel.height


@pytest.mark.parametrize("orthographic", [False, True])
def test_framed_points_are_seen_from_the_same_side(orthographic):
    camera = nav.orbit(some_camera(orthographic), (0, 0, 0), 0.5, 0.3)
    points = np.random.default_rng(1).normal(size=(200, 3)) * 0.2 + (3, 4, 5)
    framed = nav.frame(camera, points, W / H)
    assert np.allclose(framed.world_from_camera[:3, :3], camera.world_from_camera[:3, :3], atol=1e-9)
    xy, depth = cam.project(framed, points, W, H)
    assert (xy >= 0).all()
    assert (xy <= (W, H)).all()
    assert (depth > framed.near).all()
    assert (depth < framed.far).all()


@pytest.mark.parametrize("side", list(nav.SIDES))
def test_a_standard_view_looks_there_with_the_pivot_in_the_middle(side):
    camera, pivot = some_camera(), np.array([0.3, 0.1, 0.2])
    turned = nav.turned_to(camera, pivot, nav.SIDES[side])
    direction = np.array(nav.SIDES[side]) / np.linalg.norm(nav.SIDES[side])
    assert turned.forward == pytest.approx(direction)
    assert pixel(turned, pivot) == pytest.approx([W / 2 - 0.5, H / 2 - 0.5])
    assert np.linalg.norm(turned.position - pivot) == pytest.approx(np.linalg.norm(camera.position - pivot))
    if side not in ("top", "bottom"):
        assert roll(turned) < 1e-9
    assert nav.turned_to(turned, pivot, nav.SIDES[side]).world_from_camera == pytest.approx(turned.world_from_camera)


@given(st.floats(0.02, 40.0), either)
def test_near_and_far_hold_everything_before_the_eye(distance, orthographic):
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (0, 1) for z in (-2, 2)], float)
    camera = some_camera(orthographic, eye=(0.3, distance, distance))
    clipped = nav.with_clipping(camera, corners)
    depth = (corners - clipped.position) @ clipped.forward
    assert 0 < clipped.near < clipped.far
    assert (depth < clipped.far).all()
    assert ((depth > clipped.near) | (not orthographic and depth.min() < 0.1)).all()
    assert np.allclose(pixel(clipped, (0.1, 0.2, 0.3)), pixel(camera, (0.1, 0.2, 0.3)))
    assert clipped.far / clipped.near < 1.1e5
    assert nav.with_clipping(camera, np.zeros((0, 3))) is camera

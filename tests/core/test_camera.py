"""Truths: OpenCV's pinhole projection, the GL matrix, and rays that come back to their pixels."""

import cv2
import numpy as np
import pytest

from core import camera as cam
from core.transform import transform_points

rng = np.random.default_rng(7)
W, H = 640, 360


def some_camera(orthographic=False):
    pose = cam.look_at((2.0, 1.5, 3.0), (0.1, 0.2, 0.3))
    return cam.Camera(world_from_camera=pose, field_of_view=0.7, orthographic=orthographic, height=2.0)


def test_projection_agrees_with_opencv():
    camera, points = some_camera(), rng.normal(size=(200, 3)) * 0.5
    focal = 0.5 * H / np.tan(0.35)
    k = np.array([[focal, 0, (W - 1) / 2], [0, focal, (H - 1) / 2], [0, 0, 1]])  # pixel centres at whole numbers
    flip = np.diag([1.0, -1.0, -1.0, 1.0])  # OpenCV: y down, looks along +z
    m = flip @ np.linalg.inv(camera.world_from_camera)
    truth = cv2.projectPoints(points, cv2.Rodrigues(m[:3, :3])[0], m[:3, 3], k, None)[0][:, 0]
    got = cam.project(camera, points, W, H)
    assert np.allclose(got.xy, truth, atol=1e-8)
    assert np.allclose(got.depth, transform_points(m, points)[:, 2])


@pytest.mark.parametrize("orthographic", [False, True])
def test_matrix_agrees_with_projection_and_rays_come_back(orthographic):
    camera, points = some_camera(orthographic), rng.normal(size=(100, 3)) * 0.5
    clip = np.c_[points, np.ones(100)] @ cam.clip_from_world(camera, W, H).T
    ndc = clip[:, :3] / clip[:, 3:]
    xy, depth = cam.project(camera, points, W, H)
    assert np.allclose(xy, np.c_[(ndc[:, 0] + 1) * W / 2 - 0.5, (1 - ndc[:, 1]) * H / 2 - 0.5])
    ray = cam.ray_through(camera, xy, W, H)
    assert np.allclose(np.linalg.norm(ray.direction, axis=1), 1)
    assert np.allclose(np.cross(points - ray.origin, ray.direction), 0, atol=1e-12)
    assert np.allclose(cam.point_at_depth(camera, xy, depth, W, H), points)


def test_near_and_far_are_the_ends_of_clip_space():
    for camera in (some_camera(), some_camera(True)):
        ends = camera.position + np.outer([camera.near, camera.far], camera.forward)
        clip = np.c_[ends, np.ones(2)] @ cam.clip_from_world(camera, W, H).T
        assert np.allclose(clip[:, 2] / clip[:, 3], [-1, 1])


def test_point_in_the_plane_of_the_eye_is_finite():
    camera = some_camera()
    assert np.isfinite(cam.project(camera, camera.position, W, H).xy).all()


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.4])
@pytest.mark.parametrize("orthographic", [False, True])
def test_frame_points_fills_the_picture(aspect, orthographic):
    points = rng.normal(size=(300, 3)) * (3.0, 0.5, 1.0) + (10, 20, 30)
    camera = cam.frame_points(points, aspect=aspect, margin=1.0, orthographic=orthographic)
    h = 500
    w = round(h * aspect)
    xy, depth = cam.project(camera, points, w, h)
    assert depth.min() > camera.near
    assert depth.max() < camera.far
    low, high = xy.min(axis=0), xy.max(axis=0)
    assert np.all(low > -0.51)
    assert np.all(high < np.array([w, h]) - 0.49)
    spans = (high - low) / (w, h)
    assert spans.max() == pytest.approx(1.0, abs=1e-3)  # touches both borders of one axis
    assert np.allclose((low + high)[int(np.argmax(spans))], (w - 1, h - 1)[int(np.argmax(spans))], atol=0.1)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.zeros((1, 3)), np.full((5, 3), 7.0), [[0, 0, 0], [0, 0, 9]]])
def test_frame_points_of_next_to_nothing(points):
    camera = cam.frame_points(points)
    assert np.isfinite(cam.clip_from_world(camera, 64, 64)).all()


def test_camera_refuses_nonsense():
    for wrong in ({"near": -1.0}, {"field_of_view": 4.0}, {"world_from_camera": np.eye(4) * 2}):
        with pytest.raises(ValueError):
            cam.Camera(**{"world_from_camera": np.eye(4), **wrong})
    with pytest.raises(ValueError):
        cam.Camera(world_from_camera=np.diag([-1.0, 1, 1, 1]))


def test_straight_down_view_is_valid():
    assert np.isfinite(cam.look_at((0, 5, 0), (0, 0, 0))).all()
    cam.frame_points(rng.normal(size=(9, 3)), direction=(0, -1, 0))
    assert cam.focal_length_to_field_of_view(50.0, 24.0) == pytest.approx(2 * np.arctan(0.24))

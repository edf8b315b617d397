"""Strands on the screen, against numpy's projection."""

import numpy as np
import pytest

from core.camera import Camera, clip_from_world, look_at
from core.groom.project_strands import FAR, project_strands
from core.groom.region import View


@pytest.mark.parametrize("orthographic", [False, True])
def test_it_is_the_projection_of_every_point(orthographic):
    camera = Camera(world_from_camera=look_at((0.3, 0.2, 2.0), (0, 0, 0)), orthographic=orthographic, height=3.0)
    view = View(clip_from_world(camera, 640, 400), 640, 400)
    points = np.random.default_rng(3).uniform(-3.0, 3.0, (500, 7, 3)).astype(np.float32)
    pixels, low, high = project_strands(points, view)
    wanted, w = view.pixels(points)
    assert (w > 0.0).any()
    assert (w <= 0.0).any() != orthographic
    wanted[w <= 0.0] = FAR
    np.testing.assert_allclose(pixels, wanted, rtol=1e-12, atol=1e-9)
    np.testing.assert_array_equal(low, pixels.min(axis=1))
    np.testing.assert_array_equal(high, pixels.max(axis=1))


def test_no_strands():
    pixels, low, high = project_strands(np.zeros((0, 5, 3), np.float32), View(np.eye(4), 10, 10))
    assert (pixels.shape, low.shape, high.shape) == ((0, 5, 2), (0, 2), (0, 2))

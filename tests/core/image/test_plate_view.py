"""A plate in a view: every pixel is found again, and is where the camera's own mathematics puts it."""

import numpy as np
import pytest

from core.camera import project
from core.image.plate import Plate
from core.image.plate_view import plate_camera, plate_points, plate_size, view_points, whole_plate

PLATE = Plate(id=1, name="p", path="p.####.png", first=1, last=9, width=400, height=300, crop=(10, 4, 6, 0))


@pytest.mark.parametrize("aspect", [1.0, 2.0])
@pytest.mark.parametrize(("x", "y", "tall"), [(200.0, -150.0, 320.0), (17.25, -3.5, 9.0), (-50.0, 40.0, 5000.0)])
def test_places_come_back_and_lie_where_the_camera_says(aspect, x, y, tall):
    camera = plate_camera(x, y, tall)
    pixels = np.array([[0.0, 0.0], [640.5, 12.0], [1279.0, 719.0]])
    places = plate_points(camera, aspect, pixels, 1280, 720)
    assert np.allclose(view_points(camera, aspect, places, 1280, 720), pixels, atol=1e-8 * 5000 / tall + 1e-9)
    in_world = np.stack((places[:, 0] * aspect, -places[:, 1], np.zeros(3)), axis=1)
    assert np.allclose(project(camera, in_world, 1280, 720).xy, pixels, atol=1e-6)


@pytest.mark.parametrize("size", [(1280, 720), (300, 900)])
def test_the_whole_plate_is_seen_in_the_middle(size):
    wide, tall = plate_size(PLATE)
    assert (wide, tall) == (384, 296)
    camera = whole_plate(PLATE, *size)
    corners = view_points(camera, 1.0, [[-0.5, -0.5], [wide - 0.5, tall - 0.5]], *size)
    assert (corners[0] >= -0.5).all()
    assert (corners[1] <= np.array(size) - 0.5).all()
    assert np.allclose(corners.mean(axis=0), (np.array(size) - 1.0) / 2.0)
    assert np.isclose((corners[1] - corners[0]) / np.array(size), 1.0 / 1.04, atol=1e-9).any()

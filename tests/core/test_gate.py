"""The film gate against projection: what stands on the edge of the film camera's picture stands on the gate."""

import numpy as np
import pytest

from core.camera import Camera, look_at, project
from core.gate import gate_box, gate_of, gate_within, safe_boxes, seen_through
from core.navigate import whole_in, zoom

POSE = look_at((2.0, 1.0, 3.0), (0.0, 0.5, 0.0))
CAMERAS = [Camera(world_from_camera=POSE, field_of_view=0.45),
           Camera(world_from_camera=POSE, orthographic=True, height=1.7)]


@pytest.mark.parametrize("film", CAMERAS)
@pytest.mark.parametrize("window", [(900, 640), (640, 900), (1600, 300)])
def test_the_gate_is_where_the_films_corners_are_seen(film, window):
    aspect = 2.39
    gate = gate_of(film, aspect)
    width, height = 2390, 1000
    corners = np.array([(-0.5, -0.5), (width - 0.5, height - 0.5)])
    view = whole_in(film, aspect, window[0] / window[1])
    depth = 2.0
    half = 0.5 * gate.height * (1.0 if film.orthographic else depth)
    in_camera = np.array([[-half * aspect, half, -depth, 1.0], [half * aspect, -half, -depth, 1.0]])
    world = (in_camera @ film.world_from_camera.T)[:, :3]
    assert np.allclose(project(film, world, width, height).xy, corners, atol=1e-6)  # of the film's own picture
    for camera in (view, zoom(view, 0.8)):  # a longer lens of the view shows the gate larger
        box = gate_box(gate, camera, *window)
        assert np.allclose(project(camera, world, *window).xy.ravel(), box, atol=1e-6)
        again = seen_through(gate, camera)
        assert np.allclose(project(again, world, width, height).xy, corners, atol=1e-6)
    box = gate_box(gate, view, *window)
    assert box.left > 0 and box.top > 0 and box.right < window[0] - 1 and box.bottom < window[1] - 1  # noqa: PT018


def test_a_gate_of_a_view_lies_within_it_and_one_of_the_other_projection_nowhere():
    for window in ((900, 640), (640, 900)):
        gate = gate_within(CAMERAS[0], 16 / 9, window[0] / window[1])
        box = gate_box(gate, CAMERAS[0], *window)
        assert (box.right - box.left) / (box.bottom - box.top) == pytest.approx(16 / 9)
        assert 0 < box.left < box.right < window[0]
        assert 0 < box.top < box.bottom < window[1]
    assert gate_box(gate, CAMERAS[1], 900, 640) is None
    assert seen_through(gate, CAMERAS[1]) is CAMERAS[1]


def test_titles_are_safe_within_the_area_of_action():
    action, title = safe_boxes(gate_box(gate_of(CAMERAS[0], 1.5), CAMERAS[0], 300, 200))
    assert action.right - action.left == pytest.approx(0.93 * 300)
    assert title.bottom - title.top == pytest.approx(0.90 * 200)
    assert title.left + title.right == pytest.approx(action.left + action.right)

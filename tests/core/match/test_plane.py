"""Planes followed through plates whose homographies are known."""

import numpy as np
import pytest

from core.errors import UserError
from core.match.edits import reproject_track
from core.match.plane_tracker import plane_steps
from core.match.track import carried_points, drawn_plane, keyed_track
from tests.core.match.plates import NOISE, texture

SIZE = (160, 220)
Y, X = np.mgrid[0 : SIZE[0], 0 : SIZE[1]].astype(float)
QUAD = np.array([[60.0, 40.0], [150.0, 46.0], [146.0, 120.0], [56.0, 112.0]])


def homography(k):
    """Texture places of the pixels of frame k: it leans away, turns and slides."""
    turn = 0.012 * k
    c, s = np.cos(turn), np.sin(turn)
    there = np.array([[1.0, 0.0, 105.0], [0.0, 1.0, 80.0], [0.0, 0.0, 1.0]])
    lean = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [4e-5 * k, -2e-5 * k, 1.0]])
    move = np.array([[c, -s, -1.1 * k], [s, c, 0.6 * k], [0.0, 0.0, 1.0]])
    return there @ move @ lean @ np.linalg.inv(there)


def image(k):
    m = homography(k)
    w = m[2, 0] * X + m[2, 1] * Y + m[2, 2]
    picture = texture((m[0, 0] * X + m[0, 1] * Y + m[0, 2]) / w, (m[1, 0] * X + m[1, 1] * Y + m[1, 2]) / w)
    return (picture + np.random.default_rng([9, k]).normal(0.0, NOISE, picture.shape)).astype(np.float32)


def truth(points, k, key):
    matrix = np.linalg.inv(homography(k)) @ homography(key)
    there = points @ matrix[:, :2].T + matrix[:, 2]
    return there[:, :2] / there[:, 2:]


def followed(plane, frames, **more):
    return list(plane_steps(plane, image, frames, **more))[-1]


@pytest.mark.parametrize("smooth", [False, True])
def test_corners_stay_pinned_both_ways(smooth):
    made = followed(drawn_plane(1, "wall", 4, QUAD, smooth=smooth), range(13))
    assert list(made.frames) == list(range(13))
    for k in made.frames:
        error = np.linalg.norm(carried_points(made, int(k), QUAD) - truth(QUAD, int(k), 4), axis=1)
        assert error.max() < 0.4
    assert made.error[0] > 0.005
    assert carried_points(made, 99, QUAD) is None


def test_a_large_plane_is_followed_in_smaller_frames_as_exactly():
    box = np.array([[20.0, 12.0], [195.0, 12.0], [195.0, 148.0], [20.0, 148.0]])
    made = followed(drawn_plane(1, "wall", 0, box), range(6))
    for k in range(6):
        assert np.linalg.norm(carried_points(made, k, box) - truth(box, k, 0), axis=1).max() < 0.4


def test_a_mask_holds_a_plane_off_what_passes_before_it():
    def passing(k):
        picture = image(k)
        picture[:, 70 + 5 * k : 95 + 5 * k] = 250.0
        return picture

    def hold(k):
        held = np.zeros(SIZE, bool)
        held[:, 68 + 5 * k : 97 + 5 * k] = True
        return held

    made = list(plane_steps(drawn_plane(1, "wall", 0, QUAD), passing, range(6), hold=hold))[-1]
    assert list(made.frames) == list(range(6))
    for k in range(6):
        assert np.linalg.norm(carried_points(made, k, QUAD) - truth(QUAD, k, 0), axis=1).max() < 1.0


def test_a_track_is_reprojected_by_its_plane_where_it_was_not_seen():
    plane = followed(drawn_plane(1, "wall", 0, QUAD), range(8))
    point = np.array([100.0, 80.0])
    whole = reproject_track(keyed_track(1, "p", np.array([[0.0, *point]])), plane)
    assert list(whole.frames) == list(range(8))
    for k, place in zip(whole.frames, whole.points, strict=True):
        assert np.linalg.norm(place - truth(point[None], int(k), 0)[0]) < 0.3
    np.testing.assert_array_equal(whole.points[0], point)


def test_what_cannot_be_followed_is_said():
    with pytest.raises(UserError, match="key at frame 40"):
        followed(drawn_plane(1, "wall", 40, QUAD), range(6))
    with pytest.raises(UserError, match="only 4 pixels"):
        followed(drawn_plane(1, "wall", 0, QUAD / 24.0), range(6))

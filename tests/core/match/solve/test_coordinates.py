import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.match.solve.coordinates import Frame, Similarity, onto, to_frame
from core.match.solve.state import projected
from tests.core.match.solve.shots import shot


def test_a_frame_is_where_the_artist_says_and_pictures_stay_what_they_are():
    state = shot("orbit", 12, 4).truth
    moved = to_frame(Frame(origin=3, axis=(3, 5), plane=(3, 5, 7), distance=(1, 2, 4.0)), state.points)
    after = moved.state(state)
    np.testing.assert_allclose(after.points[3], 0.0, atol=1e-12)
    np.testing.assert_allclose(after.points[[5, 7], 1], 0.0, atol=1e-9)
    np.testing.assert_allclose(after.points[5, 1:], 0.0, atol=1e-9)
    assert after.points[5, 0] > 0
    assert np.linalg.norm(after.points[1] - after.points[2]) == pytest.approx(4.0)
    rows = np.repeat(np.arange(4), 12)
    for before, now in zip(projected(state, rows, np.tile(state.points, (4, 1))),
                           projected(after, rows, np.tile(after.points, (4, 1))), strict=True):
        ratio = moved.scale if before.ndim == 1 else 1.0
        np.testing.assert_allclose(now, ratio * before, rtol=1e-9)


def test_what_is_above_the_ground_is_told_by_the_cameras():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 2, 0]])
    for side in (1.0, -1.0):
        moved = to_frame(Frame(plane=(0, 1, 2)), points, np.array([0.0, side, 0.2]))
        assert moved.points(points)[3, 1] == pytest.approx(2.0 * side)


def test_measured_places_give_the_similarity_back():
    rng = np.random.default_rng(2)
    points = rng.normal(size=(6, 3))
    truth = Similarity(2.5, Rotation.from_rotvec([1.0, 2.0, -0.5]).as_matrix(), np.array([4.0, 5.0, 6.0]))
    found = onto(points, truth.points(points), rng.uniform(0.5, 1, 6))
    np.testing.assert_allclose(found.turn, truth.turn, atol=1e-12)
    assert found.scale == pytest.approx(2.5)
    np.testing.assert_allclose(found.shift, truth.shift)


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        (Frame(distance=(0, 0, 1.0)), "distance"), (Frame(axis=(1, 1)), "axis"), (Frame(plane=(0, 1, 2)), "one line"),
        (Frame(distance=(0, 1, -1.0)), "distance"),
    ],
)
def test_a_frame_that_says_nothing_is_refused(frame, words):
    with pytest.raises(UserError, match=words):
        to_frame(frame, np.array([[0.0, 0, 0], [1, 1, 1], [2, 2, 2]]))


def test_measured_places_on_one_line_are_refused():
    line = np.outer(np.arange(4.0), [1, 2, 3])
    for points in (line, line[:2]):
        with pytest.raises(UserError, match="one line"):
            onto(points, points)

"""A solved world is lined up by tracks: what is said holds, pictures stay, and a new solve keeps it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.document import Document
from core.errors import UserError
from core.formats.project import read_project, write_project
from core.image.plate import Plate
from core.match.solved import SolvedCamera, frozen, pixels_of, world_axes
from core.match.track import keyed_track
from tests.core.match.test_solved import small_solve
from tools.line_up_edits import forget_line_up, set_axis, set_distance, set_ground, set_origin
from tools.solve_edits import put_solve

FLOOR = np.array([[0.0, 0, 0], [2, 0, 0], [0, 0, 3], [1, 0, 1], [0.5, -2, 0.5]])  # y down: the last stands above


def tilted(turn: Rotation, size: float, shift: float) -> SolvedCamera:
    """Cameras above a floor, in a world that lies anyhow."""
    centres = np.array([[0.0, -3, -6], [1, -3, -6]])
    tilt = turn.as_matrix()
    points = size * FLOOR @ tilt.T + shift
    rotation = np.array([tilt.T] * 2)
    translation = -np.einsum("fij,fj->fi", rotation, size * centres @ tilt.T + shift)
    return small_solve().replace(
        rotation=frozen(rotation), translation=frozen(translation), points=frozen(points),
        track_ids=frozen(range(1, 6), np.int32), errors=frozen(np.zeros(5)), cubes=(1,))


@pytest.fixture
def document() -> Document:
    plate = Plate(id=1, name="p", path="p.####.png", first=1, last=2, width=64, height=48)
    tracks = tuple(keyed_track(k, f"t{k}", np.array([[1, 5.0 * k, 3.0]]), 1) for k in range(1, 6))
    return put_solve(Document(plates=(plate,), tracks=tracks), tilted(Rotation.from_rotvec([0.4, -1.0, 0.7]), 3.0, 5.0))


def up(document: Document) -> np.ndarray:
    """Points of the solve, y up."""
    return document.solves[0].points * [1, -1, -1]


def lined(document: Document) -> Document:
    document = set_ground(document, (1, 2, 3, 4))
    document = set_axis(document, (1, 2))
    return set_distance(document, (1, 2), 2.0)


def test_ground_axis_origin_and_distance_hold_and_no_point_moves_in_the_picture(document: Document) -> None:
    before = [pixels_of(document.solves[0], frame, document.solves[0].points) for frame in (1, 2)]
    now = lined(document)
    np.testing.assert_allclose(up(now), FLOOR * [1, -1, -1], atol=1e-9)
    for frame, seen in zip((1, 2), before, strict=True):
        np.testing.assert_allclose(pixels_of(now.solves[0], frame, now.solves[0].points), seen, atol=1e-8)
    np.testing.assert_allclose(up(set_origin(now, 4))[3], 0.0, atol=1e-9)
    ends = world_axes(now.solves[0])[:, -1] * [1, -1, -1]
    np.testing.assert_allclose(ends, ends[0, 0] * np.eye(3), atol=1e-12)
    assert now.solves[0].line_up.said
    assert not document.solves[0].line_up.said


def test_a_new_solve_keeps_the_world_and_one_that_lost_the_line_up_tracks_stays_too(document: Document) -> None:
    now = lined(document)
    fresh = tilted(Rotation.from_rotvec([-2.0, 0.3, 0.1]), 0.2, -1.0)
    again = put_solve(now, fresh)
    np.testing.assert_allclose(up(again), up(now), atol=1e-9)
    fewer = fresh.replace(points=frozen(fresh.points[1:]), track_ids=frozen(range(2, 6), np.int32),
                          errors=frozen(np.zeros(4)))
    np.testing.assert_allclose(up(put_solve(now, fewer)), up(now)[1:], atol=1e-9)
    assert again.solves[0].warnings == fresh.warnings
    assert "has no place in this solve" in put_solve(now, fewer).solves[0].warnings[-1]
    two = fresh.replace(points=frozen(fresh.points[:2]), track_ids=frozen([1, 2], np.int32), errors=frozen(np.zeros(2)))
    assert "no longer lined up" in put_solve(now, two).solves[0].warnings[-1]
    assert "lined up" not in put_solve(forget_line_up(now, 1), two).solves[0].warnings[-1]


def test_the_line_up_is_kept_by_files_and_let_go_by_hand(document: Document, tmp_path) -> None:
    now = lined(document)
    write_project(tmp_path / "a.filo", now)
    (back,) = read_project(tmp_path / "a.filo").document.solves
    said = back.line_up
    assert (said.origin, said.axis, said.ground) == (1, (1, 2), (1, 2, 3, 4))
    assert (said.distance, said.length) == ((1, 2), 2.0)
    free = forget_line_up(now, 1)
    assert free.solves[0].line_up.ground == ()
    np.testing.assert_array_equal(up(free), up(now))


def test_what_says_nothing_is_refused_in_words(document: Document) -> None:
    for wrong, words in (
        (lambda: set_ground(document, (1, 2)), "three tracks"), (lambda: set_axis(document, (1,)), "two tracks"),
        (lambda: set_distance(document, (1, 2), 0.0), "above 0"), (lambda: set_origin(document, 77), "solved camera"),
        (lambda: set_distance(document, (1, 1), 2.0), "two tracks"),
    ):
        with pytest.raises(UserError, match=words):
            wrong()

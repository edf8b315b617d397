"""Edits of tracks, by what they promise."""

import numpy as np
import pytest

from core.document import Document
from core.errors import UserError
from core.formats.project import read_project, write_project
from core.image.plate import FilmBack, Plate
from core.match.edits import (
    average_tracks,
    join_tracks,
    key_track,
    merge_tracked,
    offset_track,
    rekey_track,
    smooth_track,
    split_track,
)  # fmt: skip
from core.match.reacquire import find_again
from core.match.track import Track, keyed_track
from tests.core.match.plates import frame, place

FRAMES = np.arange(1001, 1021, dtype=np.int32)


def track_of(points, variance=0.01, track_id=1, frames=FRAMES):
    count = len(frames)
    covariance = np.tile([variance, 0.0, variance], (count, 1))
    return Track(
        id=track_id, name=f"t{track_id}", keys=np.array([[frames[0], *points[0]]]), frames=frames, points=points,
        covariance=covariance, own=covariance, score=np.ones(count), plate_id=1,
    )  # fmt: skip


PATH = np.stack((np.linspace(10.0, 50.0, 20), 30.0 + np.linspace(0.0, 2.0, 20) ** 2), axis=1)


def test_what_is_split_joins_to_the_same():
    track = track_of(PATH)
    first, second = split_track(track, 1008, 2, "rest")
    assert (list(first.frames[[0, -1]]), list(second.frames[[0, -1]])) == ([1001, 1007], [1008, 1020])
    joined = join_tracks(first, second)
    np.testing.assert_allclose(joined.points, track.points)
    np.testing.assert_array_equal(joined.frames, track.frames)
    with pytest.raises(UserError):
        split_track(track, 1001, 2, "rest")


def test_averaging_weighs_by_how_sure_each_is():
    a, b = track_of(PATH, 0.01), track_of(PATH + np.array([1.0, 0.0]), 0.03, 2, FRAMES)
    mean = average_tracks((a, b))
    np.testing.assert_allclose(mean.points - PATH, np.tile([0.25, 0.0], (20, 1)), atol=1e-12)
    np.testing.assert_allclose(mean.covariance[:, 0], 0.0075)


def test_smoothing_leaves_parabolas_and_keys_and_takes_noise():
    np.testing.assert_allclose(smooth_track(track_of(PATH)).points, PATH, atol=1e-9)
    noisy = PATH + np.random.default_rng(0).normal(0, 0.2, PATH.shape)
    smooth = smooth_track(track_of(noisy), 9).points
    assert np.std(smooth - PATH) < 0.75 * np.std(noisy - PATH)
    np.testing.assert_array_equal(smooth[0], noisy[0])


def test_a_key_is_where_it_was_put_and_an_offset_keeps_its_distance():
    keyed = key_track(track_of(PATH), 1005, (1.0, 2.0))
    assert keyed.keys.tolist()[1] == [1005.0, 1.0, 2.0]
    np.testing.assert_array_equal(keyed.points[4], [1.0, 2.0])
    assert len(keyed.frames) == 20
    moved = offset_track(track_of(PATH), 1003, (100.0, 100.0), 5, "beside")
    np.testing.assert_allclose(moved.points - PATH, np.tile([100.0, 100.0] - PATH[2], (20, 1)))


def test_where_a_point_was_seen_it_can_become_a_key():
    keyed = rekey_track(track_of(PATH), 1009)
    assert keyed.keys[:, 0].tolist() == [1001.0, 1009.0]
    np.testing.assert_array_equal(keyed.points, PATH)
    with pytest.raises(UserError, match="not seen"):
        rekey_track(track_of(PATH), 2000)


def test_tracking_some_frames_anew_leaves_the_others():
    anew = track_of(PATH[4:9] + 1.0, frames=FRAMES[4:9])
    merged = merge_tracked(track_of(PATH), anew, range(1004, 1012))
    # 1004 and 1010, 1011 were looked at and not seen any more
    assert [k for k in FRAMES if k not in merged.frames] == [1004, 1010, 1011]
    np.testing.assert_array_equal(merged.points[:3], PATH[:3])
    np.testing.assert_array_equal(merged.points[3:8], PATH[4:9] + 1.0)
    np.testing.assert_array_equal(merged.points[8:], PATH[11:])


def test_a_lost_pattern_is_found_again_near_a_click_and_nowhere_else():
    point = np.array([70.0, 62.0])
    track = keyed_track(1, "a", np.array([[0.0, *point]]))
    there = place(point, 18)
    found, score = find_again(track, frame(0), 0, frame(18), (there[0] + 9.0, there[1] - 7.0))
    assert np.linalg.norm(found - there) < 0.2
    assert score > 0.9
    noise = np.random.default_rng(0).uniform(0, 255, (120, 160, 3)).astype(np.float32)
    assert find_again(track, frame(0), 0, noise, tuple(there)) is None


def test_plates_and_tracks_are_part_of_the_document_and_its_file(tmp_path):
    plate = Plate(
        id=1, name="shot", path="plates/shot.####.exr", first=1001, last=1020, width=1920, height=1080, missing=(1007,),
        film_back=FilmBack(36.0, 20.25), focal_mm=35.0,
    )  # fmt: skip
    document = Document(plates=(plate,), tracks=(track_of(PATH),))
    write_project(tmp_path / "a.filo", document)
    found = read_project(tmp_path / "a.filo").document
    assert found.plates[0].film_back == (36.0, 20.25)
    assert found.plates[0].path == plate.path
    np.testing.assert_array_equal(found.tracks[0].points, PATH)
    with pytest.raises(ValueError, match="plate 1"):
        Document(tracks=(track_of(PATH),))
    with pytest.raises(ValueError, match="same id"):
        Document(plates=(plate,), tracks=(track_of(PATH), keyed_track(1, "b", np.array([[1001.0, 1.0, 1.0]]), 1)))

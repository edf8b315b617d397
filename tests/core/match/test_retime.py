"""Frames between frames and gaps of tracks, by flow: against motions that are known, and a film that has the frame."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from core.match.fill import fill_gaps
from core.match.retime import flow_pair, frame_between, frames_at_speed
from core.match.track import Track, gaps_of, keyed_track
from core.record import freeze
from tests.core.match.plates import frame, place, texture

Y, X = np.mgrid[0:120, 0:160].astype(np.float64)


def waved(share):
    """A texture that goes 6 px to the right and sways, at a share of the way."""
    return np.float32(texture(X - 6.0 * share, Y + 2.0 * share * np.sin(X / 30.0)) / 255.0)


def worth(made, truth):
    """Peak signal to noise in dB, borders left out."""
    inner = np.s_[8:-8, 12:-12]
    return -10.0 * np.log10(np.mean((made[inner] - truth[inner]) ** 2))


@pytest.mark.parametrize("share", [0.25, 0.5, 0.8])
def test_a_frame_between_is_the_motion_at_that_time(share):
    first, second = waved(0.0), waved(1.0)
    made = frame_between(first, second, flow_pair(first, second), share)
    assert made.dtype == np.float32
    assert worth(made, waved(share)) > 35.0
    assert worth(made, waved(share)) > worth((1.0 - share) * first + share * second, waved(share)) + 10.0


def test_the_ends_are_the_frames_themselves_and_whole_numbers_stay_whole():
    first, second = (np.uint8(np.clip(255.0 * waved(s), 0, 255)) for s in (0.0, 1.0))
    pair = flow_pair(np.float32(first / 255.0), np.float32(second / 255.0))
    assert frame_between(first, second, pair, 0.0) is first
    assert frame_between(first, second, pair, 1.0) is second
    assert frame_between(first, second, pair, 0.5).dtype == np.uint8


def test_what_only_one_frame_shows_is_taken_from_it():
    """A disc goes 10 px over a still wall: half way it is half way, and no ghost of it stays at either end."""
    wall = texture(X, Y) * 0.4

    def shot(x):
        disc = np.hypot(X - x, Y - 60.0)[:, :, None] < 25.0
        return np.float32(np.where(disc, 150.0 + 0.4 * texture(X - x + 300.0, Y), wall) / 255.0)

    first, second = shot(70.0), shot(80.0)
    made = frame_between(first, second, flow_pair(first, second), 0.5)
    assert worth(made, shot(75.0)) > worth(0.5 * (first + second), shot(75.0)) + 6.0


def test_a_film_that_has_the_frame_between_agrees_better_than_a_blend():
    data = os.environ.get("FILOPLUME_DATA")
    if not data:
        pytest.skip("FILOPLUME_DATA names no folder of real films")
    paths = sorted((Path(data) / "matchmove/seq_sintel_raft").rglob("frame_*.png"))
    first, truth, second = (np.float32(cv2.imread(str(path))[::2, ::2] / 255.0) for path in paths[:3])
    made = frame_between(first, second, flow_pair(first, second), 0.5)
    assert worth(made, truth) > worth(0.5 * (first + second), truth) + 3.0


@pytest.mark.parametrize(("speed", "places"), [
    (0.5, [1.0, 1.5, 2.0, 2.5, 3.0]), (2.0, [1.0, 3.0]), (1.0, [1.0, 2.0, 3.0]),
    (0.3, [1.0, 1.3, 1.6, 1.9, 2.2, 2.5, 2.8])])
def test_another_speed_shows_these_places(speed, places):
    assert np.allclose(frames_at_speed(1, 3, speed), places)


def with_gap(point, frames):
    """A track that is where it belongs on these frames."""
    rows = np.array([place(point, k) for k in frames])
    track = keyed_track(1, "gap", np.array([[frames[0], *rows[0]]]))
    some = np.tile([0.0025, 0.0, 0.0025], (len(frames), 1))
    return Track(
        id=1, name="gap", keys=track.keys, frames=freeze(np.array(frames, np.int32)), points=freeze(rows),
        covariance=freeze(some), own=freeze(some.copy()), score=freeze(np.ones(len(frames))))


def test_a_gap_is_filled_from_both_sides():
    track = with_gap(np.array([70.0, 60.0]), [0, 1, 2, 9, 10])
    assert gaps_of(track) == [(2, 9)]
    (made,) = fill_gaps((track,), lambda k: frame(k) / np.float32(255.0))
    assert list(made.frames) == list(range(11))
    error = np.array([p - place(np.array([70.0, 60.0]), int(k)) for k, p in zip(made.frames, made.points, strict=True)])
    assert np.abs(error).max() < 0.25
    sigma = np.sqrt(made.covariance[:, 0])
    assert sigma[5] > sigma[1]
    assert (np.abs(error[3:9]) < 5.0 * sigma[3:9, None]).all()
    seen = np.isin(made.frames, track.frames)
    assert np.array_equal(made.points[seen], track.points)
    assert (made.score[~seen] < 0.6).all()


def test_where_a_frame_is_missing_a_gap_is_filled_up_to_it_from_each_side():
    track = with_gap(np.array([70.0, 60.0]), [0, 8])
    (made,) = fill_gaps((track,), lambda k: None if k == 4 else frame(k) / np.float32(255.0))
    assert list(made.frames) == [0, 1, 2, 3, 5, 6, 7, 8]


def test_a_cancelled_fill_leaves_all_as_it_was():
    track = with_gap(np.array([70.0, 60.0]), [0, 8])
    assert fill_gaps((track,), lambda k: frame(k) / np.float32(255.0), cancel=lambda: True) == (track,)

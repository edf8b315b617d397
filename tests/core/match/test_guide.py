"""Jumps of the camera, and features where there is a picture."""

import numpy as np

from core.match.features import find_features
from core.match.guide import carried_by, guide_between
from core.match.track import TrackSettings
from core.match.tracker import Tracking
from tests.core.match.plates import frame, matrix, place

SIZE = (240, 320)
JUMP = 30  # frames of motion at once: some 30 px, 17 degrees, a fifth smaller


def seen(k):
    return frame(JUMP * k, size=SIZE)


def test_matches_carry_points_over_a_jump_and_none_over_a_cut():
    first, second = seen(0), seen(1)
    guide = guide_between(first, second)
    points = np.array([[x, y] for x in (90.0, 160.0, 230.0) for y in (70.0, 120.0, 170.0)])
    truth = np.array([place(point, JUMP) for point in points])
    assert np.linalg.norm(truth - points, axis=1).max() > 40
    places, linear = carried_by(guide, points)
    assert np.linalg.norm(places - truth, axis=1).max() < 3.0
    expected = np.linalg.inv(matrix(JUMP)[:, :2]) @ matrix(0)[:, :2]
    assert np.abs(linear - expected).max() < 0.1
    noise = np.random.default_rng(0).uniform(0, 255, (*SIZE, 3)).astype(np.float32)
    assert guide_between(first, noise) is None
    assert guide_between(first, np.zeros_like(first)) is None


def test_tracks_follow_a_jump_further_than_they_search():
    tracking = Tracking(seen, range(3), auto=20, settings=TrackSettings(search=10))
    for _ in tracking.steps():
        pass
    tracks = tracking.tracks()
    assert sum(len(track.frames) for track in tracks) >= 30
    for track in tracks:
        key = track.keys[0]
        for k, point in zip(track.frames, track.points, strict=True):
            assert np.linalg.norm(point - place(key[1:], JUMP * int(k), JUMP * int(key[0]))) < 0.5


def test_no_feature_is_found_on_a_border_without_a_picture_or_in_noise():
    image = np.clip(seen(0), 15.0, 240.0)
    image[:40] = 255.0
    image[:, 280:] = 0.0
    points = find_features(image, 40, 21)
    assert len(points) >= 10
    assert points[:, 1].min() > 50
    assert points[:, 0].max() < 270
    noise = np.random.default_rng(1).normal(128.0, 5.0, (*SIZE, 3)).astype(np.float32)
    assert len(find_features(noise, 40, 21)) == 0
    assert len(find_features(np.full_like(noise, 3.0), 40, 21)) == 0

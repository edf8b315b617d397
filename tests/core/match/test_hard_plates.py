"""What hard plates do to tracks on a real photograph: they stop or come back, never a silent jump."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from core.match.track import TrackSettings, keyed_track
from core.match.tracker import Tracking

PHOTO = "images/skimage_textures_A/chelsea.png"
FRAMES = range(1, 25)
JUMP = 2.0  # pixels: more is a jump


@pytest.fixture(scope="module")
def photo():
    data = os.environ.get("FILOPLUME_DATA")
    if not data:
        pytest.skip("FILOPLUME_DATA names no folder of real pictures")
    return np.float32(cv2.imread(str(Path(data) / PHOTO))[:, :, ::-1])


def view(k):
    """Plate pixels of photograph pixels in frame k: a hand-held drift and a slow turn."""
    turn, scale = 0.004 * k, 1.0 + 0.003 * k
    c, s = scale * np.cos(turn), scale * np.sin(turn)
    middle = np.array([225.0, 150.0])
    linear = np.array([[c, -s], [s, c]])
    shift = middle + np.array([1.3 * k + 2.0 * np.sin(k), -0.8 * k + 1.5 * np.cos(1.3 * k)]) - linear @ middle
    return np.column_stack((linear, shift - [60.0, 40.0]))


def plain(photo, k):
    image = cv2.warpAffine(photo, view(k), (320, 240), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
    return (image + np.random.default_rng([7, k]).normal(0.0, 2.0, image.shape)).astype(np.float32)


def place(point, k):
    first, now = view(FRAMES[0]), view(k)
    there = np.linalg.solve(first[:, :2], point - first[:, 2])
    return now[:, :2] @ there + now[:, 2]


def flames(photo, k):
    """Light that rises and flickers over the lower half from frame 5 to 18."""
    if not 5 <= k < 19:
        return plain(photo, k)
    rng = np.random.default_rng([3, k])
    heat = np.zeros((240, 320), np.float32)
    for _ in range(40):
        x, y, r = rng.uniform(0, 320), 240 - rng.exponential(45.0), rng.uniform(6, 22)
        cv2.ellipse(heat, (int(x), int(y)), (int(r * 0.6), int(r * 1.6)), rng.uniform(-25, 25), 0, 360, 1.0, -1)
    heat = cv2.GaussianBlur(heat, (0, 0), 4.0)[:, :, None] * rng.uniform(0.5, 1.0)
    return np.minimum(plain(photo, k) + heat * np.array([255.0, 150.0, 40.0], np.float32), 255.0).astype(np.float32)


def cut(photo, k):
    return plain(photo, k) if k < 12 else plain(photo[::-1, ::-1], k)


def black(photo, k):
    return np.zeros((240, 320, 3), np.float32) if k in (9, 10, 17) else plain(photo, k)


POINTS = np.array([[x, y] for x in (60.0, 110.0, 160.0, 210.0, 260.0) for y in (50.0, 90.0, 130.0, 170.0, 200.0)])


@pytest.mark.parametrize(("what", "fewest"), [(plain, 24), (flames, 10), (cut, 0), (black, 24)])
def test_no_track_jumps(photo, what, fewest):
    tracks = tuple(keyed_track(n + 1, f"t{n}", np.array([[1.0, *point]])) for n, point in enumerate(POINTS))
    tracking = Tracking(lambda k: what(photo, k), FRAMES, tracks, TrackSettings())
    for _ in tracking.steps():
        pass
    made = tracking.tracks()
    worst = {
        track.name: max(
            np.linalg.norm(point - place(track.keys[0, 1:], int(k)))
            for k, point in zip(track.frames, track.points, strict=True)
        )
        for track in made
        if what is not cut or track.frames[-1] < 12
    }
    assert max(worst.values()) < JUMP, {name: round(float(v), 2) for name, v in worst.items() if v > 1.0}
    assert sum(track.frames[-1] == FRAMES[-1] for track in made) >= fewest
    if what is cut:
        assert [track.name for track in made if track.frames[-1] >= 12] == []
    if what is black:
        assert all(not np.isin([9, 10, 17], track.frames).any() for track in made)

"""A lens from boards of a known lens, and from photographs of one."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.formats.lens_file import read_lens, write_lens
from core.match.lens import bent, start_lens
from core.match.solve.grid import calibrate, chessboard_corners

DATA = os.environ.get("FILOPLUME_DATA")
SIZE, GRID = (1280, 960), (9, 6)
BENDS = {
    "brown": {1: -0.22, 2: 0.06}, "fisheye": {1: 0.05, 2: -0.02, 6: 0.01, 7: -0.004},
    "radial4": {1: 0.12, 2: 0.02, 7: 0.004, 8: -0.003}, "anamorphic4": {1: 0.05, 2: 0.03, 7: 0.01, 8: -0.02},
}  # fmt: skip


def _lens(model: str) -> np.ndarray:
    lens = start_lens(900.0, *SIZE, model)
    lens[4:6] += 14.0, -9.0
    for column, value in BENDS[model].items():
        lens[column] = value
    return lens


def _boards(lens: np.ndarray, count: int = 10, noise: float = 0.1, seed: int = 0) -> list[np.ndarray]:
    """Corners of boards that lean every way and reach about the whole picture."""
    rng = np.random.default_rng(seed)
    places = np.zeros((GRID[0] * GRID[1], 3))
    places[:, :2] = np.mgrid[: GRID[0], : GRID[1]].T.reshape(-1, 2)
    places[:, :2] -= places[:, :2].mean(axis=0)
    found = []
    while len(found) < count:
        turn = Rotation.from_euler("xyz", rng.uniform([-0.6, -0.6, -0.4], [0.6, 0.6, 0.4])).as_matrix()
        there = places @ turn.T + rng.uniform([-3, -2, 9], [3, 2, 12])
        xy = bent(lens, 0.0, np.ascontiguousarray(there[:, :2] / there[:, 2:]))
        if (xy > 0).all() and (xy < SIZE).all():
            found.append(xy + rng.normal(0, noise, xy.shape))
    return found


@pytest.mark.parametrize("model", list(BENDS))
def test_the_lens_the_boards_were_seen_through_is_found(model):
    truth = _lens(model)
    found = calibrate(_boards(truth), GRID, SIZE, model)
    assert found.rms == pytest.approx(0.1 * np.sqrt(2), rel=0.1)
    assert abs(np.exp(found.lens[0]) - 900.0) < 3.5 * found.focal_sigma
    assert found.focal_sigma < 3.0
    assert np.hypot(*(found.lens[4:6] - truth[4:6])) < 3.5 * found.centre_sigma
    # what it makes of the picture: rays of both lenses, over most of it
    flat = np.stack(np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.35, 0.35, 7)), axis=-1).reshape(-1, 2)
    apart = bent(found.lens, 0.0, flat) - bent(truth, 0.0, flat)
    assert np.abs(apart - apart.mean(axis=0)).max() < 1.0


def test_its_doubt_is_right():
    truth = _lens("brown")
    made = [calibrate(_boards(truth, 6, seed=seed), GRID, SIZE) for seed in range(12)]
    off = [(np.exp(one.lens[0]) - 900.0) / one.focal_sigma for one in made]
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.6


@pytest.mark.skipif(DATA is None, reason="FILOPLUME_DATA is not set")
def test_photographs_of_a_board_are_as_opencv_has_them():
    folder = Path(str(DATA)) / "matchmove" / "stereo_chessboard_1" / "calib_imgs" / "1"
    pictures = [cv2.imread(str(folder / f"left{k}.jpg"), cv2.IMREAD_GRAYSCALE) for k in (1, 11, 12, 13, 14)]
    grid = (9, 6)
    seen = [chessboard_corners(picture, grid) for picture in pictures]
    size = pictures[0].shape[::-1]
    found = calibrate(seen, grid, size)
    places = np.zeros((grid[0] * grid[1], 3), np.float32)
    places[:, :2] = np.mgrid[: grid[0], : grid[1]].T.reshape(-1, 2)
    flags = cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
    rms, matrix, bend, *_ = cv2.calibrateCamera(
        [places] * len(seen), [c.astype(np.float32) for c in seen], size, np.eye(3), None, flags=flags)
    assert found.rms == pytest.approx(rms, rel=1e-3)
    np.testing.assert_allclose([np.exp(found.lens[0]), *found.lens[4:6]], matrix[[0, 0, 1], [0, 2, 2]], rtol=2e-3)
    np.testing.assert_allclose(found.lens[1:3], bend.ravel()[:2], atol=5e-3)


def test_lenses_are_kept_by_files(tmp_path):
    for model in BENDS:
        lens = _lens(model)
        write_lens(tmp_path / "a.json", lens, SIZE, ".json")
        back, size = read_lens(tmp_path / "a.json", None)
        np.testing.assert_array_equal(back, lens)
        assert size == SIZE
    (tmp_path / "b.json").write_text('{"size": [3, 4], "model": "brown", "numbers": [1, 2]}')
    with pytest.raises(UserError, match="numbers of a lens"):
        read_lens(tmp_path / "b.json", None)


@pytest.mark.parametrize("count", [0, 2])
def test_too_few_boards_are_refused(count):
    with pytest.raises(UserError, match="a lens needs 3"):
        calibrate(_boards(_lens("brown"), count), GRID, SIZE)


def test_corners_that_are_of_no_board_are_refused():
    rng = np.random.default_rng(0)
    with pytest.raises(UserError, match="corners"):
        calibrate([rng.uniform(0, 900, (54, 2)) for _ in range(4)], GRID, SIZE)

"""Views of the real window beside kept pictures, at three scales of the screen.

A picture fails when it differs from the kept one by more than drivers differ: on the average, in how many pixels
differ visibly, or anywhere in a small square (a lost word, ring or icon hardly changes an average). After a wanted
change look at the pictures a failing test names, then keep them: ``python -m tests.window.test_pictures``.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.display import ensure_display
from tests.window.take_pictures import OPTIONS

SCALES = ("1", "1.5", "2")
KEPT = Path(__file__).parent / "pictures"
VIEWS = (*OPTIONS, "ortho", "posed", "window-light", "window-dark")
MEAN = 1.2  # of 255; another order of the same hairs was measured to be 0.8
SHARE, VISIBLE = 0.02, 16  # of pixels that may differ by more than so much
SQUARE, WORST = 8, 20.0  # no square of so many pixels may differ by more on the average


def differences(taken: NDArray[np.uint8], kept: NDArray[np.uint8]) -> tuple[float, float, float]:
    """Mean of the absolute differences, share of pixels that differ visibly, mean of the worst square; of 255."""
    apart = np.abs(taken.astype(np.int16) - kept.astype(np.int16)).max(axis=2)
    squares = cv2.blur(apart.astype(np.float32), (SQUARE, SQUARE))
    return float(apart.mean()), float((apart > VISIBLE).mean()), float(squares.max())


@pytest.fixture(scope="module", params=SCALES)
def taken(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """A folder with every view at one scale, taken by a process of its own (a scale is for a whole process)."""
    reason = ensure_display()
    if reason is not None:
        pytest.skip(reason)
    scale: str = request.param
    folder = tmp_path_factory.mktemp(f"scale-{scale}")
    take(folder, scale)
    return scale, folder


def take(folder: Path, scale: str) -> None:
    """Run the program that takes the views."""
    environment = {
        **os.environ, "QT_SCALE_FACTOR": scale, "FILOPLUME_STATE": str(folder / "state"),
        "FILOPLUME_SETTINGS": str(folder / "settings"),
    }
    command = [sys.executable, "-W", "error", "-m", "tests.window.take_pictures", str(folder)]
    done = subprocess.run(command, check=False, env=environment, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    for made in ("state", "settings"):
        shutil.rmtree(folder / made, ignore_errors=True)


@pytest.mark.parametrize("name", VIEWS)
def test_a_view_looks_as_it_did(taken: tuple[str, Path], name: str) -> None:
    scale, folder = taken
    image, kept = cv2.imread(str(folder / f"{name}.png")), cv2.imread(str(KEPT / scale / f"{name}.png"))
    # at a broken scale a border may fall on either of two pixels
    assert np.abs(np.subtract(image.shape, kept.shape)).max() <= 1
    if image.shape != kept.shape:
        image = np.asarray(cv2.resize(image, kept.shape[1::-1], interpolation=cv2.INTER_AREA), np.uint8)
    mean, share, worst = differences(image, kept)
    alike = mean <= MEAN and share <= SHARE and worst <= WORST
    assert alike, (
        f"{folder / name}.png differs from {KEPT / scale / name}.png: {mean:.2f} on the average, {share:.2%} visibly, "
        f"{worst:.1f} in one place")


def test_kept_pictures_are_small_and_all_looked_at() -> None:
    files = sorted(KEPT.rglob("*.png"))
    assert sorted(f"{f.parent.name}/{f.stem}" for f in files) == sorted(f"{s}/{v}" for s in SCALES for v in VIEWS)
    sizes = [file.stat().st_size for file in files]
    assert max(sizes) <= 64_000
    assert sum(sizes) <= 2_000_000


def test_no_two_kept_views_are_within_the_tolerance_of_each_other() -> None:
    """Otherwise a view that lost what makes it another would pass."""
    pictures = {name: cv2.imread(str(KEPT / "1" / f"{name}.png")) for name in VIEWS}
    for a in VIEWS:
        for b in VIEWS:
            if a < b and pictures[a].shape == pictures[b].shape:
                assert differences(pictures[a], pictures[b])[2] > WORST, (a, b)


def main() -> None:
    """Keep the pictures as they are taken now."""
    reason = ensure_display()
    if reason is not None:
        raise SystemExit(reason)
    for scale in SCALES:
        folder = KEPT / scale
        folder.mkdir(parents=True, exist_ok=True)
        take(folder, scale)


if __name__ == "__main__":
    main()

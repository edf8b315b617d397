"""A plate of 500 frames of 4K is tracked within the budget of its frames and a few that are looked at."""

import json
import os
import subprocess
import sys

import cv2
import numpy as np
import pytest

from core.image.frame_cache import DEFAULT_BUDGET
from tests.app.test_cli import ROOT

FRAMES = int(os.environ.get("FILOPLUME_SOAK_FRAMES", "500"))
DIFFERENT = 8  # pictures there are; the plate goes back and forth through them
WIDTH, HEIGHT = 4096, 2160
LOOKED_AT = 12  # float frames of three channels at once: the frame, the one before, and what is made of them


@pytest.mark.timeout(7200)
def test_memory_of_500_frames_of_4k(tmp_path):
    rng = np.random.default_rng(0)
    wide = cv2.resize(rng.integers(0, 256, (HEIGHT // 8, WIDTH // 8 + 16, 3), np.uint8), (WIDTH + 128, HEIGHT))
    for k in range(DIFFERENT):
        noisy = wide[:, 8 * k : 8 * k + WIDTH].astype(np.int16) + rng.integers(-3, 4, (HEIGHT, WIDTH, 3), np.int16)
        picture = np.clip(noisy, 0, 255).astype(np.uint8)
        cv2.imwrite(str(tmp_path / f"first.{k}.jpg"), picture, [cv2.IMWRITE_JPEG_QUALITY, 95])
    plate = tmp_path / "plate"
    plate.mkdir()
    there = [*range(DIFFERENT), *range(DIFFERENT - 2, 0, -1)]
    for k in range(FRAMES):
        os.link(tmp_path / f"first.{there[k % len(there)]}.jpg", plate / f"shot.{1001 + k}.jpg")
    command = [sys.executable, "-m", "app", "track", str(plate), "--auto", "40", "--json"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=7000, check=False)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["frames"] == [1001, 1000 + FRAMES]
    assert result["observations"] > 20 * FRAMES
    print(result["peak_mb"], "MB at most,", result["seconds"])
    assert result["peak_mb"] < (DEFAULT_BUDGET + LOOKED_AT * WIDTH * HEIGHT * 3 * 4) / 2**20

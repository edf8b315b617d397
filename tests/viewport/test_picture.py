"""Pictures as files."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from core.errors import UserError
from viewport.context import standalone_context
from viewport.picture import render, render_png, write_png
from viewport.scene import Scene

from tests.viewport.scenes import ball, camera


def test_a_png_holds_the_picture(ctx, tmp_path):
    skin, coat = ball(count=500)
    scene = Scene(surfaces=(skin,), coats=(coat,))
    path = tmp_path / "ball.png"
    render_png(path, scene, camera(), (90, 60), 2)
    read = cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB)
    assert read.shape == (60, 90, 3)
    assert np.array_equal(read, render(scene, camera(), 90, 60, 2, ctx=ctx))
    assert [p.name for p in tmp_path.iterdir()] == ["ball.png"]


def test_a_picture_that_cannot_be_written_says_so_and_leaves_the_old_one(tmp_path):
    image = np.zeros((4, 5, 3), np.uint8)
    with pytest.raises(UserError, match="could not be written"):
        write_png(tmp_path / "missing" / "a.png", image)
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(UserError, match="could not be written"):
        write_png(tmp_path / "folder.png", image)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder.png"]


@pytest.mark.parametrize("size", [(0, 10, 1), (10, 20000, 1), (10, 10, 9)])
def test_impossible_sizes_are_refused(size):
    with pytest.raises(UserError, match="cannot be drawn"):
        render(Scene(), camera(), *size)


def test_without_a_driver_the_message_says_what_to_install(ctx):
    script = "from core.errors import UserError\nfrom viewport.context import standalone_context\n" \
        "try:\n    standalone_context()\nexcept UserError as error:\n    print(error)\n"
    root = Path(__file__).resolve().parents[2]
    environment = {**os.environ, "PYTHONPATH": str(root), "__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent.json"}
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "install the packages" in done.stdout


def test_a_context_offers_core_profile_3_3():
    try:
        context = standalone_context()
    except UserError as error:
        pytest.skip(str(error))
    assert context.version_code >= 330
    context.release()

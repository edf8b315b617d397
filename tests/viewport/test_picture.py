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
from tests.viewport.scenes import FLAT, ball, camera
from viewport.context import end, standalone_context
from viewport.picture import render, render_png, write_png
from viewport.scene import Scene, thinned


def test_a_png_holds_the_picture(ctx, tmp_path):
    skin, coat = ball(count=500)
    scene = Scene(surfaces=(skin,), coats=(coat,))
    path = tmp_path / "ball.png"
    render_png(path, scene, camera(), (90, 60), 2)
    read = cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB)
    assert read.shape == (60, 90, 3)
    with ctx:  # the picture's own context was the current one in between
        assert np.array_equal(read, render(scene, camera(), 90, 60, 2, ctx=ctx))
    assert [p.name for p in tmp_path.iterdir()] == ["ball.png"]


def test_a_picture_that_cannot_be_written_says_so_and_leaves_the_old_one(tmp_path):
    image = np.zeros((4, 5, 3), np.uint8)
    with pytest.raises(UserError, match="does not exist: create it"):
        write_png(tmp_path / "missing" / "a.png", image)
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(UserError, match="choose another name"):
        write_png(tmp_path / "folder.png", image)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder.png"]


@pytest.mark.parametrize("size", [(0, 10, 1), (10, 20000, 1), (10, 10, 9)])
def test_impossible_sizes_are_refused(size):
    with pytest.raises(UserError, match="cannot be drawn"):
        render(Scene(), camera(), *size)


def test_a_thinned_coat_keeps_ids_and_looks_alike(ctx):
    look = FLAT._replace(root_width=0.008, tip_width=0.004)
    skin, coat = ball(count=20000, look=look)
    few = thinned(coat, 7000)
    assert thinned(coat, 20000) is coat
    order = np.random.default_rng(1).permutation(20000)[:9000].astype(np.int32)
    shown = thinned(coat._replace(order=order), 4500)
    assert np.array_equal(shown.ids, np.sort(order[:4500])), "of the hairs that are shown, the first by rank"
    assert len(few.points) == len(few.ids) == len(few.normals) == 6667
    assert np.array_equal(few.points[5], coat.points[15])
    assert few.ids[5] == coat.ids[15]
    many_, few_ = (render(Scene((skin,), (c,)), camera(), 90, 90, 1, ctx=ctx).astype(float) for c in (coat, few))
    assert abs(many_.mean() - few_.mean()) < 6.0


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
    end(context)

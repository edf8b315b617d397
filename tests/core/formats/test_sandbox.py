"""The child process keeps its promises: data across, errors as sentences, crashes and greed survived."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from core.errors import UserError
from core.formats.sandbox import run_bounded

ROOT = Path(__file__).parents[3]
TARGETS = "tests.core.formats.sandbox_targets:"
posix = pytest.mark.skipif(sys.platform == "win32", reason="limits of memory need the resource module")


def call(name, arguments=None, **more):
    return run_bounded(TARGETS + name, arguments or {}, what="fox.usdc", **{"seconds": 30, **more})


def test_arrays_and_words_come_back_as_they_were():
    points = np.arange(12, dtype=np.float32).reshape(4, 3)
    back = call("echo", {"name": "Füchsin", "deep": {"list": [1, 2.5, None, "x"]}})
    np.testing.assert_array_equal(back["points"], points)
    np.testing.assert_array_equal(back["turned"], points.T)
    np.testing.assert_array_equal(back["big_endian"], points.astype(np.float64))
    assert back["points"].dtype == np.float32
    assert back["points"].flags.owndata or back["points"].base.flags.owndata
    assert back["points"].flags.writeable
    assert back["none"].shape == (0, 3)
    assert back["none"].dtype == np.int32
    assert back["flags"].tolist() == [True, False]
    assert (back["scalar"], back["name"], back["deep"]) == (2.5, "Füchsin", {"list": [1, 2.5, None, "x"]})


def test_a_user_error_of_the_function_arrives_as_itself():
    with pytest.raises(UserError, match=r"^This file has no hair; export curves instead\.$"):
        call("refuse")


def test_any_other_exception_is_one_sentence_with_the_traceback_as_a_note():
    with pytest.raises(UserError, match=r"fox\.usdc could not be read \(bad header\)") as caught:
        call("stumble")
    assert "\n" not in str(caught.value)
    assert "ValueError" in caught.value.__notes__[0]


@pytest.mark.parametrize("name", ["crash", "leave"])
def test_a_child_that_dies_is_a_damaged_file(name):
    with pytest.raises(UserError, match=r"fox\.usdc could not be read"):
        call(name)


def test_time_is_bounded():
    start = time.monotonic()
    with pytest.raises(UserError, match="longer than 1 seconds"):
        call("sleep", seconds=1)
    assert time.monotonic() - start < 20


@posix
def test_memory_is_bounded():
    with pytest.raises(UserError, match="too much memory"):
        call("hoard", memory=1 << 30)


def test_cancel_ends_the_child():
    asked = []

    def cancel():
        asked.append(1)
        return len(asked) > 3

    with pytest.raises(UserError, match="cancelled"):
        call("sleep", cancel=cancel)


def test_python_objects_never_cross():
    with pytest.raises(UserError, match=r"no sensible answer|could not be read"):
        call("objects")


@pytest.mark.parametrize("dtype", ["<f4", "|O", "<U9", "V8"])
def test_an_answer_that_promises_more_than_it_holds_is_refused(dtype, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.raises(UserError, match="no sensible answer"):
        call("lie", {"answer_is_beside": dtype})


def test_nothing_is_left_behind(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    call("echo")
    with pytest.raises(UserError):
        call("crash")
    assert os.listdir(tmp_path) == []


def test_readers_in_the_child_wait_for_no_kernels():
    readers = "usd_mesh", "usd_curves", "usd_cameras", "usd_camera_path", "alembic_mesh", "alembic_curves", "picture"
    code = f"""
import importlib, sys
for name in {readers!r}:
    importlib.import_module("core.formats." + name)
print([name for name in ("numba", "scipy", "cv2", "core.document") if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"

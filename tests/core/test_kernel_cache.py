"""Compiled kernels can never be older than their sources."""

import os
import subprocess
import sys
from pathlib import Path

from core import kernel_cache
from core.kernel_cache import kernels_compiled, note_compiled, source_hash

ROOT = Path(__file__).parents[2]


def cache_of(environment: dict[str, str]) -> str:
    code = "import core, os, numba; print(numba.config.CACHE_DIR)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT,
        env={**{k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}, **environment},
    )
    return done.stdout.strip()


def test_numba_is_pointed_at_the_folder_of_these_sources(tmp_path):
    assert cache_of({"XDG_CACHE_HOME": str(tmp_path)}) == str(tmp_path / "filoplume" / f"kernels-{source_hash()}")


def test_a_folder_given_by_the_environment_wins(tmp_path):
    assert cache_of({"NUMBA_CACHE_DIR": str(tmp_path)}) == str(tmp_path)


def test_folders_of_old_sources_go_after_a_while(tmp_path):
    old, recent = tmp_path / "filoplume" / "kernels-old", tmp_path / "filoplume" / "kernels-recent"
    old.mkdir(parents=True)
    recent.mkdir()
    os.utime(old, (1e9, 1e9))
    cache_of({"XDG_CACHE_HOME": str(tmp_path)})
    assert not old.exists()
    assert recent.exists()


def test_a_home_that_cannot_be_written_to_does_not_stop_the_start():
    assert cache_of({"XDG_CACHE_HOME": "/proc/nowhere"}) == ""


def test_what_was_compiled_is_known_until_its_sources_change(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert not kernels_compiled()
    note_compiled()
    assert kernels_compiled()
    monkeypatch.setattr(kernel_cache, "source_hash", lambda: "of another day")
    assert not kernels_compiled()


def test_without_a_folder_for_kernels_nothing_is_noted(tmp_path, monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.chdir(tmp_path)
    note_compiled()
    assert not kernels_compiled()
    assert not list(tmp_path.iterdir())

"""Hostile files: each is read or refused in one sentence, within seconds and without much memory.

Files of native readers run in their child process; the others here, where a stray exception fails the test.
"""

from __future__ import annotations

import time
import tracemalloc

import numpy as np
import pytest

from core.errors import UserError
from core.formats import curve_file, mesh_file
from core.formats.mesh_file import read_mesh
from core.formats.picture import read_picture
from core.mesh.triangulate import triangulate
from tests.contract import hostile

OWN = hostile.obj_files() | hostile.ply_files() | hostile.stl_and_off_files() | hostile.gltf_files()
NATIVE = hostile.usd_files()
# What a reader must still manage although it looks odd.
MUST_READ = {
    "utf16.obj", "utf32.obj", "bad_names.obj", "mostly_far.obj", "groups.obj", "slashes.obj", "signs.obj",
    "escape_names.obj", "one_line.off", "comments.off", "rotation_zero.gltf", "axis.usda",
    "unit_zero.usda", "unit_nan.usda", "uvs_short.usda", "giant_face.obj", "many_corners.obj", "every_group.obj",
}  # fmt: skip
SECONDS = 30.0  # on a busy machine; each takes well under one on a quiet one


def refused_or_sound(read, path):
    """What `read` gives for `path`, None when it refuses in one sentence."""
    start = time.monotonic()
    try:
        return read(path)
    except UserError as error:
        message = str(error)
        assert "\n" not in message
        assert len(message) < 500
        assert path.name in message
        return None
    finally:
        assert time.monotonic() - start < SECONDS


def check_mesh(path, name):
    found = refused_or_sound(read_mesh, path)
    assert found is not None or name not in MUST_READ
    if found is not None:
        assert np.isfinite(found.mesh.points).all()
        assert len(found.mesh.counts) > 0
        triangulate(found.mesh)


def test_there_are_at_least_a_hundred():
    assert len(OWN) + len(NATIVE) + len(hostile.curve_files()) + len(hostile.picture_files()) >= 150
    assert {*OWN, *NATIVE} >= MUST_READ


@pytest.mark.parametrize("name", OWN)
def test_own_readers(name, tmp_path, monkeypatch):
    # the net for what a reader has overlooked is taken away: each reader must refuse by itself
    monkeypatch.setattr(mesh_file, "DAMAGE", ())
    path = tmp_path / name
    path.write_bytes(OWN[name])
    tracemalloc.start()
    try:
        check_mesh(path, name)
        assert tracemalloc.get_traced_memory()[1] < 512 << 20
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("name", NATIVE)
def test_native_readers(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(NATIVE[name])
    check_mesh(path, name)


@pytest.mark.parametrize("name", hostile.curve_files())
def test_curves(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(hostile.curve_files()[name])
    groom = refused_or_sound(curve_file.read_groom, path)
    strands = [s for s in (groom.guides, groom.children) if s is not None] if groom is not None else []
    assert all(np.isfinite(s.points).all() for s in strands)


@pytest.mark.parametrize("name", hostile.picture_files())
def test_pictures(name, tmp_path):
    path = tmp_path / name
    if name == "folder.png":
        path.mkdir()
    else:
        path.write_bytes(hostile.picture_files()[name])
    pixels = refused_or_sound(read_picture, path)
    assert pixels is None or (np.isfinite(pixels).all() and pixels.dtype == np.float32)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".off", ".glb", ".usdc", ".abc"])
def test_a_sound_file_cut_or_bent_anywhere(suffix, tmp_path, monkeypatch):
    """Every length of a small file (a few of them for native readers), and single bytes changed."""
    from tests.contract.test_every_mesh_file import sample

    path = tmp_path / f"whole{suffix}"
    mesh_file.write_mesh(path, sample())
    whole = path.read_bytes()
    rng = np.random.default_rng(4)
    native = suffix in (".usdc", ".abc")
    if not native:
        monkeypatch.setattr(mesh_file, "DAMAGE", ())
    cuts = rng.integers(0, len(whole), 4 if native else 150)
    bends = rng.integers(0, len(whole), 8 if native else 150)
    for at in cuts.tolist():
        path.write_bytes(whole[:at])
        check_mesh(path, path.name)
    for at in bends.tolist():
        path.write_bytes(whole[:at] + bytes([whole[at] ^ int(rng.integers(1, 256))]) + whole[at + 1 :])
        check_mesh(path, path.name)

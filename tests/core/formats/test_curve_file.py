"""The table of suffixes, and every hair file we have: read, or refused in one sentence."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from core.errors import UserError
from core.formats.curve_file import WRITE_SUFFIXES, curve_info, read_curve_file, read_groom, write_groom
from core.groom.strands import GroomStrands
from tests.core.formats.coat_samples import differing_columns, make_groom

STRANDS = {  # of the real files: strands and points, counted by hand or by the library of the format
    "straight.hair": (10000, 160000), "Ratboy_mohawk.tfx": (2228, 71296), "pinnedCurves.usda": (3, 10),
    "basisCurves.usda": (2, 8), "bunnyCurves.usda": (6, 48),
}  # fmt: skip


def test_info_is_plain_and_true(tmp_path):
    groom = make_groom()
    for suffix in WRITE_SUFFIXES:
        path = tmp_path / f"coat{suffix}"
        write_groom(path, groom, metres_per_unit=0.01)
        info = curve_info(path, sandboxed=False)
        assert json.loads(json.dumps(info)) == info
        lonely = suffix == ".hair"
        assert (info["kind"], info["guides"], info["hairs"]) == ("groom", 0 if lonely else 5, 40)
        present = [groom.children] if lonely else [groom.guides, groom.children]
        points = np.concatenate([strands.points for strands in present])
        assert info["points"] == len(points)
        np.testing.assert_allclose(info["bounds"], [points.min(0), points.max(0)], rtol=1e-6)
        assert (info["metres_per_unit"], info["up"]) == (0.01, "y")
        assert ("ids" in info["columns"]) is not lonely


def test_suffixes_in_capitals_count(tmp_path):
    for suffix in (".USDC", ".ABC", ".HAIR", ".USDA", ".USDZ"):
        write_groom(tmp_path / f"coat{suffix}", make_groom())
        assert len(read_groom(tmp_path / f"coat{suffix}", sandboxed=False).children) == 40


def test_what_cannot_be_done_is_said(tmp_path):
    groom = make_groom()
    for call in (
        lambda: write_groom(tmp_path / "coat.fbx", groom),
        lambda: write_groom(tmp_path / "coat.usdc", GroomStrands()),
        lambda: write_groom(tmp_path / "coat.usdc", groom, up="x"),
        lambda: write_groom(tmp_path / "coat.usdc", groom, metres_per_unit=0.0),
        lambda: write_groom(tmp_path / "nowhere" / "coat.usdc", groom),
        lambda: read_groom(tmp_path / "missing.abc"),
        lambda: read_groom(tmp_path / "coat.fbx"),
    ):
        with pytest.raises(UserError):
            call()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", WRITE_SUFFIXES)
def test_an_interrupt_leaves_the_old_file(tmp_path, suffix, monkeypatch):
    path = tmp_path / f"coat{suffix}"
    write_groom(path, make_groom())
    before = path.read_bytes()

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("core.formats.atomic._sync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_groom(path, make_groom(seed=2))
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def real_files():
    folder = os.environ.get("FILOPLUME_DATA")
    return sorted(p for p in (Path(folder) / "hair").rglob("*") if p.is_file()) if folder else []


def test_every_real_file_is_read_or_refused_in_one_sentence(tmp_path):
    if not real_files():
        pytest.skip("FILOPLUME_DATA is not set")
    read = {}
    for path in real_files():
        if path.suffix not in (".usda", ".hair", ".tfx"):
            with pytest.raises(UserError, match=r"^[^\n]*\.$"):
                read_groom(path)
            continue
        file = read_curve_file(path, sandboxed=False)  # the next test reads one through the child
        hair = file.groom.children
        read[path.name] = (len(hair), len(hair.points))
        write_groom(tmp_path / "again.usdc", file.groom)
        again = read_groom(tmp_path / "again.usdc", sandboxed=False)
        np.testing.assert_array_equal(again.children.points, hair.points)
    assert len(read) == 11
    assert {name: read[name] for name in STRANDS} == STRANDS


def test_the_child_process_reads_the_same():
    if not real_files():
        pytest.skip("FILOPLUME_DATA is not set")
    path = next(p for p in real_files() if p.name == "BasisCurves1.usda")
    assert differing_columns(read_groom(path).children, read_groom(path, sandboxed=False).children) == []

"""Cem Yuksel's .hair: against the struct module, and a real model."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np
import pytest

from core.errors import UserError
from core.formats.curve_file import read_curve_file, read_groom, write_groom
from core.groom.strands import GroomStrands, Strands
from tests.core.formats.coat_samples import differing_columns, make_groom, make_strands

LOST = ("ids", "root_uvs", "guide_ids", "guide_weights")
RNG = np.random.default_rng(9)


def test_points_widths_and_colours_come_back_to_the_bit(tmp_path):
    groom = make_groom()
    write_groom(tmp_path / "coat.hair", groom)
    file = read_curve_file(tmp_path / "coat.hair")
    assert file.groom.guides is None
    assert differing_columns(groom.children, file.groom.children, but=LOST) == []
    assert all(getattr(file.groom.children, name) is None for name in LOST)
    assert (file.metres_per_unit, file.up, file.notes) == (1.0, "y", ())


def test_an_independent_parser_agrees(tmp_path):
    hair = make_groom().children
    write_groom(tmp_path / "coat.hair", GroomStrands(children=hair), up="z", metres_per_unit=0.01)
    data = (tmp_path / "coat.hair").read_bytes()
    magic, strands, points, arrays, segments = struct.unpack_from("<4sIIII", data)
    assert (magic, strands, points, arrays, segments) == (b"HAIR", len(hair), len(hair.points), 1 | 2 | 4 | 16, 0)
    at = 128
    assert list(struct.unpack_from(f"<{strands}H", data, at)) == (hair.counts - 1).tolist()
    at += 2 * strands
    xyz = np.array(struct.unpack_from(f"<{3 * points}f", data, at)).reshape(-1, 3)
    truth = np.stack([hair.points[:, 0], -hair.points[:, 2], hair.points[:, 1]], 1) * 100.0
    np.testing.assert_allclose(xyz, truth, rtol=1e-6)
    at += 12 * points
    np.testing.assert_allclose(struct.unpack_from(f"<{points}f", data, at), hair.widths * 100.0, rtol=1e-6)
    at += 4 * points
    np.testing.assert_array_equal(struct.unpack_from(f"<{3 * points}f", data, at), hair.colors.reshape(-1))
    assert len(data) == at + 12 * points


def test_equal_strands_need_no_segment_array_and_guides_stand_in(tmp_path):
    guides = make_strands(RNG, 6, False, least=5, most=5).replace(colors=None, widths=None)
    write_groom(tmp_path / "coat.hair", GroomStrands(guides=guides))
    data = (tmp_path / "coat.hair").read_bytes()
    assert struct.unpack_from("<III", data, 8) == (30, 2, 4)
    assert len(data) == 128 + 12 * 30
    assert differing_columns(guides, read_groom(tmp_path / "coat.hair").children, but=LOST) == []


def header(magic=b"HAIR", strands=2, points=4, arrays=2, segments=1, thickness=0.5, text=b""):
    return struct.pack("<4sIIIIff3f88s", magic, strands, points, arrays, segments, thickness, 0, 1, 0, 0, text)


POINTS = np.arange(12, dtype="<f4").tobytes()


def test_lower_case_magic_and_defaults_of_the_header(tmp_path):
    (tmp_path / "a.hair").write_bytes(header(b"hair") + POINTS)
    hair = read_groom(tmp_path / "a.hair").children
    assert hair.counts.tolist() == [2, 2]
    assert hair.points.reshape(-1).tolist() == list(range(12))
    assert hair.widths.tolist() == [0.5] * 4
    assert hair.colors.tolist() == [[1, 0, 0]] * 4


def test_transparency_is_stepped_over(tmp_path):
    colors = np.linspace(0, 1, 12, dtype="<f4")
    (tmp_path / "a.hair").write_bytes(header(arrays=2 | 8 | 16) + POINTS + bytes(16) + colors.tobytes())
    np.testing.assert_array_equal(read_groom(tmp_path / "a.hair").children.colors.reshape(-1), colors)


@pytest.mark.parametrize("data", [
    b"", b"HAIR", header(b"HERR") + POINTS, header(arrays=4) + POINTS, header() + POINTS[:-1],
    header(strands=2**32 - 1, points=2**32 - 1), header(strands=2**32 - 1, arrays=3) + POINTS,
    header(segments=2) + POINTS, header(arrays=3) + struct.pack("<HH", 1, 2) + POINTS,
    header(arrays=3) + struct.pack("<HH", 65535, 1) + POINTS, header(strands=0, points=0),
    header(arrays=2**32 - 1) + POINTS, header() + b"\xff" * 48,
])  # fmt: skip
def test_hostile_files_are_refused_before_anything_is_allocated(tmp_path, data):
    (tmp_path / "a.hair").write_bytes(data)
    with pytest.raises(UserError) as caught:
        read_groom(tmp_path / "a.hair")
    assert str(caught.value).startswith("a.hair")


def test_strands_beyond_the_format_are_refused_by_name(tmp_path):
    long = Strands(counts=np.int32([65537, 2]), points=np.zeros((65539, 3), np.float32))
    with pytest.raises(UserError, match=r"65537 points; write \.usdc"):
        write_groom(tmp_path / "a.hair", GroomStrands(children=long))
    assert list(tmp_path.iterdir()) == []


def test_the_real_model():
    if "FILOPLUME_DATA" not in os.environ:
        pytest.skip("FILOPLUME_DATA is not set")
    path = Path(os.environ["FILOPLUME_DATA"]) / "hair/cemyuksel_straight/models/straight.hair"
    file = read_curve_file(path, unit="cm", up="z")
    hair, data = file.groom.children, path.read_bytes()
    assert (len(hair), len(hair.points)) == (10000, 160000)
    last = struct.unpack("<3f", data[128 + 12 * 159999 : 128 + 12 * 160000])
    np.testing.assert_allclose(hair.points[-1], np.array([last[0], last[2], -last[1]]) * 0.01, rtol=1e-6)
    colour = struct.unpack("<3f", data[-12:])
    np.testing.assert_array_equal(hair.colors[-1], np.float32(colour))
    # a head of hair hangs: told that Z is up, its tips are far below its roots
    ends = hair.points.reshape(10000, 16, 3)
    assert (ends[:, -1, 1] - ends[:, 0, 1]).mean() < -0.5

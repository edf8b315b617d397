"""The dialects of OBJ."""

from __future__ import annotations

import numpy as np
import pytest

from core.errors import UserError
from core.formats.obj import read_obj

FOUR = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"


def read(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "t.obj"
    path.write_bytes(text.encode(encoding))
    return read_obj(path)


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-8-sig"])
def test_line_endings_and_encodings(ending, encoding, tmp_path):
    found = read(tmp_path, (FOUR + "f 1 2 3 4").replace("\n", ending), encoding)
    assert found.counts.tolist() == [4]
    assert found.corners.tolist() == [0, 1, 2, 3]
    assert found.uvs is None
    np.testing.assert_array_equal(found.points[2], (1, 1, 0))


def test_all_ways_to_name_a_corner(tmp_path):
    found = read(tmp_path, FOUR + "f 1/1 2/2/9 3//4\nf -4/-3 -3/3 -1\nf 1/ 2/3/ 3// \nfo 1 2 4 # 3 3\n")
    assert found.corners.tolist() == [0, 1, 2, 0, 1, 3, 0, 1, 2, 0, 1, 3]
    nan = [np.nan, np.nan]
    expected = [[0, 0], [1, 0], nan, [0, 0], [1, 1], nan, nan, [1, 1], nan, nan, nan, nan]
    np.testing.assert_array_equal(found.uvs, expected)


def test_relative_indices_count_from_where_they_stand(tmp_path):
    found = read(tmp_path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 5 5 5\nf -3 -2 -1\nf -5 1 2\nf 0 1 2\n")
    assert found.corners.tolist() == [0, 1, 2, 1, 2, 3, -2, 0, 1, -2, 0, 1]


def test_continued_lines_comments_and_odd_spacing(tmp_path):
    vertices = "# f 1 2 3\n\tv  0\t0 0 # origin\n  v 1 0 0 0.5 0.5 0.5\nv 1 1 \\\n0\n"
    found = read(tmp_path, vertices + "f 1 \\\r\n 2 \\\n3 # 4\n")
    np.testing.assert_array_equal(found.points, [(0, 0, 0), (1, 0, 0), (1, 1, 0)])
    assert found.corners.tolist() == [0, 1, 2]


@pytest.mark.parametrize(("statements", "names", "parts"), [
    ("f 1 2 3\nf 1 3 4\n", ("mesh",), [0, 0]),
    ("g ear left\nf 1 2 3\ng\nf 1 3 4\n", ("ear left", "mesh"), [0, 1]),
    ("o cat\nf 1 2 3\ng tail\nf 1 3 4\n", ("cat", "cat/tail"), [0, 1]),
    ("f 1 2 3\no late\nf 1 3 4\n", ("mesh", "late"), [0, 1]),
    ("usemtl fur\nf 1 2 3\nusemtl skin\nf 1 3 4\n", ("fur", "skin"), [0, 1]),
    ("g a\nusemtl fur\nf 1 2 3\nusemtl skin\nf 1 3 4\n", ("a",), [0, 0]),
    ("g a\nf 1 2 3\ng b\ng a\nf 1 3 4\ng unused\n", ("a",), [0, 0]),
])  # fmt: skip
def test_parts(statements, names, parts, tmp_path):
    found = read(tmp_path, FOUR + statements)
    assert found.part_names == names
    assert found.parts.tolist() == parts


@pytest.mark.parametrize("text", ["", "v 0 0 0\nl 1 2\n", "v 0 0 0\np 1\n", "# nothing\n"])
def test_files_without_faces_are_refused(text, tmp_path):
    with pytest.raises(UserError, match=r"t\.obj holds .* no faces"):
        read(tmp_path, text)

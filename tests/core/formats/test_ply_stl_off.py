"""PLY, STL and OFF against files written by hand from their descriptions."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from core.formats.off import read_off
from core.formats.ply import read_ply
from core.formats.stl import read_stl

POINTS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 2, 0.25)])
FACES = [[0, 1, 2, 3], [3, 2, 4], [0, 1, 2, 3, 4]]
CORNERS = [corner for ring in FACES for corner in ring]


def ply_header(form, vertex="", face=""):
    return (
        f"ply\nformat {form} 1.0\ncomment by hand\nobj_info x\nelement vertex 5\nproperty double x\nproperty float y\n"
        f"property float z\n{vertex}element face 3\n{face}property list uchar int vertex_index\nend_header\n"
    ).encode()


@pytest.mark.parametrize(("form", "order"), [("binary_little_endian", "<"), ("binary_big_endian", ">")])
def test_binary_ply_of_mixed_polygons_with_other_properties_between(form, order, tmp_path):
    vertex = "property uchar red\nproperty float s\nproperty float t\n"
    face = "property list ushort short marks\nproperty uchar flag\n"
    data = ply_header(form, vertex, face)
    for i, (x, y, z) in enumerate(POINTS):
        data += struct.pack(f"{order}dffBff", x, y, z, 7, i / 8, 1 - i / 8)
    for i, ring in enumerate(FACES):
        data += struct.pack(f"{order}H{i}hB", i, *range(i), 9) + struct.pack(f"{order}B{len(ring)}i", len(ring), *ring)
    (tmp_path / "t.ply").write_bytes(data)
    found = read_ply(tmp_path / "t.ply")
    np.testing.assert_array_equal(found.points, POINTS)
    assert found.counts.tolist() == [4, 3, 5]
    assert found.corners.tolist() == CORNERS
    np.testing.assert_array_equal(found.uvs[:, 0], np.array(CORNERS) / 8)
    np.testing.assert_array_equal(found.uvs[:, 1], 1 - np.array(CORNERS) / 8)


def test_text_ply_with_texcoords_of_corners(tmp_path):
    rows = [f"{x!r} {y!r} {z!r}" for x, y, z in POINTS.tolist()]
    coordinates = [np.arange(2 * len(ring)) / 16 for ring in FACES]
    coordinates[1] = coordinates[1][:0]  # this face has none
    for ring, uv in zip(FACES, coordinates, strict=True):
        rows.append(" ".join(map(str, [len(uv), *uv.tolist(), len(ring), *ring])))
    data = ply_header("ascii", face="property list uchar float texcoord\n") + "\r\n".join(rows).encode()
    (tmp_path / "t.ply").write_bytes(data)
    found = read_ply(tmp_path / "t.ply")
    assert found.corners.tolist() == CORNERS
    np.testing.assert_array_equal(found.uvs[:4].ravel(), coordinates[0])
    assert np.isnan(found.uvs[4:7]).all()
    np.testing.assert_array_equal(found.uvs[7:].ravel(), coordinates[2])


def facet(points):
    return struct.pack("<12fH", 0, 0, 1, *np.ravel(points), 0)


@pytest.mark.parametrize("head", [b"solid fox", b"header", b"solid facet normal"])
def test_binary_stl_whatever_its_header_says(head, tmp_path):
    triangles = np.arange(18, dtype=float).reshape(2, 3, 3)
    (tmp_path / "t.stl").write_bytes(head.ljust(80, b"\0") + struct.pack("<I", 2) + b"".join(map(facet, triangles)))
    found = read_stl(tmp_path / "t.stl")
    np.testing.assert_array_equal(found.points, triangles.reshape(-1, 3))
    assert found.corners.tolist() == list(range(6))


def test_text_stl_of_two_solids(tmp_path):
    def solid(name, z):
        return (
            f"  solid {name}\n facet normal 0 0 1\n  outer loop\n   VERTEX 0 0 {z}\n   vertex 1 0 {z}\n"
            f"   vertex 0 1e0 {z}\n  endloop\n endfacet\n endsolid {name}\n"
        )

    (tmp_path / "t.stl").write_text(solid("left vertex", 1) + solid("right", 2) + solid("right", 3))
    found = read_stl(tmp_path / "t.stl")
    assert found.part_names[0] == "left vertex"
    assert found.points[:, 2].tolist() == [1, 1, 1, 2, 2, 2, 3, 3, 3]
    assert found.parts.tolist() == [0, 1, 2]


OFF_BODY = "0 0 0{v}\n1 0 0{v}\n1 1 0{v}\n0 1 0{v}\n\n# between\n4 0 1 2 3{f}\n3 0 1 2{f} # end\n"


@pytest.mark.parametrize(("head", "v", "f"), [
    ("OFF\n4 2 0\n", "", ""), ("OFF 4 2 5\n", "", ""), ("# x\nOFF # y\n# z\n4 2 0\n", "", " 255 0 0"),
    ("COFF\n4 2 0\n", " 255 0 0 255", " 0.5 0.5 0.5"), ("NOFF\n4 2 0\n", " 0 0 1", ""),
    ("CNOFF\n4 2 0\n", " 0 0 1 9 9 9 9", " 1"), ("4OFF\n4 2 0\n", " 1", ""),
])  # fmt: skip
def test_prefixes_and_colours_of_off(head, v, f, tmp_path):
    (tmp_path / "t.off").write_text(head + OFF_BODY.format(v=v, f=f))
    found = read_off(tmp_path / "t.off")
    np.testing.assert_array_equal(found.points, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    assert found.counts.tolist() == [4, 3]
    assert found.corners.tolist() == [0, 1, 2, 3, 0, 1, 2]
    assert found.uvs is None


def test_texture_coordinates_of_off(tmp_path):
    (tmp_path / "t.off").write_text("STOFF 3 1 0\n0 0 0 0.25 0.5\n1 0 0 0.75 0.5\n0 1 0 0 1\n3 2 0 1\n")
    np.testing.assert_array_equal(read_off(tmp_path / "t.off").uvs, [(0, 1), (0.25, 0.5), (0.75, 0.5)])

"""glTF against buffers packed by hand."""

from __future__ import annotations

import json

import numpy as np
import pytest

from core.errors import UserError
from core.formats.gltf import read_gltf

POINTS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 2, 0)], np.float32)


def write(tmp_path, arrays, mesh, nodes=None, **changes):
    """A .gltf beside its .bin; `arrays` are (array, accessor words, view words)."""
    blob, views, accessors = b"", [], []
    kinds = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
    for array, accessor, view in arrays:
        blob += bytes(-len(blob) % 4)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes} | view)
        kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}[1 if array.ndim == 1 else array.shape[1]]
        accessors.append({
            "bufferView": len(views) - 1, "componentType": kinds[array.dtype.str[1:]], "count": len(array),
            "type": kind,
        } | accessor)  # fmt: skip
        blob += array.tobytes()
    (tmp_path / "my data.bin").write_bytes(blob)
    document = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": nodes or [{"mesh": 0}], "meshes": [mesh],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(blob), "uri": "my%20data.bin"}],
    } | changes  # fmt: skip
    (tmp_path / "t.gltf").write_text(json.dumps(document))
    return tmp_path / "t.gltf"


def primitive(mode=4, **more):
    return {"attributes": {"POSITION": 0}, "indices": 1, "mode": mode, **more}


@pytest.mark.parametrize(("mode", "index", "triangles"), [
    (4, [0, 1, 2, 0, 2, 3], [[0, 1, 2], [0, 2, 3]]),
    (5, [0, 1, 3, 2, 4], [[0, 1, 3], [3, 1, 2], [3, 2, 4]]),
    (6, [0, 1, 2, 3, 4], [[0, 1, 2], [0, 2, 3], [0, 3, 4]]),
])  # fmt: skip
@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.uint32])
def test_modes_and_index_types(mode, index, triangles, kind, tmp_path):
    path = write(tmp_path, [(POINTS, {}, {}), (np.array(index, kind), {}, {})], {"primitives": [primitive(mode)]})
    found = read_gltf(path)

    def rings(rows):
        return [tuple(np.roll(row, -int(np.argmin(row)))) for row in np.reshape(rows, (-1, 3))]

    assert rings(found.corners) == rings(triangles)


def test_lines_are_left_and_groups_of_one_node_are_one_part(tmp_path):
    index = np.array([0, 1, 2], np.uint16)
    mesh = {"name": "fox", "primitives": [primitive(), primitive(1), primitive(0), primitive()]}
    found = read_gltf(write(tmp_path, [(POINTS, {}, {}), (index, {}, {})], mesh))
    assert found.counts.tolist() == [3, 3]
    assert found.part_names == ("fox",)
    assert found.corners.tolist() == [0, 1, 2, 5, 6, 7]


def test_nodes_place_and_a_mirrored_one_is_turned_over(tmp_path):
    index = np.array([0, 1, 2], np.uint16)
    half = float(np.sqrt(0.5))
    nodes = [
        {"children": [1, 2, 3], "translation": [0, 0, 10]},
        {"mesh": 0, "name": "a", "rotation": [0, 0, half, half], "scale": [2, 2, 2]},
        {"mesh": 0, "name": "a", "scale": [-1, 1, 1]},
        {"mesh": 0, "name": "b", "matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]},
    ]
    found = read_gltf(write(tmp_path, [(POINTS, {}, {}), (index, {}, {})], {"primitives": [primitive()]}, nodes))
    np.testing.assert_allclose(found.points[:3], [(0, 0, 10), (0, 2, 10), (-2, 2, 10)], atol=1e-6)
    np.testing.assert_allclose(found.points[5:8], [(0, 0, 10), (-1, 0, 10), (-1, 1, 10)], atol=1e-6)
    np.testing.assert_allclose(found.points[10:13], [(5, 6, 17), (5, 7, 17), (4, 7, 17)], atol=1e-6)
    assert found.corners.reshape(3, 3).tolist() == [[0, 1, 2], [7, 6, 5], [10, 11, 12]]
    assert found.part_names == ("a", "a_2", "b")


def test_strides_normalised_and_sparse_values(tmp_path):
    padded = np.zeros((5, 5), np.float32)
    padded[:, :3] = POINTS
    uvs = np.array([(0, 0), (65535, 0), (65535, 65535), (0, 32768), (1, 2)], np.uint16)
    arrays = [
        (padded.reshape(-1), {"type": "VEC3", "count": 5, "sparse": {
            "count": 2, "indices": {"bufferView": 3, "componentType": 5121}, "values": {"bufferView": 4}}},
         {"byteStride": 20}),
        (np.array([0, 1, 2], np.uint8), {}, {}),
        (uvs, {"normalized": True}, {}),
        (np.array([1, 4], np.uint8), {}, {}),
        (np.array([(9, 8, 7), (6, 5, 4)], np.float32), {}, {}),
    ]  # fmt: skip
    mesh = {"primitives": [primitive(attributes={"POSITION": 0, "TEXCOORD_0": 2})]}
    found = read_gltf(write(tmp_path, arrays, mesh))
    np.testing.assert_array_equal(found.points, [(0, 0, 0), (9, 8, 7), (1, 1, 0), (0, 1, 0), (6, 5, 4)])
    np.testing.assert_allclose(found.uvs, [(0, 1), (1, 1), (1, 0)], atol=1e-6)  # v counts from the top in glTF


def test_polygons_of_the_ngon_extension(tmp_path):
    index = np.array([0, 1, 2, 0, 2, 3, 3, 2, 4, 0, 1, 2], np.uint16)
    mesh = {"primitives": [primitive(extensions={"FB_ngon_encoding": {}})]}
    found = read_gltf(write(tmp_path, [(POINTS, {}, {}), (index, {}, {})], mesh))
    assert found.counts.tolist() == [4, 3, 3]
    assert found.corners.tolist() == [0, 1, 2, 3, 3, 2, 4, 0, 1, 2]


@pytest.mark.parametrize(("changes", "words"), [
    ({"buffers": [{"byteLength": 60, "uri": "gone.bin"}]}, r"needs gone\.bin"),
    ({"buffers": [{"byteLength": 60, "uri": "../other.bin"}]}, "outside its folder"),
    ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "Draco"),
    ({"extensionsRequired": ["EXT_meshopt_compression"]}, "meshopt"),
    ({"nodes": [{"children": [1]}, {"children": [0]}]}, "contain themselves"),
    ({"nodes": [{}]}, "no triangles"),
])  # fmt: skip
def test_what_cannot_be_read_is_named(changes, words, tmp_path):
    (tmp_path.parent / "other.bin").write_bytes(bytes(60))
    arrays = [(POINTS, {}, {}), (np.array([0, 1, 2], np.uint8), {}, {})]
    with pytest.raises(UserError, match=words):
        read_gltf(write(tmp_path, arrays, {"primitives": [primitive()]}, **changes))

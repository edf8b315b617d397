"""Hostile files made by code: name -> bytes. Each is to be read or refused in one sentence, soon."""

from __future__ import annotations

import base64
import io
import json
import struct
import zipfile
import zlib
from typing import Any

import numpy as np

CUBE_OBJ = b"".join(
    b"v %d %d %d\n" % (x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)
) + b"f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"  # fmt: skip


def obj_files() -> dict[str, bytes]:
    files = {f"cut{at}.obj": CUBE_OBJ[:at] for at in (1, 30, 90, 105, 120)}
    files |= {
        "nul.obj": b"\0" * 10_000,
        "noise.obj": np.random.default_rng(1).bytes(100_000),
        "huge_index.obj": b"v 0 0 0\nf 1 99999999999999999999999999 -99999999999999999999\n",
        "nan.obj": b"v nan inf -inf\nv 1e999 0 0\nv 0 0 0\nf 1 2 3\n",
        "far.obj": b"v 1e38 0 0\nv 0 1e38 0\nv 0 0 1e38\nf 1 2 3\n",
        "mostly_far.obj": CUBE_OBJ + b"v 1e300 1 1\nf 1 2 9\n",
        "giant_face.obj": b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf " + b"1 2 3 " * 200_000,
        "many_corners.obj": b"".join(b"v %d %d 0\n" % (i % 317, i * i % 331) for i in range(20_000))
        + b"f " + b" ".join(b"%d" % i for i in range(1, 20_001)),
        "one_line.obj": b"v " + b"1 " * 1_000_000,
        "long_word.obj": b"v " + b"9" * 1_000_000 + b" 0 0\nf 1 1 1\n",
        "continued.obj": b"f \\\n" * 200_000,
        "groups.obj": CUBE_OBJ.replace(b"\nf", b"\ng " + b"x" * 5000 + b"\nf") + b"g a\n" * 100_000,
        "every_group.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"".join(b"g %d\nf 1 2 3\n" % i for i in range(20_000)),
        "utf16.obj": CUBE_OBJ.decode().encode("utf-16"),
        "utf16_cut.obj": CUBE_OBJ.decode().encode("utf-16")[:-1],
        "utf32.obj": CUBE_OBJ.decode().encode("utf-32"),
        "surrogate.obj": b"\xff\xfe\x00\xd8\x00\xd8",
        "slashes.obj": CUBE_OBJ + b"f 1/ 2// 3///\nf / // ///\nf 1//1/1/1 2 3\n",
        "signs.obj": CUBE_OBJ + b"f -0 +1 --2\nf 1.5 2e3 0x3\n",
        "bad_names.obj": b"g \xff\xfe\xfa\no \xc3\x28\n" + CUBE_OBJ,
        "escape_names.obj": CUBE_OBJ.replace(b"\nf", b"\ng \x1b[31m\x07../../etc\nf"),
    }  # fmt: skip
    return files


def ply_files() -> dict[str, bytes]:
    def header(vertices: object, faces: object, form: str = "binary_little_endian", extra: str = "") -> bytes:
        return (
            f"ply\nformat {form} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n"
            f"{extra}element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
        ).encode()

    body = np.eye(3, dtype="<f4").tobytes() + b"\x03" + np.arange(3, dtype="<i4").tobytes()
    good = header(3, 1) + body
    files = {f"cut{at}.ply": good[:at] for at in (2, 20, len(good) - 49, len(good) - 14, len(good) - 1)}
    files |= {
        "count31.ply": header(2**31, 2**31) + body,
        "count63.ply": header(2**63, 1) + body,
        "count_huge.ply": header("9" * 400, 1) + body,
        "negative.ply": header(-1, 1) + body,
        "faces31.ply": header(3, 2**31 - 1) + body,
        "list255.ply": header(3, 1) + np.eye(3, dtype="<f4").tobytes() + b"\xff" + body,
        "index.ply": header(3, 1) + body[:37] + struct.pack("<3i", 2**31 - 1, -(2**31), 7),
        "nan.ply": header(3, 1) + np.full((3, 3), np.nan, "<f4").tobytes() + b"\x03" + struct.pack("<3i", 0, 1, 2),
        "no_format.ply": b"ply\nelement vertex 1\nend_header\n",
        "no_end.ply": b"ply\nformat ascii 1.0\n" + b"comment x\n" * 50_000,
        "list_x.ply": header(1, 1).replace(b"property float x", b"property list uchar float x") + bytes(40),
        "float_count.ply": header(3, 1).replace(b"list uchar int", b"list float int") + body,
        "unknown_type.ply": header(3, 1).replace(b"float x", b"quad x") + body,
        "empty_rows.ply": b"ply\nformat ascii 1.0\nelement ghost 999999999999999\nend_header\n",
        "ascii_words.ply": header(3, 1, "ascii") + b"a b c d e f g h i 3 0 1 2",
        "ascii_nan_count.ply": header(3, 1, "ascii") + b"0 0 0 1 0 0 0 1 0 nan 0 1 2",
        "ascii_count.ply": header(3, 1, "ascii") + b"0 0 0 1 0 0 0 1 0 1e18 0 1 2",
        "ascii_negative.ply": header(3, 1, "ascii") + b"0 0 0 1 0 0 0 1 0 -3 0 1 2",
        "int_list_count.ply": header(3, 1).replace(b"list uchar int", b"list int int")
        + np.eye(3, dtype="<f4").tobytes() + struct.pack("<i", -1),
    }  # fmt: skip
    return files


def stl_and_off_files() -> dict[str, bytes]:
    facet = struct.pack("<12fH", *range(12), 0)
    return {
        "cut.stl": bytes(80) + struct.pack("<I", 5) + facet,
        "count32.stl": bytes(80) + struct.pack("<I", 2**32 - 1) + facet,
        "short.stl": b"solid",
        "zeros.stl": bytes(84 + 50 * 3)[:80] + struct.pack("<I", 3) + bytes(150),
        "nan.stl": bytes(80) + struct.pack("<I", 1) + struct.pack("<12fH", *[float("nan")] * 12, 0),
        "text_cut.stl": b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0",
        "text_words.stl": b"solid a\nfacet\nvertex a b c\nvertex vertex vertex\nvertex 1 2\nendfacet\n" * 50,
        "text_binary.stl": b"solid facet" + np.random.default_rng(3).bytes(500),
        "solids.stl": b"solid x\nfacet\nendfacet\nendsolid x\n" * 20_000,
        "counts.off": b"OFF 2147483648 2147483648 0\n0 0 0\n",
        "nan.off": b"OFF nan nan nan\n",
        "negative.off": b"OFF -3 -1 0\n0 0 0\n",
        "cut.off": b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1",
        "corners.off": b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n99999999999 0 1 2\n",
        "index.off": b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 1e300\n",
        "binary.off": b"OFF BINARY\n" + bytes(100),
        "dimension.off": b"nOFF\n5\n3 1 0\n",
        "four.off": b"4OFF\n3 1 0\n0 0 0 0\n1 0 0 0\n0 1 0 0\n3 0 1 2\n",
        "one_line.off": b"OFF 3 1 0 0 0 0 1 0 0 0 1 0 3 0 1 2",
        "comments.off": b"OFF\n" + b"#" * 500_000 + b"\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2",
    }


def gltf_files() -> dict[str, bytes]:
    points = base64.b64encode(np.eye(3, dtype="<f4").tobytes()).decode()

    def gltf(**changes: Any) -> dict[str, Any]:
        return {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"byteLength": 36, "uri": f"data:application/octet-stream;base64,{points}"}],
        } | changes  # fmt: skip

    def accessor(**changes: Any) -> dict[str, Any]:
        return gltf(accessors=[{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"} | changes])

    def primitive(**changes: Any) -> dict[str, Any]:
        return gltf(meshes=[{"primitives": [{"attributes": {"POSITION": 0}} | changes]}])

    def buffer(uri: str) -> dict[str, Any]:
        return gltf(buffers=[{"byteLength": 36, "uri": uri}])

    chain = [{"children": [i + 1], "scale": [10.0, 10.0, 10.0]} for i in range(20_000)] + [{"mesh": 0}]
    sparse_values = {"bufferView": 0}
    documents = {
        "self_child": gltf(nodes=[{"mesh": 0, "children": [0]}]),
        "loop": gltf(nodes=[{"children": [1]}, {"children": [2]}, {"children": [0], "mesh": 0}]),
        "long_chain": gltf(nodes=chain),
        "diamond": gltf(nodes=[{"children": [1, 1]}, {"mesh": 0}]),
        "child_missing": gltf(nodes=[{"mesh": 0, "children": [7]}]),
        "child_negative": gltf(nodes=[{"mesh": 0, "children": [-1]}]),
        "mesh_missing": gltf(nodes=[{"mesh": 3}]),
        "mesh_negative": gltf(nodes=[{"mesh": -1}]),
        "scene_missing": gltf(scene=9),
        "count31": accessor(count=2**31),
        "count63": accessor(count=2**63 - 1),
        "count_negative": accessor(count=-3),
        "zeros_bomb": accessor(bufferView=None, count=2**40),
        "offset": accessor(byteOffset=2**62),
        "offset_negative": accessor(byteOffset=-12),
        "type": accessor(type="MAT4"),
        "component": accessor(componentType=1),
        "stride_zero": gltf(bufferViews=[{"buffer": 0, "byteLength": 36, "byteStride": 0}]),
        "stride_huge": gltf(bufferViews=[{"buffer": 0, "byteLength": 36, "byteStride": 2**62}]),
        "view_long": gltf(bufferViews=[{"buffer": 0, "byteLength": 2**62}]),
        "view_buffer": gltf(bufferViews=[{"buffer": 5, "byteLength": 36}]),
        "sparse_outside": accessor(sparse={"count": 3, "indices": {"bufferView": 0, "componentType": 5125},
                                           "values": sparse_values}),
        "sparse_count": accessor(sparse={"count": 2**40, "indices": {"bufferView": 0, "componentType": 5125},
                                         "values": sparse_values}),
        "draco": primitive(extensions={"KHR_draco_mesh_compression": {}}),
        "meshopt": gltf(extensionsRequired=["EXT_meshopt_compression"]),
        "lines": primitive(mode=1),
        "mode": primitive(mode=77),
        "indices_missing": primitive(indices=12),
        "matrix_short": gltf(nodes=[{"mesh": 0, "matrix": [1.0, 2.0]}]),
        "matrix_nan": gltf(nodes=[{"mesh": 0, "matrix": [1e308] * 16}]),
        "rotation_zero": gltf(nodes=[{"mesh": 0, "rotation": [0.0, 0.0, 0.0, 0.0]}]),
        "traversal": buffer("../../../../etc/passwd"),
        "absolute": buffer("/etc/passwd"),
        "encoded": buffer("%2e%2e/%2e%2e/etc/passwd"),
        "http": buffer("http://localhost:1/x.bin"),
        "file_url": buffer("file:///etc/passwd"),
        "nul_name": buffer("a\0b"),
        "long_name": buffer("a" * 100_000),
        "folder": buffer("."),
        "not_base64": buffer("data:application/octet-stream;base64,@@@"),
        "wrong_types": gltf(nodes="all of them"),
        "many_placings": gltf(
            nodes=[{"mesh": 0}] * 3000, scenes=[{"nodes": list(range(3000))}],
            meshes=[{"primitives": [{"attributes": {"POSITION": 0}}] * 100}],
        ),
    }  # fmt: skip
    files = {f"{name}.gltf": json.dumps(document).encode() for name, document in documents.items()}
    text = json.dumps(gltf(buffers=[{"byteLength": 36}])).encode()
    text += b" " * (-len(text) % 4)
    glb = b"glTF" + struct.pack("<III", 2, 28 + len(text) + 36, len(text)) + b"JSON" + text
    glb += struct.pack("<I", 36) + b"BIN\0" + np.eye(3, dtype="<f4").tobytes()
    files |= {f"cut{at}.glb": glb[:at] for at in (4, 10, 19, 60, len(glb) - 40, len(glb) - 1)}
    files |= {
        "version1.glb": b"glTF" + struct.pack("<I", 1) + glb[8:],
        "chunk_long.glb": glb[:12] + struct.pack("<I", 2**32 - 1) + glb[16:],
        "deep.gltf": b"[" * 100_000,
        "deep_object.gltf": b'{"nodes":' * 20_000,
        "not_text.gltf": b"\xff\xfe{}",
        "empty_object.gltf": b"{}",
        "number.gltf": b'{"scene": 1e400}',
    }
    return files


def usd_files() -> dict[str, bytes]:
    def mesh(points: str, counts: str, corners: str, rest: str = "", head: str = "") -> bytes:
        return (
            f'#usda 1.0\n({head}\n)\ndef Mesh "m"\n{{\n    point3f[] points = {points}\n'
            f"    int[] faceVertexCounts = {counts}\n    int[] faceVertexIndices = {corners}\n{rest}\n}}\n"
        ).encode()

    triangle = "[(0, 0, 0), (1, 0, 0), (0, 1, 0)]"
    deep = "".join(f'def Xform "a{i}"\n{{\n' for i in range(3000)) + "}\n" * 3000
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as bomb:
        bomb.writestr("mesh.usda", b" " * 200_000_000)
    outside = io.BytesIO()
    with zipfile.ZipFile(outside, "w") as archive:
        archive.writestr("../../mesh.usda", mesh(triangle, "[3]", "[0, 1, 2]"))
    return {
        "counts.usda": mesh(triangle, "[2147483647]", "[0, 1, 2]"),
        "counts_negative.usda": mesh(triangle, "[-3]", "[0, 1, 2]"),
        "counts_sum.usda": mesh(triangle, "[3, 3]", "[0, 1, 2]"),
        "index.usda": mesh(triangle, "[3]", "[0, 1, 2147483647]"),
        "nan.usda": mesh("[(nan, 0, 0), (inf, 0, 0), (0, -inf, 0)]", "[3]", "[0, 1, 2]"),
        "unit_zero.usda": mesh(triangle, "[3]", "[0, 1, 2]", head="metersPerUnit = 0"),
        "unit_nan.usda": mesh(triangle, "[3]", "[0, 1, 2]", head="metersPerUnit = nan"),
        "axis.usda": mesh(triangle, "[3]", "[0, 1, 2]", head='upAxis = "X"'),
        "uvs_short.usda": mesh(triangle, "[3]", "[0, 1, 2]", "texCoord2f[] primvars:st = [(0, 0)] (\n"
                               'interpolation = "faceVarying"\n)'),
        "uv_indices.usda": mesh(triangle, "[3]", "[0, 1, 2]", "texCoord2f[] primvars:st = [(0, 0)] (\n"
                                'interpolation = "faceVarying"\n)\nint[] primvars:st:indices = [0, 99, -7]'),
        "syntax.usda": b"#usda 1.0\ndef Mesh {{{",
        "cut.usda": mesh(triangle, "[3]", "[0, 1, 2]")[:-40],
        "self_reference.usda": b'#usda 1.0\n(\n    subLayers = [@./self_reference.usda@]\n)\n',
        "cycle.usda": b'#usda 1.0\ndef "a" (\n    references = </b>\n)\n{\n}\n'
                      b'def "b" (\n    references = </a>\n)\n{\n}\n',
        "outside.usda": b'#usda 1.0\ndef "a" (\n    references = @/etc/passwd@\n)\n{\n}\n',
        "deep.usda": b"#usda 1.0\n" + deep.encode(),
        "noise.usdc": b"PXR-USDC" + np.random.default_rng(5).bytes(5000),
        "header.usdc": b"PXR-USDC" + bytes(8) + struct.pack("<q", 2**62) + bytes(64),
        "empty.usdc": b"PXR-USDC",
        "noise.usd": np.random.default_rng(6).bytes(2000),
        "bomb.usdz": packed.getvalue(),
        "outside.usdz": outside.getvalue(),
        "cut.usdz": packed.getvalue()[:500],
        "noise.abc": np.random.default_rng(7).bytes(5000),
        "ogawa.abc": b"Ogawa\xff\x00\x01" + struct.pack("<q", 2**62) + bytes(64),
        "ogawa_zero.abc": b"Ogawa\xff\x00\x01" + bytes(200),
        "ogawa_loop.abc": b"Ogawa\xff\x00\x01" + struct.pack("<q", 16) + struct.pack("<qq", 1, 16) * 20,
        "hdf5.abc": b"\x89HDF\r\n\x1a\n" + bytes(2000),
    }  # fmt: skip


def curve_files() -> dict[str, bytes]:
    def hair(strands: int, points: int, bits: int, segments: int, body: bytes) -> bytes:
        return struct.pack("<4s4I5f88s", b"HAIR", strands, points, bits, segments, 1, 0, 0, 0, 0, b"") + body

    strand = np.arange(12, dtype="<f4").tobytes()
    return {
        "count32.hair": hair(2**32 - 1, 2**32 - 1, 2, 3, strand),
        "points32.hair": hair(1, 2**32 - 1, 2, 3, strand),
        "disagree.hair": hair(7, 4, 2, 3, strand),
        "bits.hair": hair(1, 4, 0xFFFFFFFF, 3, strand),
        "no_points.hair": hair(1, 4, 1, 3, struct.pack("<H", 3)),
        "nan.hair": hair(1, 4, 2, 3, np.full(12, np.nan, "<f4").tobytes()),
        "cut.hair": hair(1, 4, 2, 3, strand)[:-5],
        "header.hair": b"HAIR\x01",
        "segments.hair": hair(2, 8, 3, 3, struct.pack("<2H", 65535, 65535) + strand * 2),
    }


def picture_files() -> dict[str, bytes]:
    def png(width: int, height: int, body: bytes) -> bytes:
        def chunk(kind: bytes, data: bytes) -> bytes:
            return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

        head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
        return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(body)) + chunk(b"IEND", b"")

    good = png(64, 64, bytes(65 * 64))
    sizes = b"".join(struct.pack("<HHII", tag, 4, 1, 2**31) for tag in (256, 257))
    tiff = struct.pack("<2sHIH", b"II", 42, 8, 2) + sizes
    return {
        "bomb.png": png(60_000, 60_000, bytes(60_001 * 2000)),
        "wide.png": png(2**31 - 1, 1, b""),
        "zero.png": png(0, 0, b""),
        "cut.png": good[:60],
        "noise.png": good[:40] + np.random.default_rng(8).bytes(500),
        "tiff_loop.tif": struct.pack("<2sHIHI", b"II", 42, 8, 0, 8),
        "tiff_size.tif": tiff + bytes(4),
        "noise.tif": b"II*\0" + np.random.default_rng(9).bytes(500),
        "noise.jpg": b"\xff\xd8\xff\xe0" + np.random.default_rng(10).bytes(500),
        "size.jpg": b"\xff\xd8\xff\xc0\x00\x11\x08\xff\xff\xff\xff\x03\x01\x22\x00\x02\x11\x01\x03\x11\x01\xff\xd9",
        "page.gif": b"GIF89a" + bytes(100),
        "header.exr": b"\x76\x2f\x31\x01" + bytes(100),
        "folder.png": b"",
    }

"""glTF 2.0, as .gltf with its buffers or as one .glb: triangles of all nodes, in metres, Y up.

Polygons survive between programs that know ``FB_ngon_encoding`` (the triangles of one polygon follow one
another and begin with the same vertex); this reader and writer do.
"""

from __future__ import annotations

import base64
import binascii
import urllib.parse
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.gltf_accessors import Accessor, Buffer, BufferView, read_accessor
from core.formats.mesh_pieces import join, unique_names
from core.mesh.edges import reversed_corners
from core.mesh.mesh import Mesh
from core.mesh.polygons import Polygons
from core.mesh.triangulate import triangulate

TRIANGLES, STRIP, FAN = 4, 5, 6
NGONS = "FB_ngon_encoding"
UNREADABLE = {
    "KHR_draco_mesh_compression": "Draco compression",
    "EXT_meshopt_compression": "meshopt compression",
    "KHR_meshopt_compression": "meshopt compression",
}
MOST_PIECES = 20_000
MOST_CORNERS = 100_000_000  # nodes may place one mesh many times; past this it is no mesh to groom


class Primitive(msgspec.Struct):
    attributes: dict[str, int]
    indices: int | None = None
    mode: int = TRIANGLES
    extensions: dict[str, Any] = {}
    targets: list[dict[str, int]] = []


class GltfMesh(msgspec.Struct):
    primitives: list[Primitive]
    name: str = ""
    weights: list[float] = []
    extras: Any = None


class Skin(msgspec.Struct, rename="camel"):
    joints: list[int]
    inverse_bind_matrices: int | None = None


class Sampler(msgspec.Struct):
    input: int
    output: int
    interpolation: str = "LINEAR"


class Target(msgspec.Struct):
    path: str
    node: int | None = None


class Channel(msgspec.Struct):
    sampler: int
    target: Target


class Animation(msgspec.Struct):
    channels: list[Channel] = []
    samplers: list[Sampler] = []
    name: str = ""


class Perspective(msgspec.Struct, rename="camel"):
    yfov: float = 0.6
    znear: float = 0.01
    zfar: float | None = None
    aspect_ratio: float | None = None


class Orthographic(msgspec.Struct):
    xmag: float = 1.0
    ymag: float = 1.0
    znear: float = 0.01
    zfar: float = 1000.0


class GltfCamera(msgspec.Struct):
    type: str
    name: str = ""
    perspective: Perspective | None = None
    orthographic: Orthographic | None = None


class Node(msgspec.Struct):
    name: str = ""
    mesh: int | None = None
    camera: int | None = None
    skin: int | None = None
    children: list[int] = []
    matrix: tuple[float, ...] | None = None
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    weights: list[float] = []


class Scene(msgspec.Struct):
    nodes: list[int] = []


class Gltf(msgspec.Struct, rename="camel"):
    scene: int = 0
    scenes: list[Scene] = []
    nodes: list[Node] = []
    meshes: list[GltfMesh] = []
    skins: list[Skin] = []
    animations: list[Animation] = []
    cameras: list[GltfCamera] = []
    accessors: list[Accessor] = []
    buffer_views: list[BufferView] = []
    buffers: list[Buffer] = []
    extensions_required: list[str] = []


def read_gltf(path: Path) -> Polygons:
    """All triangles a glTF scene shows, each node a part, in metres, Y up.

    A skinned mesh is taken in the pose it was bound in. Other files are read only from the folder of `path`.

    Raises
    ------
    UserError
        Missing or foreign buffers, compressed geometry, nodes in a loop, counts that do not fit, no triangles.
    """
    gltf, buffers = open_gltf(path)
    try:
        with np.errstate(all="ignore"):  # what is not finite is found by the repair
            pieces = _pieces(path, gltf, buffers)
    except (IndexError, ValueError, OverflowError) as error:
        raise UserError(f"{path.name} contradicts itself ({error}); export it again.") from None
    if not pieces:
        raise UserError(f"{path.name} has no triangles; export a polygon mesh.")
    return join(pieces)


def open_gltf(path: Path) -> tuple[Gltf, list[bytes]]:
    """What a glTF file says and its buffers, nothing of it believed yet; UserError when it cannot be read."""
    text, chunk = _chunks(path)
    try:
        gltf = msgspec.json.decode(text, type=Gltf)
    except (msgspec.DecodeError, RecursionError, UnicodeError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else str(error).split(" - ")[0]
        raise UserError(f"{path.name} is not a glTF file that can be read ({reason}); export it again.") from None
    for extension in gltf.extensions_required:
        if extension in UNREADABLE:
            raise UserError(f"{path.name} uses {UNREADABLE[extension]}; export it again without it.")
    buffers = [_buffer(path, buffer, chunk if row == 0 else None) for row, buffer in enumerate(gltf.buffers)]
    return gltf, buffers


def write_glb(path: Path, mesh: Mesh) -> None:
    """Write one .glb: a node for each part, vertices split at UV seams, polygons kept as ``FB_ngon_encoding``."""
    if mesh.uvs is None:
        points, split = mesh.points, mesh.corners.astype(np.int64)
        uvs = None
    else:
        keys = np.column_stack([mesh.corners.astype(np.float64), mesh.uvs.astype(np.float64)])
        rows, inverse = np.unique(keys, axis=0, return_inverse=True)
        points, split = mesh.points[rows[:, 0].astype(np.int64)], inverse.ravel()
        uvs = np.column_stack([rows[:, 1], 1.0 - rows[:, 2]]).astype("<f4")
    indices, parts = _ngon_triangles(mesh, split)
    blob = bytearray()
    views: list[dict[str, int]] = []
    accessors: list[dict[str, Any]] = []

    def add(array: NDArray[Any], target: int, **accessor: Any) -> int:
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes, "target": target})
        blob.extend(array.tobytes())
        accessors.append({"bufferView": len(views) - 1, "byteOffset": 0, **accessor})
        return len(accessors) - 1

    low, high = (points.min(0), points.max(0)) if len(points) else (np.zeros(3), np.zeros(3))
    attributes = {"POSITION": add(
        points.astype("<f4"), 34962, componentType=5126, count=len(points), type="VEC3",
        min=[float(x) for x in low], max=[float(x) for x in high],
    )}  # fmt: skip
    if uvs is not None:
        attributes["TEXCOORD_0"] = add(uvs, 34962, componentType=5126, count=len(uvs), type="VEC2")
    nodes: list[dict[str, Any]] = []
    meshes: list[dict[str, Any]] = []
    for part, name in enumerate(mesh.part_names):
        rows = indices[parts == part].astype("<u4")
        if len(rows):
            accessor = add(rows, 34963, componentType=5125, count=rows.size, type="SCALAR")
            primitive = {"attributes": attributes, "indices": accessor, "mode": TRIANGLES, "extensions": {NGONS: {}}}
            nodes.append({"name": name, "mesh": len(meshes)})
            meshes.append({"name": name, "primitives": [primitive]})
    document = {
        "asset": {"version": "2.0", "generator": "Filoplume"}, "extensionsUsed": [NGONS], "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes, "meshes": meshes, "accessors": accessors,
        "bufferViews": views, "buffers": [{"byteLength": len(blob)}],
    }  # fmt: skip
    text = msgspec.json.encode(document)
    text += b" " * (-len(text) % 4)
    blob.extend(bytes(-len(blob) % 4))
    total = 12 + 8 + len(text) + 8 + len(blob)
    head = b"glTF" + (2).to_bytes(4, "little") + total.to_bytes(4, "little")
    chunks = len(text).to_bytes(4, "little") + b"JSON" + text + len(blob).to_bytes(4, "little") + b"BIN\0" + blob
    path.write_bytes(head + chunks)


def _chunks(path: Path) -> tuple[bytes, bytes | None]:
    """The JSON of the file and, of a .glb, its binary chunk."""
    data = path.read_bytes()
    if not data.startswith(b"glTF"):
        return data.removeprefix(b"\xef\xbb\xbf"), None
    if int.from_bytes(data[4:8], "little") != 2:
        raise UserError(f"{path.name} is not glTF 2.0; export it again as glTF 2.0.")
    text, binary, at = b"", None, 12
    while at + 8 <= len(data):
        length, kind = int.from_bytes(data[at : at + 4], "little"), data[at + 4 : at + 8]
        if at + 8 + length > len(data):
            raise UserError(f"{path.name} is cut short; copy it again.")
        if kind == b"JSON" and not text:
            text = data[at + 8 : at + 8 + length]
        elif kind == b"BIN\0" and binary is None:
            binary = data[at + 8 : at + 8 + length]
        at += 8 + length
    return text, binary


def _buffer(path: Path, buffer: Buffer, chunk: bytes | None) -> bytes:
    if buffer.uri is None:
        return chunk or b""
    if buffer.uri.startswith("data:"):
        head, _, body = buffer.uri.partition(",")
        try:
            if head.endswith(";base64"):
                return base64.b64decode(body, validate=True)
            return urllib.parse.unquote_to_bytes(body)
        except (binascii.Error, ValueError):
            raise UserError(f"{path.name} has a broken embedded buffer; export it again.") from None
    word = urllib.parse.unquote(buffer.uri)
    folder = path.resolve().parent
    beside = (folder / word).resolve() if "\0" not in word and len(word) < 4096 else folder.parent
    if not beside.is_relative_to(folder) or "://" in word:
        raise UserError(f"{path.name} wants a file outside its folder ({word[:80]}); put it beside and export again.")
    if not beside.is_file():
        raise UserError(f"{path.name} needs {word[:80]}, which is not there; copy it beside.")
    if beside.stat().st_size > 1 << 32:
        raise UserError(f"{word[:80]} is larger than 4 GB; export a smaller mesh.")
    return beside.read_bytes()


def _pieces(path: Path, gltf: Gltf, buffers: list[bytes]) -> list[Polygons]:
    pieces: list[Polygons] = []
    total = 0
    nodes = [(gltf.nodes[row], world) for row, world in placed_nodes(path, gltf)]
    placed = [(node, world) for node, world in nodes if node.mesh is not None]
    if sum(len(gltf.meshes[checked_row(node.mesh or 0)].primitives) for node, _ in placed) > MOST_PIECES:
        raise UserError(f"{path.name} shows more than {MOST_PIECES:,} pieces; join them before the export.")
    for node, world in placed:
        assert node.mesh is not None
        source = gltf.meshes[checked_row(node.mesh)]
        name = node.name or source.name or "mesh"
        of_node: list[Polygons] = []
        transform = np.eye(4) if node.skin is not None else world
        for primitive in source.primitives:
            for extension in UNREADABLE.keys() & primitive.extensions.keys():
                raise UserError(f"{path.name} uses {UNREADABLE[extension]}; export it again without it.")
            if primitive.mode not in (TRIANGLES, STRIP, FAN) or "POSITION" not in primitive.attributes:
                continue
            piece = read_primitive(gltf, buffers, primitive, transform, name)
            total += len(piece.corners)
            if total > MOST_CORNERS:
                raise UserError(f"{path.name} shows more than {MOST_CORNERS // 3:,} triangles; export a smaller mesh.")
            if len(piece.counts):
                of_node.append(piece)
        if of_node:
            pieces.append(join(of_node))
    return unique_names(pieces)


def placed_nodes(path: Path, gltf: Gltf) -> list[tuple[int, NDArray[np.float64]]]:
    """Every node the scene shows, by row, with its world matrix (4, 4); a node reached twice is a loop."""
    if gltf.scenes:
        roots = gltf.scenes[checked_row(gltf.scene)].nodes
    else:
        children = {child for node in gltf.nodes for child in node.children}
        roots = [row for row in range(len(gltf.nodes)) if row not in children]
    waiting = [(row, np.eye(4)) for row in reversed(roots)]
    seen: set[int] = set()
    placed = []
    while waiting:
        row, parent = waiting.pop()
        if row in seen:
            raise UserError(f"{path.name} has nodes that contain themselves; export it again.")
        seen.add(row)
        node = gltf.nodes[checked_row(row)]
        world = parent @ local_matrix(node)
        placed.append((row, world))
        waiting += [(child, world) for child in reversed(node.children)]
    return placed


def local_matrix(node: Node) -> NDArray[np.float64]:
    """Matrix (4, 4) of a node, column vectors."""
    if node.matrix is not None:
        return np.array(node.matrix, np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.rotation) / max(float(np.linalg.norm(node.rotation)), 1e-30)
    out = np.eye(4)
    out[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    out[:3, :3] *= np.array(node.scale)
    out[:3, 3] = node.translation
    return out


def checked_row(index: int) -> int:
    if index < 0:
        raise IndexError("an index is negative")
    return index


def read_primitive(
    gltf: Gltf, buffers: list[bytes], primitive: Primitive, world: NDArray[np.float64], name: str
) -> Polygons:
    def get(row: int, width: int) -> NDArray[np.float64]:
        return read_accessor(gltf.accessors[checked_row(row)], gltf.buffer_views, buffers, width)

    points = get(primitive.attributes["POSITION"], 3) @ world[:3, :3].T + world[:3, 3]
    index = np.arange(len(points))
    if primitive.indices is not None:
        index = get(primitive.indices, 1)[:, 0].astype(np.int64)
    if primitive.mode == TRIANGLES:
        triangles = index[: len(index) // 3 * 3].reshape(-1, 3)
    elif primitive.mode == STRIP:
        triangles = np.stack([index[:-2], index[1:-1], index[2:]], 1) if len(index) > 2 else index[:0].reshape(0, 3)
        triangles[1::2] = triangles[1::2][:, [1, 0, 2]]
    else:
        fan = np.stack([index[1:-1], index[2:]], 1) if len(index) > 2 else index[:0].reshape(0, 2)
        triangles = np.column_stack([np.full(len(fan), index[0] if len(index) else 0), fan])
    counts, corners = np.full(len(triangles), 3), triangles.reshape(-1)
    if NGONS in primitive.extensions and len(triangles):
        counts, corners = _ngons(triangles)
    if np.linalg.det(world[:3, :3]) < 0:  # a mirrored node turns its faces over
        corners = corners[reversed_corners(counts)]
    uvs = None
    if "TEXCOORD_0" in primitive.attributes:
        by_vertex = get(primitive.attributes["TEXCOORD_0"], 2)
        by_vertex = np.column_stack([by_vertex[:, 0], 1.0 - by_vertex[:, 1]]).astype(np.float32)
        uvs = np.full((len(corners), 2), np.nan, np.float32)
        there = (corners >= 0) & (corners < len(by_vertex))
        uvs[there] = by_vertex[corners[there]]
    return Polygons(points, counts, corners, uvs, np.zeros(len(counts), np.int32), (name,))


def _ngons(triangles: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Counts and corners of the polygons in triangles (T, 3) of ``FB_ngon_encoding``."""
    new = np.append(True, triangles[1:, 0] != triangles[:-1, 0])
    new[1:] |= triangles[1:, 1] != triangles[:-1, 2]
    starts = np.flatnonzero(new)
    counts = np.diff(np.append(starts, len(triangles))) + 2
    heads = np.zeros((len(triangles), 3), np.bool_)
    heads[:, 2] = True
    heads[starts] = True
    return counts, triangles[heads]


def _ngon_triangles(mesh: Mesh, split: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Triangles (T, 3) of `split` vertices and the part of each, neighbouring polygons told apart by their first."""
    cut = triangulate(mesh)
    corners = split[cut.corners]
    out = np.empty_like(corners)
    starts = (np.cumsum(mesh.counts, dtype=np.int64) - mesh.counts).tolist()
    rings = split.tolist()
    rows = corners.tolist()
    at, before, part = 0, -1, -1
    for start, count, belongs in zip(starts, mesh.counts.tolist(), mesh.parts.tolist(), strict=True):
        if belongs != part:
            before, part = -1, belongs
        ring = rings[start : start + count]
        triangles = rows[at : at + count - 2]
        common = set(triangles[0]).intersection(*triangles[1:]) if len(triangles) > 1 else set(ring)
        common.discard(before)
        if common and len(set(ring)) == count:  # a fan around a corner that shows where this polygon begins
            before = next(corner for corner in ring if corner in common)
            turn = ring.index(before)
            ring = ring[turn:] + ring[:turn]
            out[at : at + count - 2] = [(ring[0], ring[i + 1], ring[i + 2]) for i in range(count - 2)]
        else:
            for row, (a, b, c) in enumerate(triangles):
                first = (a, b, c) if a != before else (b, c, a)
                out[at + row] = first
                before = first[0]
        at += count - 2
    return out, mesh.parts[cut.faces]

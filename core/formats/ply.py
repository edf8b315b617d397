"""PLY: polygons as text or binary of either byte order, UVs per vertex (s, t) or per corner (texcoord)."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.text_numbers import BYTES, numbers
from core.mesh.mesh import Mesh
from core.mesh.polygons import Polygons

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
COUNT_TYPES = {word for word, kind in TYPES.items() if kind[0] in "iu"}
HEADER_CAP = 1 << 16
U_NAMES, V_NAMES = ("s", "u", "texture_u", "s0"), ("t", "v", "texture_v", "t0")


class Property(NamedTuple):
    """One property of an element; `length` is the type of the count of a list, None for a single number."""

    name: str
    type: str
    length: str | None


class Element(NamedTuple):
    name: str
    rows: int
    properties: tuple[Property, ...]


class Values(NamedTuple):
    """The numbers of one property: `counts` per row (None when there is one each) and the values in a row."""

    counts: NDArray[np.int64] | None
    values: NDArray[np.float64]


def read_ply(path: Path) -> Polygons:
    """The polygons of a PLY file.

    Raises
    ------
    UserError
        When it is no PLY file, has no faces, or holds less than its header says.
    """
    data = path.read_bytes()
    form, elements, body = _header(data, path.name)
    found: dict[str, dict[str, Values]] = {}
    if form == "ascii":
        words, _ = numbers(data[body:])
        at = 0
        for element in elements:
            found[element.name], at = _text_rows(words, at, element, path.name)
    else:
        at = body
        for element in elements:
            order = "<" if form == "binary_little_endian" else ">"
            found[element.name], at = _binary_rows(data, at, element, order, path.name)
    vertex, face = found.get("vertex", {}), found.get("face", {})
    vertex = {word: values for word, values in vertex.items() if values.counts is None}
    if not all(axis in vertex for axis in "xyz"):
        raise UserError(f"{path.name} has no vertices; export a polygon mesh.")
    indices = face.get("vertex_indices", face.get("vertex_index"))
    if indices is None or indices.counts is None or not len(indices.counts):
        raise UserError(f"{path.name} holds only points and no faces; export a polygon mesh.")
    points = np.stack([vertex[axis].values for axis in "xyz"], axis=1)
    corners = np.where(np.abs(indices.values) < 2**31, indices.values, -1.0).astype(np.int64)
    uvs = _uvs(vertex, face, indices.counts, corners)
    return Polygons(points, indices.counts, corners, uvs, np.zeros(len(indices.counts), np.int32), ("mesh",))


def write_ply(path: Path, mesh: Mesh) -> None:
    """Write a binary PLY of the polygons with UVs per corner (texcoord); names of parts are lost."""
    uvs = mesh.uvs
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment metres, Y up\n"
        f"element vertex {len(mesh.points)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(mesh.counts)}\nproperty list int int vertex_indices\n"
        + ("property list int float texcoord\n" if uvs is not None else "")
        + "end_header\n"
    )
    body = bytearray(header.encode("ascii") + mesh.points.astype("<f4").tobytes())
    corners = mesh.corners.astype("<i4")
    start = 0
    for count in mesh.counts.tolist():
        body += count.to_bytes(4, "little") + corners[start : start + count].tobytes()
        if uvs is not None:
            body += (2 * count).to_bytes(4, "little") + uvs[start : start + count].astype("<f4").tobytes()
        start += count
    path.write_bytes(body)


def _header(data: bytes, name: str) -> tuple[str, list[Element], int]:
    broken = UserError(f"{name} is not a PLY file that can be read; export it again.")
    end = re.search(rb"(?m)^end_header[ \t]*(\r\n|\n|\r)", data[:HEADER_CAP])
    if not data.startswith(b"ply") or end is None:
        raise broken
    form = ""
    elements: list[tuple[str, int, list[Property]]] = []
    for line in data[: end.start()].decode("latin-1").splitlines()[1:]:
        match line.split():
            case ["format", ("ascii" | "binary_little_endian" | "binary_big_endian") as form, *_]:
                pass
            case ["element", word, rows] if rows.isascii() and rows.isdigit() and len(rows) < 16:
                elements.append((word, int(rows), []))
            case ["property", "list", length, kind, word] if elements and length in COUNT_TYPES and kind in TYPES:
                elements[-1][2].append(Property(word, TYPES[kind], TYPES[length]))
            case ["property", kind, word] if elements and kind in TYPES:
                elements[-1][2].append(Property(word, TYPES[kind], None))
            case ["element" | "property" | "format", *_]:
                raise broken
            case _:
                continue  # comments and obj_info
    if not form:
        raise broken
    return form, [Element(word, rows, tuple(properties)) for word, rows, properties in elements], end.end()


def _short(name: str, element: Element) -> UserError:
    return UserError(f"{name} is cut short: it says {element.rows} of {element.name}; copy or export it again.")


def _text_rows(
    words: NDArray[np.float64], at: int, element: Element, name: str
) -> tuple[dict[str, Values], int]:
    width = len(element.properties)
    if element.rows * width > len(words) - at:
        raise _short(name, element)
    if not any(p.length for p in element.properties):
        table = words[at : at + element.rows * width].reshape(element.rows, width)
        found = {p.name: Values(None, table[:, i]) for i, p in enumerate(element.properties)}
        return found, at + element.rows * width
    lists = np.array([p.length is not None for p in element.properties])
    starts, counts = np.zeros((element.rows, width), np.int64), np.ones((element.rows, width), np.int64)
    at = _chain_words(words, at, lists, starts, counts)
    if at < 0:
        raise _short(name, element)
    found = {}
    for i, p in enumerate(element.properties):
        found[p.name] = Values(counts[:, i] if p.length else None, words[_spread(starts[:, i], counts[:, i], 1)])
    return found, at


def _binary_rows(
    data: bytes, at: int, element: Element, order: str, name: str
) -> tuple[dict[str, Values], int]:
    properties = element.properties
    sizes = np.array([np.dtype(p.type).itemsize for p in properties], np.int64)
    heads = np.array([np.dtype(p.length).itemsize if p.length else 0 for p in properties], np.int64)
    if element.rows * int(np.where(heads > 0, heads, sizes).sum()) > len(data) - at:
        raise _short(name, element)
    if not heads.any():
        row = np.dtype([(f"p{i}", order + p.type) for i, p in enumerate(properties)])
        table = np.frombuffer(data, row, element.rows, at) if row.itemsize else np.zeros(0, row)
        found = {p.name: Values(None, table[f"p{i}"].astype(np.float64)) for i, p in enumerate(properties)}
        return found, at + element.rows * row.itemsize
    shape = (element.rows, len(properties))
    starts, counts = np.zeros(shape, np.int64), np.ones(shape, np.int64)
    text = np.frombuffer(data, np.uint8)
    signed = np.array([p.length is not None and p.length[0] == "i" for p in properties])
    at = _chain_bytes(text, at, sizes, heads, signed, order == ">", starts, counts)
    if at < 0:
        raise _short(name, element)
    found = {}
    for i, p in enumerate(properties):
        size = int(sizes[i])
        where = _spread(starts[:, i], counts[:, i], size)
        raw = np.empty((len(where), size), np.uint8)
        for byte in range(size):
            raw[:, byte] = text[where + byte]
        values = raw.reshape(-1).view(order + p.type).astype(np.float64)
        found[p.name] = Values(counts[:, i] if p.length else None, values)
    return found, at


def _spread(starts: NDArray[np.int64], counts: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    """Where each value of all rows lies: start, start + size, ... of each row."""
    firsts = np.cumsum(counts) - counts
    within = np.arange(int(counts.sum())) - np.repeat(firsts, counts)
    return np.repeat(starts, counts) + within * size


def _uvs(
    vertex: dict[str, Values], face: dict[str, Values], counts: NDArray[np.int64], corners: NDArray[np.int64]
) -> NDArray[np.float32] | None:
    by_corner = face.get("texcoord")
    if by_corner is not None and by_corner.counts is not None:
        whole = by_corner.counts == 2 * counts
        uvs = np.full((len(corners), 2), np.nan, np.float32)
        uvs[np.repeat(whole, counts)] = by_corner.values[np.repeat(whole, by_corner.counts)].reshape(-1, 2)
        return uvs
    for u, v in zip(U_NAMES, V_NAMES, strict=True):
        if u in vertex and v in vertex:
            by_vertex = np.stack([vertex[u].values, vertex[v].values], axis=1).astype(np.float32)
            return by_vertex[np.clip(corners, 0, len(by_vertex) - 1)]
    return None


_WORDS = types.Array(types.float64, 1, "C", readonly=True)
_TABLE = types.Array(types.int64, 2, "C")
_FLAGS = types.Array(types.boolean, 1, "C", readonly=True)
_SIZES = types.Array(types.int64, 1, "C", readonly=True)


@njit(types.int64(_WORDS, types.int64, _FLAGS, _TABLE, _TABLE), cache=True, nogil=True)
def _chain_words(words, at, lists, starts, counts):  # type: ignore[no-untyped-def]
    """Walk rows of words whose lists begin with their length; -1 when the words end before the rows."""
    for row in range(len(starts)):
        for i in range(len(lists)):
            count = 1
            if lists[i]:
                if at >= len(words) or not (0 <= words[at] <= len(words)):
                    return -1
                count = int(words[at])
                at += 1
            starts[row, i] = at
            counts[row, i] = count
            at += count
            if at > len(words):
                return -1
    return at


@njit(
    types.int64(BYTES, types.int64, _SIZES, _SIZES, _FLAGS, types.boolean, _TABLE, _TABLE),
    cache=True, nogil=True,
)  # fmt: skip
def _chain_bytes(data, at, sizes, heads, signed, big, starts, counts):  # type: ignore[no-untyped-def]
    """The same over bytes; `heads` holds the bytes of each list's length (0: no list)."""
    for row in range(len(starts)):
        for i in range(len(sizes)):
            count = np.int64(1)
            head = heads[i]
            if head > 0:
                if at + head > len(data):
                    return -1
                count = np.int64(0)
                for byte in range(head):
                    place = at + byte if big else at + head - 1 - byte
                    count = count * 256 + data[place]
                if signed[i] and count >= np.int64(1) << (8 * head - 1):
                    return -1
                at += head
            if count > len(data):
                return -1
            starts[row, i] = at
            counts[row, i] = count
            at += count * sizes[i]
            if at > len(data):
                return -1
    return at

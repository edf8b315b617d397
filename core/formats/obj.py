"""Wavefront OBJ: polygons, UVs of corners, groups and objects. Read by one pass over the bytes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.text_numbers import BYTES, POWERS, end_of_line, next_word, parse_number, text_bytes
from core.mesh.mesh import Mesh
from core.mesh.polygons import Polygons

NO_INDEX = -1  # a UV that was not given
BAD_INDEX = -2  # an index that is no number, zero, or before the beginning
GROUP, OBJECT, MATERIAL = 0, 1, 2


def read_obj(path: Path) -> Polygons:
    """The faces of an OBJ file, in the units and axes of the file.

    Negative indices, missing UVs, continued lines, any line ending and UTF-16 are understood. Parts are named
    ``object/group``, or after the material where a file has neither. Colours, normals, curves are left.

    Raises
    ------
    UserError
        When the file has no faces.
    """
    data = text_bytes(path.read_bytes(), path.name)
    if b"\\" in data:
        data = re.sub(rb"\\[ \t]*(\r\n|\r|\n)", b" ", data)
    text = np.frombuffer(data, np.uint8)
    vertices, texcoords, faces, corners, names, wires = _count(text)
    points, uvs = np.zeros((vertices, 3)), np.zeros((texcoords, 2))
    counts = np.zeros(faces, np.int64)
    corner_vertex, corner_uv = np.zeros(corners, np.int64), np.zeros(corners, np.int64)
    statements = np.zeros((names, 4), np.int64)
    _read(text, POWERS, points, uvs, counts, corner_vertex, corner_uv, statements)
    if not faces:
        holds = "only lines or points" if wires or vertices else "nothing that OBJ knows"
        raise UserError(f"{path.name} holds {holds} and no faces; export a polygon mesh.")
    parts, part_names = _parts(data, statements, faces)
    corner_uvs = None
    if (corner_uv != NO_INDEX).any():
        there = (corner_uv >= 0) & (corner_uv < texcoords)
        corner_uvs = np.full((corners, 2), np.nan, np.float32)
        corner_uvs[there] = uvs[corner_uv[there]]
    return Polygons(points, counts, corner_vertex, corner_uvs, parts, part_names)


def write_obj(path: Path, mesh: Mesh) -> None:
    """Write the polygons, their UVs and, as groups, their parts; numbers read back to the same float32."""
    lines = ["# metres, Y up\n"]
    lines += [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in mesh.points.tolist()]
    words = (mesh.corners + 1).astype(str).tolist()
    if mesh.uvs is not None:
        # both numbers as one 64-bit word, which sorts fast
        rows, which = np.unique(np.ascontiguousarray(mesh.uvs).view(np.uint64)[:, 0], return_inverse=True)
        lines += [f"vt {u:.9g} {v:.9g}\n" for u, v in rows.view(np.float32).reshape(-1, 2).tolist()]
        words = [f"{v}/{t}" for v, t in zip(words, (which + 1).tolist(), strict=True)]
    part = -1
    start = 0
    for count, belongs in zip(mesh.counts.tolist(), mesh.parts.tolist(), strict=True):
        if belongs != part:
            part = belongs
            lines.append(f"g {_one_word(mesh.part_names[part])}\n")
        lines.append("f " + " ".join(words[start : start + count]) + "\n")
        start += count
    path.write_text("".join(lines), encoding="utf-8", newline="\n")


def _one_word(name: str) -> str:
    return re.sub(r"\s+", "_", name) or "mesh"


def _parts(data: bytes, statements: NDArray[np.int64], faces: int) -> tuple[NDArray[np.int32], tuple[str, ...]]:
    """The part of each face and the names of the parts that have faces."""
    if not len(statements):
        return np.zeros(faces, np.int32), ("mesh",)
    following = np.append(statements[1:, 0], faces)
    has_name = np.isin(statements[:, 1], (GROUP, OBJECT)).any()
    words = {GROUP: "", OBJECT: "", MATERIAL: ""}
    rows: dict[str, int] = {}
    parts = np.zeros(faces, np.int32)
    if statements[0, 0]:
        rows["mesh"] = 0
    for (face, kind, start, stop), until in zip(statements.tolist(), following.tolist(), strict=True):
        words[kind] = data[start:stop].decode("utf-8", "replace").strip() if stop - start < 1000 else "unnamed"
        if until > face:
            name = "/".join(filter(None, (words[OBJECT], words[GROUP]))) if has_name else words[MATERIAL]
            parts[face:until] = rows.setdefault(name or "mesh", len(rows))
    return parts, tuple(rows)


@njit(types.Tuple([types.int64] * 6)(BYTES), cache=True, nogil=True)  # type: ignore[no-untyped-call]
def _count(data):  # type: ignore[no-untyped-def]
    """How many v, vt, f, corners of f, naming lines (g, o, usemtl), and lines of l or p."""
    vertices = texcoords = faces = corners = names = wires = 0
    size = len(data)
    at = 0
    while at < size:
        word, at = next_word(data, at, size)
        length = at - word
        c = data[word] if length else 0
        if length == 1 and c == 118:
            vertices += 1
        elif length == 2 and c == 118 and data[word + 1] == 116:
            texcoords += 1
        elif (length == 1 and c == 102) or (length == 2 and c == 102 and data[word + 1] == 111):
            faces += 1
            blank = True
            while at < size and data[at] != 10 and data[at] != 13 and data[at] != 35:
                now = data[at] <= 32
                if blank and not now:
                    corners += 1
                blank = now
                at += 1
        elif (length == 1 and c in (103, 111)) or (
            length == 6 and c == 117 and data[word + 1] == 115 and data[word + 3] == 109
        ):
            names += 1
        elif length == 1 and c in (108, 112):
            wires += 1
        at = end_of_line(data, at)
    return vertices, texcoords, faces, corners, names, wires


@njit(
    types.void(
        BYTES, types.Array(types.float64, 1, "C", readonly=True), types.Array(types.float64, 2, "C"),
        types.Array(types.float64, 2, "C"), types.Array(types.int64, 1, "C"), types.Array(types.int64, 1, "C"),
        types.Array(types.int64, 1, "C"), types.Array(types.int64, 2, "C"),
    ),
    cache=True, nogil=True,
)  # fmt: skip
def _read(data, powers, points, uvs, counts, corner_vertex, corner_uv, statements):  # type: ignore[no-untyped-def]
    """Fill what `_count` has counted; each statement: first face, kind, first and last byte of its name."""
    vertices = texcoords = faces = corners = names = 0
    size = len(data)
    at = 0
    while at < size:
        word, at = next_word(data, at, size)
        length = at - word
        c = data[word] if length else 0
        end = end_of_line(data, at)
        if (length == 1 and c == 118) or (length == 2 and c == 118 and data[word + 1] == 116):
            wanted = 3 if length == 1 else 2
            for axis in range(wanted):
                start, at = next_word(data, at, end)
                value = parse_number(data, start, at, powers)
                if length == 1:
                    points[vertices, axis] = value
                elif start < end:  # "vt u" alone leaves v at 0
                    uvs[texcoords, axis] = value
            if length == 1:
                vertices += 1
            else:
                texcoords += 1
        elif (length == 1 and c == 102) or (length == 2 and c == 102 and data[word + 1] == 111):
            first = corners
            while True:
                while at < end and data[at] <= 32:
                    at += 1
                if at >= end or data[at] == 35:
                    break
                field = 0
                corner_vertex[corners] = -2
                corner_uv[corners] = -1
                while at < end and data[at] > 32 and data[at] != 35 and field < 2:
                    negative = data[at] == 45
                    if negative or data[at] == 43:
                        at += 1
                    value = np.int64(0)
                    digits = 0
                    while at < end and 48 <= data[at] <= 57:
                        value = min(value * 10 + (data[at] - 48), np.int64(1) << 40)
                        digits += 1
                        at += 1
                    good = at >= end or data[at] <= 32 or data[at] == 47 or data[at] == 35
                    known = vertices if field == 0 else texcoords
                    index = known - value if negative else value - 1
                    if not good or digits == 0 or value == 0 or index < 0:
                        index = -2
                    if field == 0:
                        corner_vertex[corners] = index
                    elif digits > 0 or not good:
                        corner_uv[corners] = index
                    while at < end and data[at] > 32 and data[at] != 47:
                        at += 1
                    if at < end and data[at] == 47:
                        at += 1
                    field += 1
                while at < end and data[at] > 32:
                    at += 1
                corners += 1
            counts[faces] = corners - first
            faces += 1
        else:
            kind = -1
            if length == 1 and c == 103:
                kind = 0
            elif length == 1 and c == 111:
                kind = 1
            elif length == 6 and c == 117 and data[word + 1] == 115 and data[word + 3] == 109:
                kind = 2
            if kind >= 0:
                statements[names, 0] = faces
                statements[names, 1] = kind
                statements[names, 2] = at
                statements[names, 3] = end
                names += 1
        at = end

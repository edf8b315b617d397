"""STL: triangles without shared vertices, as text or binary."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numba import njit, types

from core.errors import UserError
from core.formats.text_numbers import BYTES, POWERS, end_of_line, next_word, parse_number, text_bytes
from core.mesh.mesh import Mesh
from core.mesh.polygons import Polygons
from core.mesh.triangulate import triangulate

FACET = np.dtype([("normal", "<f4", 3), ("points", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(path: Path) -> Polygons:
    """The triangles of an STL file, three vertices each; the repair joins them.

    Raises
    ------
    UserError
        When there are no triangles or the file is cut short.
    """
    data = path.read_bytes()
    said = int.from_bytes(data[80:84], "little")
    is_text = data[:256].lstrip().lower().startswith(b"solid") and len(data) != 84 + 50 * said
    if (is_text and b"facet" in data[:4096].lower()) or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return _read_text(text_bytes(data, path.name), path.name)
    if is_text and b"endsolid" in data[:4096].lower():
        raise UserError(f"{path.name} has no triangles; export a polygon mesh.")
    if len(data) < 84 + 50 * said or len(data) < 84:
        raise UserError(f"{path.name} is cut short or no STL file; export or copy it again.")
    if not said:
        raise UserError(f"{path.name} has no triangles; export a polygon mesh.")
    facets = np.frombuffer(data, FACET, said, 84)
    name = data[:80].split(b"\0")[0].decode("latin-1").strip()
    name = re.sub(r"^solid\s*", "", name) if name.isprintable() else ""
    return _soup(facets["points"].reshape(-1, 3).astype(np.float64), np.zeros(said, np.int32), (name or "mesh",))


def write_stl(path: Path, mesh: Mesh) -> None:
    """Write a binary STL: triangles only, metres, Y up; UVs, parts and polygons are lost."""
    p = mesh.points[triangulate(mesh).vertices]
    facets = np.zeros(len(p), FACET)
    normal = np.cross((p[:, 1] - p[:, 0]).astype(np.float64), p[:, 2] - p[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    facets["normal"] = normal / np.where(length > 0, length, 1)
    facets["points"] = p
    header = b"Filoplume, metres, Y up".ljust(80, b"\0")  # must not begin with "solid"
    path.write_bytes(header + len(p).to_bytes(4, "little") + facets.tobytes())


def _read_text(data: bytes, name: str) -> Polygons:
    text = np.frombuffer(data, np.uint8)
    points = np.empty((data.lower().count(b"vertex"), 3))
    found = _read_vertices(text, POWERS, points)
    triangles = found // 3
    if not triangles:
        raise UserError(f"{name} has no triangles; export a polygon mesh.")
    # one part for each "solid NAME" that has facets
    parts = np.zeros(triangles, np.int32)
    names: list[str] = []
    at = 0
    for piece in re.split(rb"(?im)^[ \t]*endsolid\b", data):
        match = re.search(rb"(?im)^[ \t]*solid\b([^\r\n]{0,200})", piece)
        size = len(re.findall(rb"(?i)\bendfacet\b", piece))
        if size:
            parts[at : at + size] = len(names)
            at += size
            names.append((match[1].decode("utf-8", "replace").strip() if match else "") or "mesh")
    return _soup(points[: triangles * 3], parts, tuple(names) or ("mesh",))


def _soup(points: np.ndarray, parts: np.ndarray, names: tuple[str, ...]) -> Polygons:
    return Polygons(points, np.full(len(parts), 3), np.arange(len(points)), None, parts, names)


@njit(
    types.int64(BYTES, types.Array(types.float64, 1, "C", readonly=True), types.Array(types.float64, 2, "C")),
    cache=True, nogil=True,
)  # fmt: skip
def _read_vertices(data, powers, points):  # type: ignore[no-untyped-def]
    """The three numbers after each word "vertex"; returns how many there were."""
    size = len(data)
    found = 0
    at = 0
    while at < size:
        start, at = next_word(data, at, size)
        last = at - start - 1
        if last in (4, 7) and data[start + last] | 32 == 100 and data[start + last - 4] | 32 == 115:
            at = end_of_line(data, at)  # "solid" and "endsolid" are followed by a name
            continue
        is_vertex = (
            at - start == 6 and data[start] | 32 == 118 and data[start + 1] | 32 == 101 and data[start + 2] | 32 == 114
            and data[start + 3] | 32 == 116 and data[start + 4] | 32 == 101 and data[start + 5] | 32 == 120
        )  # fmt: skip
        if is_vertex and found < len(points):
            for axis in range(3):
                start, at = next_word(data, at, size)
                points[found, axis] = parse_number(data, start, at, powers)
            found += 1
    return found
